"""Which expression does a drawing show? One small CNN per action unit on a shared trunk.

`load_detector().detect(drawing)` needs numpy and ONNX Runtime; training (`classifiers.train`) needs
torch, evaluation (`classifiers.evaluate`) a folder of shards.
"""

from .detector import Detection, Detector, load_detector

__all__ = ["Detection", "Detector", "load_detector"]
