"""Weights of the logistic regression that tells curls, of texture.curls_say's terms.

Written by tests/benchmarks/refit_curls.py: do not change them by hand, run it.
"""

CURLY = (2.95, -3.16, 0.73, -0.18, 0.39, -8.07)
"""Of a region of hair, as `curls_say`, and what is added: above 0 it is curly."""
