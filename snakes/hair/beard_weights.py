"""Weights of the logistic regressions by which beards are found; of beard_seen's terms.

Written by tests/benchmarks/refit_beard.py: do not change them by hand, run it.
"""

BEARDED = (1.34, 0.79, 0.55, 4.63)
"""Of a drawing, as `chin_says`, and what is added: above 0 there is a beard."""
MOUSTACHE = (-5.02, 12.89, 1.02, 0.21, -8.24, -3.16)
"""Of a drawing, as `lip_says`, and what is added: above 0 there is a moustache alone."""
COVER = (0.54, -1.57, 5.10, 0.47, -0.25)
"""Of a place of a bearded face, as `places_say`, and what is added: above 0 hair grows there."""
TEMPLATED = (0.52, -1.48, 4.95, 0.74, 0.28, -0.50)
"""The same where the likeliest shape of a beard is known; its cover comes fifth."""
BELOW_JAW = (0.70, -2.30, 8.35, -0.59, -1.09)
"""COVER of what hangs below the jaw."""
