"""Which expression does a drawing show? One small CNN per action unit on a shared trunk.

`load_detector().detect(drawing)` needs numpy and ONNX Runtime. How the networks are made and
measured is in `classifiers.training`, which needs torch and does not ship.

What it offers stands in `__init__.pyi` and is loaded when it is first used: Blender loads the
package at every start.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
