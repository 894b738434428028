"""Weights of the logistic regressions by which beards are found; of beard_seen's terms.

Written by tests/benchmarks/refit_beard.py: do not change them by hand, run it.
"""

BEARDED = (1.20, 0.83, 0.49, 4.67)
"""Of a drawing, as `chin_says`, and what is added: above 0 there is a beard."""
MOUSTACHE = (-4.65, 12.46, 0.99, 0.40, -8.16, -2.12)
"""Of a drawing, as `lip_says`, and what is added: above 0 there is a moustache alone."""
COVER = (0.57, -1.82, 5.09, 0.53, -0.22)
"""Of a place of a bearded face, as `places_say`, and what is added: above 0 hair grows there."""
TEMPLATED = (0.56, -1.76, 4.99, 0.73, 0.21, -0.41)
"""The same where the likeliest shape of a beard is known; its cover comes fifth."""
BELOW_JAW = (0.77, -2.73, 8.54, -0.37, -1.06)
"""COVER of what hangs below the jaw."""
