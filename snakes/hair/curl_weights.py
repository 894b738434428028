"""Weights of the logistic regression by which curls are told; of texture.curls_say's terms.

Written by tests/benchmarks/refit_curls.py: do not change them by hand, run it.
"""

CURLY = (2.78, -3.01, 0.77, -0.20, 0.41, -7.92)
"""Of a region of hair, as `curls_say`, and what is added: above 0 it is curly."""
