"""What the artist reads: reports and the log, and all of it in the artist's language."""
