"""A folder of sketches as key poses, in Blender without a window."""

from __future__ import annotations

import re
import shutil
from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")

from facs_rig import FaceParameters  # noqa: E402
from facs_rig.blender.pose import pose_of, set_pose  # noqa: E402
from facs_rig.conventions import CONVENTIONS  # noqa: E402
from facs_rig.retarget import retarget  # noqa: E402

from .conftest import SKETCH  # noqa: E402
from .rigs import error_of, keyed, mesh, select, values, wanted  # noqa: E402

SKETCHES = SKETCH.parent


@pytest.fixture
def folder(tmp_path):
    """Three sketches and something that is none, in an order that only people know."""
    drawn = tmp_path / "drawn"
    drawn.mkdir()
    for name, source in (("2", "smiling_woman"), ("10", "angry_man"), ("11", "worried_old_man")):
        shutil.copy(SKETCHES / f"{source}.png", drawn / f"{name}.png")
    (drawn / "9.png").write_bytes(b"not a picture")
    bpy.context.scene.sketch_to_face.storyboard = str(drawn)
    return drawn


def expected(folder) -> dict[float, FaceParameters]:
    """Frame -> what is drawn there, if the first stands at 5 and the next 10 further each."""
    from addon import pipeline

    places = {"2": 5, "10": 25, "11": 35}  # 9.png, which is broken, keeps 15
    return {at: pipeline.read_expression(folder / f"{n}.png") for n, at in places.items()}


def storyboard(**options):
    """The button in the background, on whatever is selected, at frame 5 every 10."""
    bpy.context.scene.frame_set(5)
    bpy.context.scene.sketch_to_face.storyboard_every = 10
    bpy.ops.ed.undo_push(message="frame chosen")
    return bpy.ops.sketch_to_face.storyboard("INVOKE_DEFAULT", True, **options)


def test_sketches_become_key_poses_of_a_mesh(shell, folder, reports):
    select(mesh("Head"), mesh("Teeth", ["jawOpen", "tongueOut"]))
    reports()
    assert storyboard() == {"FINISHED"}
    said = reports()
    assert re.search(r"3 key poses on (Head, Teeth|Teeth, Head), frames 5 to 35; left out 9.png",
                     said)  # fmt: skip
    assert said.count("9.png") == 2  # once more with the reason
    poses = expected(folder)
    found = keyed("Head")
    assert set(found) == set(CONVENTIONS["arkit"].keys) and set(keyed("Teeth")) == {"jawOpen"}
    for key, points in found.items():
        assert points == [
            (at, pytest.approx(retarget(pose.aus, "arkit")[key], abs=1e-6))
            for at, pose in poses.items()
        ]
    assert bpy.context.scene.frame_current == 5
    assert values("Head") == wanted(poses[5].aus, "arkit")  # it shows the frame that is shown


def test_sketches_become_key_poses_of_a_face_that_turns_its_head(shell, folder):
    bpy.ops.mesh.add_facs_face(identity_keys=False)
    face = bpy.context.active_object
    select(face)
    storyboard()
    for at, pose in expected(folder).items():
        bpy.context.scene.frame_set(at)
        told = pose_of(bpy.data.objects[face.name])
        assert dict(told.aus) == pytest.approx(pose.aus, abs=1e-5)
        assert told.head == pytest.approx(pose.head, abs=1e-5)
    turned = pose_of(face).head
    face.animation_data_clear()
    face.parent.animation_data_clear()
    set_pose(face, FaceParameters(head=(0.5, 0, 0)))
    storyboard(head=False)
    bpy.context.scene.frame_set(35)
    assert pose_of(face).head == pytest.approx((0.5, 0, 0)) != pytest.approx(turned)


def test_storyboard_is_undone_and_redone(shell, folder):
    select(mesh("Head"))
    storyboard()
    made = keyed("Head")
    bpy.ops.ed.undo()
    assert keyed("Head") == {} and values("Head") == {}
    bpy.ops.ed.redo()
    assert keyed("Head") == made and len(made["jawOpen"]) == 3


def test_storyboard_without_a_folder_or_with_nothing_to_read_is_one_sentence(shell, tmp_path):
    select(mesh("Head"))
    assert "No folder is chosen" in error_of(storyboard)
    bpy.context.scene.sketch_to_face.storyboard = str(tmp_path / "nowhere")
    assert "cannot be read: no such file or directory" in error_of(storyboard)
    bpy.context.scene.sketch_to_face.storyboard = str(tmp_path)
    assert "There is no picture in" in error_of(storyboard)
    (tmp_path / "one.png").write_bytes(b"")
    with pytest.raises(RuntimeError, match=r"None of the sketches could be read: .*one\.png"):
        storyboard()
    assert keyed("Head") == {}
    select(mesh("Hat", None))
    assert "'Hat' has no shape keys" in error_of(storyboard)


@pytest.fixture
def session(shell, folder):
    """The operator as Blender makes one, but for its reports, and a scene with a mesh to key."""
    from addon.blender.operators import retarget

    operator = retarget.SKETCHTOFACE_OT_storyboard
    made = SimpleNamespace(head=True, reports=[])
    made.report = lambda kind, text: made.reports.append(text)
    for name in ("steps", "stopped", "_end"):
        setattr(made, name, getattr(operator, name).__get__(made))
    made.context = SimpleNamespace(
        scene=bpy.context.scene, selected_objects=[mesh("Head")], active_object=None,
        preferences=bpy.context.preferences,
    )  # fmt: skip
    return made


def test_it_says_which_sketch_it_is_at(session):
    texts = list(dict.fromkeys(tick.text for tick in session.steps(session.context)))
    assert [text.split(",")[0] for text in texts] == [f"{k} of 4" for k in (1, 2, 3, 4)]
    assert texts[1] == "2 of 4, 9.png"
    assert session.reports[-1] == "3 key poses on Head, frames 1 to 73; left out 9.png"


def test_escape_keeps_what_is_done(session):
    steps = session.steps(session.context)
    while "2 of 4" not in next(steps).text:
        pass
    steps.close()
    assert session.stopped(session.context) == {"FINISHED"}
    assert session.reports == ["1 key pose on Head, frame 1; stopped after 1 of 4 sketches"]
    assert len(keyed("Head")["jawOpen"]) == 1


def test_escape_before_anything_is_done_changes_nothing(session):
    steps = session.steps(session.context)
    next(steps)
    steps.close()
    assert session.stopped(session.context) == {"CANCELLED"}
    assert session.reports == [] and keyed("Head") == {}
