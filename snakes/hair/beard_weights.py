"""Weights of the logistic regressions by which beards are found; of beard_seen's terms.

Written by tests/benchmarks/refit_beard.py: do not change them by hand, run it.
"""

BEARDED = (3.99, 1.40, 0.61, 4.96)
"""Of a drawing, as `chin_says`, and what is added: above 0 there is a beard."""
MOUSTACHE = (-3.23, 12.86, 1.21, 0.30, -6.09, -2.80)
"""Of a drawing, as `lip_says`, and what is added: above 0 there is a moustache alone."""
COVER = (0.84, 1.31, 1.65, 0.60, 0.60)
"""Of a place of a bearded face, as `places_say`, and what is added: above 0 hair grows there."""
TEMPLATED = (0.76, 1.12, 1.61, 1.36, 0.85, -0.25)
"""The same where the likeliest shape of a beard is known; its cover comes fifth."""
BELOW_JAW = (1.70, 2.80, 2.30, -1.84, 0.28)
"""COVER of what hangs below the jaw."""
