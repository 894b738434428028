"""The beard of Blender's face: a mesh of its own beside it, which goes with the face's skin.

A modifier of geometry nodes looks up where the face's vertices around each hair are and moves it
along: with every slider, bone, key and edit of the face, whoever it becomes. So nothing has to be
done to it when the face changes, and a file needs no add-on to show it. What it was made of, a
`Beard`, is remembered on it and on the face.
"""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from facs_rig.beard.beard import Beard, from_json, to_json
from facs_rig.beard.follow import Bound
from facs_rig.beard.mesh import BeardMesh, beard_mesh
from facs_rig.blender.armature import armature_of, to_blender
from facs_rig.blender.arrays import make_mesh, write_map
from facs_rig.blender.beard_nodes import MODIFIER, SKULL, followed, following
from facs_rig.blender.hair import MADE_IN, MAP, SHADE, discard_worn, exchange_mesh, hair_material
from facs_rig.blender.pose import identity_of, rig_of
from facs_rig.common.errors import InputError
from facs_rig.rig import FaceRig

__all__ = [
    "add_beard", "beard_of", "bound_of", "check_beard", "grow", "has_beard", "is_beard",
    "made_of", "remove_beard",
]  # fmt: skip

MARK, VERSION = "facs_beard", 1  # property of the beard object: version of its make-up
KEPT = "facs_beard_kept"  # property of the beard object and of its face
MATERIAL = "Beard"
# Attributes of the vertices: see facs_rig.beard.follow.Bound.
INDEX, ANCHOR = ("root_0", "root_1", "root_2"), ("by_0", "by_1", "by_2")
WEIGHT, TURNED, STIFF, REST = "root_weight", "turned", "stiff", "rest"


def beard_of(face: bpy.types.Object) -> bpy.types.Object | None:
    """The beard that hangs on a face's armature and follows this face; None if there is none."""
    armature = armature_of(face)
    if armature is None:
        return None
    mine = (child for child in armature.children if is_beard(child))
    return next((beard for beard in mine if followed(beard) in (None, face)), None)


def is_beard(candidate: bpy.types.Object) -> bool:
    """Whether this object is the beard of a face."""
    return candidate.type == "MESH" and MARK in candidate


def has_beard(face: bpy.types.Object) -> bool:
    """Whether `made_of` knows any, without reading it."""
    return KEPT in face or beard_of(face) is not None


def made_of(face: bpy.types.Object) -> Beard | None:
    """What the beard of a face is made of, or was before it was taken away; None if it never had
    any. InputError for what is not as we wrote it."""
    beard = beard_of(face)
    text = face.get(KEPT) if beard is None else beard.get(KEPT, face.get(KEPT))
    if text is None:
        return None
    if not isinstance(text, str):
        raise InputError(f"what is kept of the beard of '{face.name}' is no text")
    return from_json(text)


def check_beard(face: bpy.types.Object) -> None:
    """InputError, one sentence, if the beard of a face cannot be written."""
    beard = beard_of(face)
    if beard is None:
        return
    if beard.library or beard.override_library or beard.data.library:
        raise InputError(f"'{beard.name}' is linked from another file; make it and its mesh local")
    if beard.mode != "OBJECT":
        raise InputError(f"'{beard.name}' is being edited; go to Object Mode first")


def add_beard(
    face: bpy.types.Object,
    rig: FaceRig,
    beard: Beard,
    collection: bpy.types.Collection | None = None,
) -> bpy.types.Object | None:
    """Make the beard of a face, or make what it has anew; return its object, None where nothing
    grows.

    rig : the full one, whatever the face's level of detail
    collection : where a new object is linked; those of the face if None
    Raises InputError, with nothing changed: as `grow`.
    """
    check_beard(face)
    made = beard_mesh(rig_of(face, rig), identity_of(face), beard)
    if made is None:
        remove_beard(face)
        return None
    return grow(face, made, collection)


def grow(
    face: bpy.types.Object, made: BeardMesh, collection: bpy.types.Collection | None = None
) -> bpy.types.Object:
    """Put a beard that was made for this person on a face; return its object.

    One that is there keeps its object and material, and the colour that the artist gave it.
    Raises InputError, with nothing changed, for a face without its armature and as `check_beard`.
    """
    check_beard(face)
    armature, beard = armature_of(face), beard_of(face)
    if armature is None:
        raise InputError(f"'{face.name}' has lost its bones, which carry the beard; add a new face")
    name, kept = f"{face.name} Beard", to_json(made.beard)
    mesh = _mesh(name, made)
    if beard is None:
        beard = bpy.data.objects.new(name, mesh)
        mesh.materials.append(_material(made.colour))
        beard.parent = armature
    else:
        exchange_mesh(beard, mesh, made.colour, _material)
    if beard.modifiers.get(MODIFIER) is None or followed(beard) is None:
        following(beard, face)
    beard[MARK], beard[MADE_IN] = VERSION, list(made.colour)
    beard[KEPT] = face[KEPT] = kept
    if not beard.users_collection:
        for home in (collection,) if collection is not None else face.users_collection:
            home.objects.link(beard)
    return beard


def remove_beard(face: bpy.types.Object) -> None:
    """Take the beard of a face away, with all that it alone uses; no error without any.

    The face remembers it. InputError as `check_beard`.
    """
    check_beard(face)
    beard = beard_of(face)
    if beard is None:
        return
    groups = {m.node_group for m in beard.modifiers if m.type == "NODES" and m.node_group}
    discard_worn(beard)
    for group in groups:
        if not group.users:
            bpy.data.node_groups.remove(group)


def bound_of(beard: bpy.types.Object) -> Bound | None:
    """How its vertices follow the face, each by a root of its own; None where that was lost."""
    mesh, n = beard.data, len(beard.data.vertices)
    names = (*INDEX, *ANCHOR, WEIGHT, TURNED, STIFF)
    if any(name not in mesh.attributes or len(mesh.attributes[name].data) != n for name in names):
        return None
    index, anchors = (np.stack([_ints(mesh, name) for name in row], 1) for row in (INDEX, ANCHOR))
    weight, turned, stiff = (_vectors(mesh, name) for name in (WEIGHT, TURNED, STIFF))
    skull = beard.data.get(SKULL)
    if skull is None or len(skull) != 3:
        return None
    return Bound(
        index, weight, anchors, np.array(skull, np.int32), np.arange(n, dtype=np.int32), turned,
        stiff,
    )  # fmt: skip


def _mesh(name: str, made: BeardMesh) -> bpy.types.Mesh:
    """The mesh of a beard with all that its nodes read; nothing is left of it after an error."""
    triangle = made.quads[:, 2] == made.quads[:, 3]
    sizes = np.where(triangle, 3, 4)
    corners = made.quads[np.arange(4) < sizes[:, None]].astype(np.int32)
    starts = (np.cumsum(sizes) - sizes).astype(np.int32)
    mesh = make_mesh(name, to_blender(made.points), corners, starts)
    try:
        mesh.update(calc_edges=True)
        mesh.uv_layers.new(name=MAP)
        write_map(mesh.uv_layers[MAP], made.uv[corners])
        bound = made.bound
        _write(mesh, SHADE, "FLOAT", made.shade)
        for k in range(3):
            _write(mesh, INDEX[k], "INT", bound.index[bound.root, k])
            _write(mesh, ANCHOR[k], "INT", bound.anchors[bound.root, k])
        _write(mesh, WEIGHT, "FLOAT_VECTOR", bound.weight[bound.root])
        _write(mesh, TURNED, "FLOAT_VECTOR", bound.turned)
        _write(mesh, STIFF, "FLOAT_VECTOR", bound.stiff)
        _write(mesh, REST, "FLOAT_VECTOR", to_blender(made.points))
        mesh[SKULL] = [int(k) for k in bound.skull]
    except BaseException:
        bpy.data.meshes.remove(mesh)
        raise
    return mesh


def _write(mesh: bpy.types.Mesh, name: str, kind: str, values: NDArray) -> None:
    """Values of the vertices as an attribute: FLOAT (n,), INT (n,) or FLOAT_VECTOR (n, 3)."""
    mesh.attributes.new(name, kind, "POINT")
    dtype = np.int32 if kind == "INT" else np.float32
    field = "vector" if kind == "FLOAT_VECTOR" else "value"
    flat = np.ascontiguousarray(values, dtype=dtype).reshape(-1)
    mesh.attributes[name].data.foreach_set(field, flat)


def _ints(mesh: bpy.types.Mesh, name: str) -> NDArray[np.int32]:
    out = np.empty(len(mesh.vertices), dtype=np.int32)
    mesh.attributes[name].data.foreach_get("value", out)
    return out


def _vectors(mesh: bpy.types.Mesh, name: str) -> NDArray[np.float32]:
    out = np.empty((len(mesh.vertices), 3), dtype=np.float32)
    mesh.attributes[name].data.foreach_get("vector", out.reshape(-1))
    return out


def _material(colour: tuple[float, float, float]) -> bpy.types.Material:
    material = hair_material(colour)
    material.name = MATERIAL
    return material
