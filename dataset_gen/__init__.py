"""Drawings of the face with the parameters that made them: the data set.

What it offers stands in `__init__.pyi` and is loaded when it is first used: a fit needs the lines
of a face (`linework`), and none of the rest.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
