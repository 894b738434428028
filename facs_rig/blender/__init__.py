"""The face as an object in Blender. Only this package needs bpy."""

from .build import (
    BASIS,
    FITTED,
    build_face,
    build_steps,
    build_when,
    paint_of,
    prepare,
    set_identity,
    to_blender,
)

__all__ = [
    "BASIS", "FITTED", "build_face", "build_steps", "build_when", "paint_of", "prepare",
    "set_identity", "to_blender",
]  # fmt: skip
