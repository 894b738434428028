"""Weights of the logistic regressions by which beards are found; of beard_seen's terms.

Written by tests/benchmarks/refit_beard.py: do not change them by hand, run it.
"""

BEARDED = (6.67, 1.47, 0.54, 4.34)
"""Of a drawing, as `chin_says`, and what is added: above 0 there is a beard."""
MOUSTACHE = (-3.92, 11.92, 0.80, 0.12, -7.84, -3.75)
"""Of a drawing, as `lip_says`, and what is added: above 0 there is a moustache alone."""
COVER = (0.49, -0.19, 4.43, -0.29, -0.24)
"""Of a place of a bearded face, as `places_say`, and what is added: above 0 hair grows there."""
TEMPLATED = (0.46, -0.15, 4.22, 0.26, 0.53, -0.72)
"""The same where the likeliest shape of a beard is known; its cover comes fifth."""
BELOW_JAW = (1.04, -0.87, 4.38, -1.06, -0.52)
"""COVER of what hangs below the jaw."""
