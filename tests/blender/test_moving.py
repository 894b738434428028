"""Faces with keyframes leave Blender as they move: by its own exporters, and by our button."""

from __future__ import annotations

import json
import shutil
import struct
import subprocess

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from scipy.spatial import cKDTree  # noqa: E402

from facs_rig import FaceParameters  # noqa: E402
from facs_rig.blender import build_face  # noqa: E402
from facs_rig.blender.pose import refresh  # noqa: E402
from facs_rig.levels import at_level  # noqa: E402
from tests.written import points_of  # noqa: E402

from .conftest import SKETCH  # noqa: E402
from .rigs import error_of, select  # noqa: E402

CLOSE = 1e-5  # metres; the files hold 32-bit floats


def tree_of(path) -> tuple[dict, bytes]:
    """The JSON and the binary part of a .glb."""
    data = path.read_bytes()
    length = struct.unpack("<I", data[12:16])[0]
    return json.loads(data[20 : 20 + length]), data[20 + length + 8 :]


def weights_of(path) -> dict[float, dict[str, float]]:
    """Frame -> morph target -> weight, of the one animation of a .glb that has weights."""
    tree, binary = tree_of(path)

    def array(number: int) -> np.ndarray:
        accessor = tree["accessors"][number]
        view = tree["bufferViews"][accessor["bufferView"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        return np.frombuffer(binary, np.float32, accessor["count"], start)

    found = [
        (animation, channel)
        for animation in tree["animations"]
        for channel in animation["channels"]
        if channel["target"]["path"] == "weights"
    ]
    assert len(found) == 1
    animation, channel = found[0]
    names = next(m for m in tree["meshes"] if "targets" in m["primitives"][0])["extras"]
    sampler = animation["samplers"][channel["sampler"]]
    times = array(sampler["input"]) * bpy.context.scene.render.fps
    values = array(sampler["output"]).reshape(len(times), -1)
    assert any(c["target"]["path"] == "rotation" for c in animation["channels"])  # the head's
    return {
        round(float(time), 3): dict(zip(names["targetNames"], row.tolist(), strict=True))
        for time, row in zip(times, values, strict=True)
    }


def as_it_moves(face, evaluated, frames) -> dict[int, np.ndarray]:
    """Frame -> (n, 3) vertices as Blender shows them."""
    out = {}
    for frame in frames:
        bpy.context.scene.frame_set(frame)
        out[frame] = evaluated(face)
    return out


def is_the_same(path, seen, evaluated) -> None:
    """A written file, read into an empty Blender, moves as what was seen."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if path.suffix == ".glb":
        bpy.ops.import_scene.gltf(filepath=str(path), import_shading="SMOOTH")
    else:
        bpy.ops.import_scene.fbx(filepath=str(path), anim_offset=0.0)
    face = next(o for o in bpy.data.objects if o.type == "MESH" and o.data.shape_keys)
    for block in face.data.shape_keys.key_blocks:
        # Creases go beyond 1 and lids below 0; the importers' sliders end there, the file does not.
        block.slider_min, block.slider_max = -10.0, 10.0
    for frame, points in seen.items():
        bpy.context.scene.frame_set(frame)
        found = evaluated(face)
        # glTF has a vertex for each normal and place on the texture
        assert len(found) >= len(points)
        far = max(cKDTree(found).query(points)[0].max(), cKDTree(points).query(found)[0].max())
        assert far < CLOSE, f"frame {frame}"


@pytest.fixture(scope="module")
def light(rig):
    """The rig with a tenth of its vertices, for what is asked of weights and frames alone."""
    return at_level(rig, "game")


@pytest.fixture
def storyboard(shell, tmp_path, rig, request):
    """A face that two sketches are the key poses of, at frames 1 and 5; light if none is named."""
    folder = tmp_path / "drawn"
    folder.mkdir()
    for number, name in enumerate(("smiling_woman", "angry_man"), 1):
        shutil.copy(SKETCH.parent / f"{name}.png", folder / f"{number}.png")
    level = getattr(request, "param", "game")
    face = build_face("Ann", at_level(rig, level), FaceParameters(identity={"age": 0.6}))
    select(face)
    scene = bpy.context.scene
    scene.sketch_to_face.storyboard, scene.sketch_to_face.storyboard_every = str(folder), 4
    scene.frame_set(1)
    assert bpy.ops.sketch_to_face.storyboard() == {"FINISHED"}
    return face


def test_blenders_gltf_exporter_writes_a_storyboard_with_its_default_settings(
    storyboard, tmp_path, evaluated
):
    keys, path = storyboard.data.shape_keys, tmp_path / "face.glb"
    bpy.ops.export_scene.gltf(filepath=str(path))
    weights = weights_of(path)
    assert list(weights) == [1, 2, 3, 4, 5]
    assert len({tuple(row.values()) for row in weights.values()}) == 5  # they move
    for frame, row in weights.items():
        bpy.context.scene.frame_set(int(frame))
        for name, value in row.items():
            assert value == pytest.approx(keys.key_blocks[name].value, abs=1e-5), (frame, name)
    assert weights[1]["smile"] > 0.3 > weights[5]["smile"]
    seen = as_it_moves(storyboard, evaluated, (1, 3, 5))
    is_the_same(path, seen, evaluated)


@pytest.mark.parametrize("head", [True, False], ids=["with the head", "sliders alone"])
def test_the_button_key_is_seen_by_the_exporter(shell, light, tmp_path, head):
    face = build_face("Ann", light, FaceParameters())
    select(face)
    for frame, smile in ((3, 0.0), (6, 5.0)):
        bpy.context.scene.frame_set(frame)
        face["smile"] = smile
        assert bpy.ops.sketch_to_face.key_expression(head=head) == {"FINISHED"}
    path = tmp_path / "face.glb"
    bpy.ops.export_scene.gltf(filepath=str(path))
    weights = weights_of(path)
    assert list(weights) == [3, 4, 5, 6]
    assert [weights[k]["smile"] for k in (3, 6)] == pytest.approx([0.0, 1.0])
    assert 0.0 < weights[4]["smile"] < weights[5]["smile"] < 1.0


def by_hand(face) -> None:
    """Keyframes as an artist sets them: with I over a slider."""
    for frame, smile in ((2, 1.0), (4, 5.0)):
        face["smile"] = smile
        face.keyframe_insert('["smile"]', frame=frame)


def test_keyframes_by_hand_are_seen_while_the_add_on_is_on(shell, light, tmp_path):
    face = build_face("Ann", light, FaceParameters())
    by_hand(face)
    assert callable(shell.glTF2_pre_export_callback)
    shell.glTF2_pre_export_callback({})  # as the exporter does for every add-on that is on
    path = tmp_path / "face.glb"
    bpy.ops.export_scene.gltf(filepath=str(path))
    weights = weights_of(path)
    assert list(weights) == [2, 3, 4]
    assert [weights[k]["smile"] for k in (2, 4)] == pytest.approx([0.2, 1.0])


@pytest.mark.parametrize(
    ("storyboard", "ending"), [("full", "glb"), ("game", "fbx")], indirect=["storyboard"]
)
def test_the_panel_writes_a_face_as_it_moves(storyboard, tmp_path, evaluated, ending):
    """Whatever moves it: keyframes, strips, drivers of the artist's, the place of its bones."""
    face, scene = storyboard, bpy.context.scene
    key = face.driver_add('["frontalis"]').driver
    key.expression = "frame"
    for frame, place in ((1, 0.0), (5, 0.2)):
        face.parent.location.x = place
        face.parent.keyframe_insert("location", frame=frame)
    face.data.shape_keys.key_blocks["wince"].mute = True
    refresh(face)
    scene.frame_set(2)
    seen = as_it_moves(face, evaluated, range(1, 6))
    assert max(np.abs(a - b).max() for a in seen.values() for b in seen.values()) > 0.1
    scene.frame_set(2)
    selected = list(bpy.context.selected_objects)
    path = tmp_path / f"face.{ending}"
    assert bpy.ops.sketch_to_face.export(filepath=str(path), format=f".{ending}") == {"FINISHED"}
    assert (scene.frame_start, scene.frame_end, scene.frame_current) == (1, 250, 2)
    assert bpy.context.selected_objects == selected
    assert [p.name for p in tmp_path.iterdir() if p.is_file()] == [path.name]
    is_the_same(path, seen, evaluated)


@pytest.mark.parametrize("storyboard", ["full"], indirect=True)
def test_without_animation_the_panel_writes_the_frame_that_is_shown(
    storyboard, tmp_path, evaluated
):

    bpy.context.scene.frame_set(3)
    path = tmp_path / "face.glb"
    bpy.ops.sketch_to_face.export(filepath=str(path), format=".glb", animation=False)
    assert np.abs(points_of(path) - evaluated(storyboard)).max() < 5e-5


def test_modifiers_that_a_moving_file_leaves_out_are_named(shell, light, tmp_path, reports):
    face = build_face("Ann", light, FaceParameters())
    select(face)
    by_hand(face)
    face.modifiers.new("Wobble", "WAVE")
    reports()
    bpy.ops.sketch_to_face.export(filepath=str(tmp_path / "face.fbx"), format=".fbx")
    assert "left out: Wobble" in reports()


def test_a_hidden_face_that_moves_is_one_sentence(shell, light, tmp_path):
    face = build_face("Ann", light, FaceParameters())
    select(face)
    by_hand(face)
    face.parent.hide_set(True)
    path = tmp_path / "face.glb"
    assert "'Ann Rig' is hidden" in error_of(
        lambda: bpy.ops.sketch_to_face.export(filepath=str(path), format=".glb")
    )
    assert not path.exists()


OTHER_BLENDER = """
import sys
sys.path.insert(0, {root!r})
import bpy
from facs_rig import FaceParameters, load_rig
from facs_rig.blender import build_face
from facs_rig.levels import at_level
from facs_rig.blender.pose import key_pose, set_pose
bpy.ops.wm.read_factory_settings(use_empty=True)
face = build_face("Ann", at_level(load_rig(), "game"), FaceParameters())
for frame, smile, turn in ((1, 0.0, 0.0), (4, 5.0, 0.4)):
    set_pose(face, FaceParameters({{"smile": smile}}, head=(turn, 0.0, 0.0)))
    key_pose(face, frame)
bpy.ops.export_scene.gltf(filepath={path!r})
"""


@pytest.mark.slow
def test_blender_5_2_writes_them_too(tmp_path):
    from . import newer_blender

    try:
        python = newer_blender.blender_5_2_with_the_core()
    except newer_blender.Missing as reason:
        pytest.skip(str(reason))
    path = tmp_path / "face.glb"
    text = OTHER_BLENDER.format(root=str(SKETCH.parents[2]), path=str(path))
    run = subprocess.run([python, "-c", text], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr[-2000:]
    weights = weights_of(path)
    assert [row["smile"] for row in weights.values()] == pytest.approx(
        [0.0, weights[2]["smile"], weights[3]["smile"], 1.0]
    )
    assert 0.0 < weights[2]["smile"] < weights[3]["smile"] < 1.0
