from .anatomy import LANDMARKS, LANDMARKS_68
from .camera import Camera
from .controls import (
    ARKIT_NAMES,
    CONTROL_NAMES,
    CONTROLS,
    FULL_INTENSITY,
    MAX_INTENSITY,
    TWELVE,
    Control,
)
from .identity import IDENTITY, Feature
from .parameters import FaceParameters
from .raster import Buffers, rasterise, shade, visible
from .rig import FaceRig, landmark_points, load_rig

__all__ = [
    "ARKIT_NAMES", "CONTROLS", "CONTROL_NAMES", "TWELVE", "FULL_INTENSITY", "IDENTITY",
    "LANDMARKS", "LANDMARKS_68", "MAX_INTENSITY", "Buffers", "Camera", "Control", "FaceParameters",
    "FaceRig", "Feature", "landmark_points", "load_rig", "rasterise", "shade", "visible",
]  # fmt: skip
