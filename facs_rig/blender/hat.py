"""The hat of Blender's face: a mesh of its own beside face and hair, which the bone of the head
carries. It is found by a mark, whatever it is called."""

from __future__ import annotations

from collections.abc import Mapping

import bpy

from facs_rig.blender.armature import armature_of
from facs_rig.blender.hair import (
    MADE_IN,
    discard_worn,
    exchange_mesh,
    hair_material,
    hang,
    worn_mesh,
)
from facs_rig.blender.hair_follows import HAT_MARK, VERSION, check_hair, hat_of
from facs_rig.common.errors import InputError
from facs_rig.hair.hat import ROUGHNESS, HatMesh

__all__ = ["hat_of", "put_on", "take_off"]


def put_on(
    face: bpy.types.Object,
    made: HatMesh,
    identity: Mapping[str, float],
    collection: bpy.types.Collection | None = None,
) -> bpy.types.Object:
    """Put a hat that was made for this person on a face; return the hat object.

    A hat that is there keeps its object and material, and the colour that the artist gave it.
    collection : where a new object is linked; those of the face if None
    Raises InputError, with nothing changed, for a face without its armature and as `check_hair`.
    """
    check_hair(face)
    armature, hat = armature_of(face), hat_of(face)
    if armature is None:
        raise InputError(f"'{face.name}' has lost its bones, which carry the hat; add a new face")
    name = f"{face.name} Hat"
    mesh = worn_mesh(name, made, identity)
    if hat is None:
        hat = bpy.data.objects.new(name, mesh)
        mesh.materials.append(_material(made.colour))
        hat.parent = armature
    else:
        exchange_mesh(hat, mesh, made.colour, _material)
    hang(hat, armature)
    hat[HAT_MARK], hat[MADE_IN] = VERSION, list(made.colour)
    if not hat.users_collection:
        for home in (collection,) if collection is not None else face.users_collection:
            home.objects.link(hat)
    return hat


def take_off(face: bpy.types.Object) -> None:
    """Take the hat of a face away, with all that it alone uses; no error without any. InputError
    as `check_hair`."""
    check_hair(face)
    if (hat := hat_of(face)) is not None:
        discard_worn(hat)


def _material(colour: tuple[float, float, float]) -> bpy.types.Material:
    return hair_material(colour, "Hat", ROUGHNESS)
