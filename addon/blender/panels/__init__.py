"""What is seen in the sidebar, from top to bottom."""

from . import face, fit, hair, presets, retarget, sketch

MODULES = (presets, sketch, fit, face, hair, retarget)
