"""A posed face is brought to the lines of a sketch: by its own lines, or as in the thesis.

What it offers stands in `__init__.pyi` and is loaded when it is first used: whoever only shows the
tweakables, as Blender's panel does at every start, does not wait for scipy.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
