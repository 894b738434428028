"""All that a face wears in Blender: hair, its strands, a hat, a beard."""

from __future__ import annotations

import bpy

from facs_rig.blender.beard import beard_of, is_beard
from facs_rig.blender.hair_follows import carried_by, is_curves, is_hair, is_hat


def is_worn(candidate: bpy.types.Object) -> bool:
    """Whether this object is something that a face wears."""
    return any(is_one(candidate) for is_one in (is_hair, is_curves, is_hat, is_beard))


def worn_by(face: bpy.types.Object) -> list[bpy.types.Object]:
    """The objects that a face wears."""
    beard = beard_of(face)
    return [*carried_by(face), *([] if beard is None else [beard])]
