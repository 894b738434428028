"""Which expression does a drawing show? One small CNN per action unit on a shared trunk.

`load_detector().detect(drawing)` needs numpy and ONNX Runtime. How the networks are made and
measured is in `classifiers.training`, which needs torch and does not ship.
"""

from .detector import Detection, Detector, load_detector

__all__ = ["Detection", "Detector", "load_detector"]
