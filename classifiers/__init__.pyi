from .detector import Detection, Detector, load_detector

__all__ = ["Detection", "Detector", "load_detector"]
