"""Faces of every level of detail do in Blender what the full one does."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from facs_rig import FaceParameters  # noqa: E402
from facs_rig.blender import build_face, set_identity  # noqa: E402
from facs_rig.blender.pose import DETAIL, pose_of, rig_of, set_pose  # noqa: E402
from facs_rig.blender.reshape import fitted_offsets, reshape  # noqa: E402
from facs_rig.blender.shape import moves, shown  # noqa: E402
from facs_rig.blender.steps import finish  # noqa: E402
from facs_rig.common.errors import InputError  # noqa: E402
from facs_rig.levels import LEVELS, at_level  # noqa: E402

from .test_build_face import TOLERANCE, a_pose, names_of  # noqa: E402

EACH = pytest.mark.parametrize("level", [level for level in LEVELS if level != "full"])


@EACH
@pytest.mark.parametrize("identity_keys", [False, True])
def test_sliders_bones_and_people_as_in_numpy(rig, evaluated, level, identity_keys):
    few = at_level(rig, level)
    parameters = a_pose(1, someone=True)
    face = build_face("Face", few, parameters, identity_keys=identity_keys)
    assert face[DETAIL] == level and rig_of(face, rig) is few
    assert names_of(face)[1 : 1 + len(rig.keys)] == [key.name for key in rig.keys]
    assert np.abs(evaluated(face) - few.pose(parameters)).max() < TOLERANCE
    other = a_pose(2, someone=True)
    (set_identity if identity_keys else reshape)(face, rig, other.identity)
    set_pose(face, other)
    assert np.abs(evaluated(face) - few.pose(other)).max() < TOLERANCE
    assert pose_of(face).aus == pytest.approx(other.aus)


@EACH
def test_a_full_fits_offsets_come_onto_the_vertices_that_stayed(rig, evaluated, level):
    few = at_level(rig, level)
    face = build_face("Face", few, FaceParameters())
    offsets = np.random.default_rng(0).normal(0, 0.002, (rig.n_vertices, 3)).astype(np.float32)
    reshape(face, rig, {"age": 0.5}, offsets)
    assert np.abs(fitted_offsets(face) - offsets[few.of_full]).max() < 1e-6
    there = few.pose(FaceParameters(identity={"age": 0.5}), offsets[few.of_full])
    assert np.abs(evaluated(face) - there).max() < TOLERANCE
    reshape(face, rig, {}, fitted_offsets(face))
    assert np.abs(fitted_offsets(face) - offsets[few.of_full]).max() < 1e-6


@EACH
@pytest.mark.parametrize("names", ["ours", "arkit"])
def test_what_is_shown_can_be_exported(rig, level, names):
    few = at_level(rig, level)
    face = build_face("Face", few, FaceParameters({"smile": 3.0}))
    shape = shown(face, rig)
    assert np.abs(shape.points - few.pose(FaceParameters({"smile": 3.0}))).max() < TOLERANCE
    assert shape.part_names == few.part_names and len(shape.triangles) == len(few.triangles)
    found = finish(moves(face, rig, shape, names))
    assert len(found) == (52 if names == "arkit" else 47) + 1
    assert all(move.shape == (few.n_vertices, 3) for move in found.values())


@EACH
def test_the_add_menu_offers_it_and_its_sliders_live(level):
    from addon import blender

    blender.register()
    try:
        bpy.ops.mesh.add_facs_face(detail=level, identity_keys=False)
        face = bpy.context.object
        assert face[DETAIL] == level
        assert bpy.ops.sketch_to_face.random_person(seed=3) == {"FINISHED"}
        assert bpy.ops.sketch_to_face.random_expression(seed=3) == {"FINISHED"}
    finally:
        blender.unregister()


def test_a_level_of_a_newer_version_is_refused_in_a_sentence(rig):
    face = build_face("Face", at_level(rig, "game"), FaceParameters())
    face[DETAIL] = "film"
    with pytest.raises(InputError, match="level of detail 'film'"):
        reshape(face, rig, {"age": 1.0})
