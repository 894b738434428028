"""A folder of sketches as key poses, in Blender without a window."""

from __future__ import annotations

import re
import shutil
from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")

from facs_rig import FaceParameters  # noqa: E402
from facs_rig.blender_pose import pose_of, set_pose  # noqa: E402
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


class Windowed:
    """Blender's module, but for saying that it runs in the background."""

    app = SimpleNamespace(background=False)

    def __getattr__(self, name):
        return getattr(bpy, name)


@pytest.fixture
def desk(shell, folder, monkeypatch):
    """The operator's own functions on stand-ins for the window, which the background lacks."""
    from addon.blender import retarget_operators

    monkeypatch.setattr(retarget_operators, "bpy", Windowed())
    operator = retarget_operators.SKETCHTOFACE_OT_storyboard
    noted = SimpleNamespace(progress=[], reports=[], texts=[], timers=[])
    manager = SimpleNamespace(
        progress_begin=lambda low, high: noted.progress.append((low, high)),
        progress_update=noted.progress.append,
        progress_end=lambda: noted.progress.append("end"),
        event_timer_add=lambda wait, window: noted.timers.append("timer") or "timer",
        event_timer_remove=noted.timers.remove,
        modal_handler_add=lambda op: None,
    )
    context = SimpleNamespace(
        window_manager=manager, window=None, scene=bpy.context.scene,
        selected_objects=[mesh("Head")], active_object=None,
        workspace=SimpleNamespace(status_text_set=noted.texts.append),
    )  # fmt: skip
    session = SimpleNamespace(
        head=True, bl_label=operator.bl_label, _timer=None,
        report=lambda kind, text: noted.reports.append(text),
    )  # fmt: skip
    for name in ("_begin", "_tell", "_put_away", "_end"):
        setattr(session, name, getattr(operator, name).__get__(session))

    def press(event: str) -> set[str]:
        return operator.modal(session, context, SimpleNamespace(type=event))

    def invoke() -> set[str]:
        return operator.invoke(session, context, None)

    return SimpleNamespace(press=press, invoke=invoke, noted=noted)


def test_from_the_button_it_goes_one_sketch_a_tick(desk):
    assert desk.invoke() == {"RUNNING_MODAL"}
    assert desk.press("MOUSEMOVE") == {"RUNNING_MODAL"} and desk.noted.progress == [(0, 4), 0]
    answers = [desk.press("TIMER") for _ in range(4)]
    assert answers == [{"RUNNING_MODAL"}] * 3 + [{"FINISHED"}]
    assert desk.noted.progress == [(0, 4), 0, 1, 2, 3, "end"]
    assert desk.noted.timers == [] and desk.noted.texts[-1] is None
    assert "2 of 4, 9.png" in desk.noted.texts[1]
    assert desk.noted.reports[-1] == "3 key poses on Head, frames 1 to 73; left out 9.png"


def test_escape_keeps_what_is_done_and_puts_everything_back(desk):
    desk.invoke()
    desk.press("TIMER")
    assert desk.press("ESC") == {"FINISHED"}
    assert desk.noted.timers == [] and desk.noted.progress[-1] == "end"
    said = "1 key pose on Head, frame 1; stopped after 1 of 4 sketches"
    assert desk.noted.reports == [said]
    assert len(keyed("Head")["jawOpen"]) == 1
    desk.invoke()
    assert desk.press("ESC") == {"CANCELLED"}
    assert desk.noted.timers == [] and desk.noted.reports == [said]
