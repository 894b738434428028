"""Weights of the logistic regressions by which beards are found; of beard_seen's terms.

Written by tests/benchmarks/refit_beard.py: do not change them by hand, run it.
"""

BEARDED = (2.99, 0.83, 1.03, 7.65)
"""Of a drawing, as `chin_says`, and what is added: above 0 there is a beard."""
MOUSTACHE = (-3.26, 13.07, 0.91, 0.66, -4.97, -0.69)
"""Of a drawing, as `lip_says`, and what is added: above 0 there is a moustache alone."""
COVER = (0.64, 0.48, 2.16, 0.46, 0.80)
"""Of a place of a bearded face, as `places_say`, and what is added: above 0 hair grows there."""
TEMPLATED = (0.60, 0.45, 2.06, 0.98, 0.59, 0.21)
"""The same where the likeliest shape of a beard is known; its cover comes fifth."""
BELOW_JAW = (0.96, 1.01, 5.66, -1.85, -0.39)
"""COVER of what hangs below the jaw."""
