"""Weights of the logistic regressions by which beards are found; of beard_seen's terms.

Written by tests/benchmarks/refit_beard.py: do not change them by hand, run it.
"""

BEARDED = (5.70, 0.49, 0.85, 5.99)
"""Of a drawing, as `chin_says`, and what is added: above 0 there is a beard."""
MOUSTACHE = (-3.17, 13.33, 1.13, 0.48, -4.59, -1.58)
"""Of a drawing, as `lip_says`, and what is added: above 0 there is a moustache alone."""
COVER = (0.41, 0.34, 2.27, -0.42, 0.96)
"""Of a place of a bearded face, as `places_say`, and what is added: above 0 hair grows there."""
TEMPLATED = (0.38, 0.31, 2.16, 0.16, 0.57, 0.38)
"""The same where the likeliest shape of a beard is known; its cover comes fifth."""
BELOW_JAW = (0.43, 1.69, 5.85, -1.75, -1.32)
"""COVER of what hangs below the jaw."""
