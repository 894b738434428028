"""Hair as it is drawn: where it lies on the page, and the head of hair that looks so."""
