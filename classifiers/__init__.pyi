from .detection import Detection
from .detector import Detector, load_detector

__all__ = ["Detection", "Detector", "load_detector"]
