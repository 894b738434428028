"""Weights of the logistic regressions by which beards are found; of beard_seen's terms.

Written by tests/benchmarks/refit_beard.py: do not change them by hand, run it.
"""

BEARDED = (3.52, 0.76, 0.98, 6.54)
"""Of a drawing, as `chin_says`, and what is added: above 0 there is a beard."""
MOUSTACHE = (-6.29, 15.41, 0.59, 0.59, -5.94, -1.52)
"""Of a drawing, as `lip_says`, and what is added: above 0 there is a moustache alone."""
COVER = (0.70, 0.46, 2.07, 0.88, 0.78)
"""Of a place of a bearded face, as `places_say`, and what is added: above 0 hair grows there."""
TEMPLATED = (0.67, 0.40, 2.02, 1.26, 0.42, 0.35)
"""The same where the likeliest shape of a beard is known; its cover comes fifth."""
BELOW_JAW = (1.01, 1.15, 5.26, -1.83, -0.07)
"""COVER of what hangs below the jaw."""
