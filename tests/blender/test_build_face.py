"""The Blender object does what the rig does in numpy."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from facs_rig import CONTROL_NAMES, FaceParameters  # noqa: E402
from facs_rig.blender import build_face, to_blender  # noqa: E402
from facs_rig.paint import MATERIALS  # noqa: E402

TOLERANCE = 1e-5  # metres


def test_axes_turn_the_face_to_minus_y():
    toward_viewer, up, own_left = np.eye(3)[[2, 1, 0]]
    assert to_blender(toward_viewer).tolist() == [0, -1, 0]
    assert to_blender(up).tolist() == [0, 0, 1]
    assert to_blender(own_left).tolist() == [1, 0, 0]


def test_neutral_face_has_a_key_for_each_control(rig, evaluated):
    face = build_face("Face", rig, FaceParameters())
    keys = face.data.shape_keys.key_blocks
    assert [k.name for k in keys] == ["Basis", *CONTROL_NAMES]
    assert all(k.value == 0 and k.slider_min == 0 and k.slider_max == 2 for k in list(keys)[1:])
    assert all(p.use_smooth for p in face.data.polygons)
    assert np.abs(evaluated(face) - rig.neutral()).max() < TOLERANCE


def test_polygons_and_materials_follow_the_rig(rig):
    face = build_face("Face", rig, FaceParameters())
    assert len(face.data.vertices) == rig.n_vertices
    flat = [v for p in face.data.polygons for v in p.vertices]
    assert flat == list(rig.polygon_vertices)
    assert [m.name for m in face.data.materials] == [f"Face {n.capitalize()}" for n in MATERIALS]
    slots = list(MATERIALS)
    part_of_slot = {s: s for s in slots} | {"iris": "eyes", "pupil": "eyes"}
    part_of_slot |= dict.fromkeys(("brows", "lips", "mouth"), "skin")
    used = set()
    for polygon in face.data.polygons:
        part = part_of_slot[slots[polygon.material_index]]
        assert rig.parts[part][polygon.vertices[0]]
        used.add(slots[polygon.material_index])
    assert used == set(slots)


def test_two_faces_share_their_materials(rig):
    build_face("One", rig, FaceParameters())
    build_face("Two", rig, FaceParameters())
    assert len(bpy.data.materials) == len(MATERIALS)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_evaluated_mesh_equals_the_posed_rig(rig, evaluated, seed):
    random = np.random.default_rng(seed)
    parameters = FaceParameters(
        aus={n: float(random.uniform(0, 10)) for n in random.choice(CONTROL_NAMES, 8)},
        head=tuple(random.uniform(-0.6, 0.6, 3)),
        neck=tuple(random.uniform(-0.3, 0.3, 3)),
    )
    offsets = random.normal(0, 0.002, (rig.n_vertices, 3)).astype(np.float32)
    face = build_face("Face", rig, parameters, offsets)
    assert np.abs(evaluated(face) - rig.pose(parameters, offsets)).max() < TOLERANCE


def test_moved_slider_moves_the_mesh_as_numpy_says(rig, evaluated):
    head = (0.4, -0.2, 0.1)
    face = build_face("Face", rig, FaceParameters(aus={"smile": 3.0}, head=head))
    face.data.shape_keys.key_blocks["frontalis"].value = 1.5
    face.data.shape_keys.key_blocks["smile"].value = 0.2
    wanted = rig.pose(FaceParameters(aus={"frontalis": 7.5, "smile": 1.0}, head=head))
    assert np.abs(evaluated(face) - wanted).max() < TOLERANCE


def test_fitted_key_fades_the_offsets(rig, evaluated):
    offsets = np.full((rig.n_vertices, 3), 0.004, dtype=np.float32)
    face = build_face("Face", rig, FaceParameters(), offsets)
    face.data.shape_keys.key_blocks["Fitted"].value = 0.25
    assert np.abs(evaluated(face) - (rig.neutral() + 0.001)).max() < TOLERANCE


def test_location_moves_the_whole_face(rig, evaluated):
    face = build_face("Face", rig, FaceParameters(head=(0.3, 0, 0)), location=(1.0, 2.0, 3.0))
    wanted = rig.pose(FaceParameters(head=(0.3, 0, 0))) + (1.0, 3.0, -2.0)
    assert np.abs(evaluated(face) - wanted).max() < TOLERANCE


def test_offsets_of_a_wrong_shape_are_refused(rig):
    with pytest.raises(ValueError, match=r"offsets must have the shape \(\d+, 3\), got \(5, 3\)"):
        build_face("Face", rig, FaceParameters(), np.zeros((5, 3)))
    assert not bpy.data.objects
