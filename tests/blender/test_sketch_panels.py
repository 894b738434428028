"""The panels of a sketch, drawn on a layout that knows what Blender's own one takes."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.blender.background import tasks  # noqa: E402
from addon.blender.state.session import session  # noqa: E402
from tests.written import points_of  # noqa: E402

from .sheets import image_of, lines_of, pencil_of  # noqa: E402
from .test_shell import press  # noqa: E402

pytestmark = pytest.mark.usefixtures("kept_fits")
FUNCTIONS = bpy.types.UILayout.bl_rna.functions


class Layout:
    """Notes what is drawn; refuses functions, arguments and icons that Blender does not have."""

    def __init__(self, noted: list | None = None) -> None:
        self.noted = [] if noted is None else noted

    def __getattr__(self, name: str):
        if name.startswith("__"):
            raise AttributeError(name)
        known = FUNCTIONS[name].parameters

        def draw(*values, **options):
            assert set(options) <= set(known.keys()), (name, options)
            if "icon" in options:
                assert options["icon"] in known["icon"].enum_items, options["icon"]
            if name == "prop":
                values[0].path_resolve(values[1])
            if name == "operator":
                folder, _, stem = values[0].partition(".")
                kind = getattr(getattr(bpy.ops, folder), stem).get_rna_type()
                self.noted.append((values[0], options.get("text", kind.name)))
                return SimpleNamespace()
            self.noted.append((name, options.get("text", values[1] if name == "prop" else "")))
            return Layout(self.noted) if name in {"row", "column", "split", "box"} else None

        return draw

    def drawn(self, name: str) -> list[str]:
        """The texts of what was drawn by this name."""
        return [text for kind, text in self.noted if kind == name]


@pytest.fixture
def panels(shell):
    """Function: everything that the tab draws now, in order."""
    from addon.blender.panels import face, fit, retarget, sketch

    classes = [
        cls
        for module in (sketch, fit, face, retarget)
        for cls in module.CLASSES
        if issubclass(cls, bpy.types.Panel)
    ]

    def draw() -> tuple[list[str], Layout]:
        layout, shown = Layout(), []
        for cls in classes:
            if not hasattr(cls, "poll") or cls.poll(bpy.context):
                stand_in = SimpleNamespace(layout=layout, page=getattr(cls, "page", ""))
                for name in ("_of_face",):
                    if hasattr(cls, name):
                        setattr(stand_in, name, getattr(cls, name).__get__(stand_in))
                cls.draw(stand_in, bpy.context)
                cls.draw_header_preset(stand_in, bpy.context)
                shown.append(cls.bl_label)
        return shown, layout

    return draw


FIT, AGAIN = "sketch_to_face.fit", "sketch_to_face.fit_again"


def test_without_a_face_there_is_the_sketch_and_how_to_fit(panels):
    shown, layout = panels()
    assert shown == ["Sketch", "Fit", "Tweakables", "On Any Rig"]
    assert layout.drawn(FIT) == ["Sketch to Face"] and not layout.drawn(AGAIN)


def test_a_face_of_a_sketch_has_the_panels_in_the_order_of_the_work(panels, sketch):
    press(sketch)
    shown, layout = panels()
    assert shown[:5] == ["Sketch", "Detect", "Fit", "Tweakables", "Result"]
    assert layout.drawn(AGAIN) == ["Fit Again"]
    assert layout.drawn("sketch_to_face.evidence") == ["Show Evidence"]
    assert layout.drawn("sketch_to_face.decide") == ["Accept", "Reject", ""]
    assert any("px apart" in text for text in layout.drawn("label"))
    item = bpy.context.active_object.sketch_to_face.detections["smile"]
    item.locked = True
    _, layout = panels()
    assert layout.drawn("sketch_to_face.decide") == ["Accept", "Reject", ""]
    assert layout.drawn("sketch_to_face.unlock_all") == ["Unlock All"]


def test_an_added_face_has_no_sketch_to_show(panels):
    bpy.ops.mesh.add_facs_face()
    shown, layout = panels()
    assert "Detect" not in shown and "Result" not in shown and "Expression" in shown
    assert not layout.drawn(AGAIN)


def test_while_work_goes_on_there_is_a_bar_and_no_button(panels, monkeypatch):
    monkeypatch.setattr(session, "doing", tasks.Tick("reading it", 0.4))
    _, layout = panels()
    assert layout.drawn("progress") == ["Reading it …"] and not layout.drawn(FIT)
    assert "Esc stops it" in layout.drawn("label")


def test_every_kind_of_sketch_can_be_chosen(panels, sketch):
    settings = bpy.context.scene.sketch_to_face
    settings.sketch_kind, settings.sketch_image = "IMAGE", image_of(sketch)
    assert len(panels()[1].drawn("template_ID")) == 1
    settings.sketch_kind, settings.sketch_pencil = "PENCIL", pencil_of(lines_of(sketch)[:3])
    _, layout = panels()
    assert layout.drawn("sketch_to_face.new_drawing") == ["Draw in the View"]


def test_pins_are_listed_and_a_sketch_that_is_another_can_be_taken(panels, sketch):
    press(sketch)
    bpy.ops.sketch_to_face.pin(name="chin", place=(3, 4))
    bpy.context.scene.sketch_to_face.sketch = "//another.png"
    _, layout = panels()
    assert "Chin" in layout.drawn("prop")
    assert len(layout.drawn("sketch_to_face.unpin")) == 2  # all of them, and this one
    assert layout.drawn("sketch_to_face.adopt_sketch") == ["Use the Chosen Sketch"]


def test_what_is_wrong_with_a_live_sketch_is_said(panels, sketch, monkeypatch):

    press(sketch)
    face = bpy.context.active_object
    face.sketch_to_face.live = True
    monkeypatch.setitem(session.troubles, face.name, "The sketch is gone.")
    assert "The sketch is gone." in panels()[1].drawn("label")


def test_other_strokes_ask_for_another_fit(panels, sketch):
    press(sketch)
    bpy.context.scene.sketch_to_face.strokes = "engrave"
    _, layout = panels()
    assert len(layout.drawn(AGAIN)) == 2
    bpy.ops.sketch_to_face.fit_again()
    bpy.context.scene.sketch_to_face.strokes = "ignore"
    assert len(panels()[1].drawn(AGAIN)) == 2
    bpy.ops.sketch_to_face.fit_again()
    assert len(panels()[1].drawn(AGAIN)) == 1


def test_evidence_is_a_picture_where_red_lines_speak_for_the_action(panels, sketch, monkeypatch):
    from addon.blender.operators import detect

    press(sketch)
    assert bpy.ops.sketch_to_face.evidence() == {"FINISHED"}
    memory = bpy.context.active_object.sketch_to_face
    made = session.evidence[memory.mark]
    assert set(made) == set(memory.detections.keys())
    smile = made["smile"]
    assert smile.shape == (384, 384, 4) and smile.dtype == np.float32
    red = (smile[..., 0] - smile[..., 2]) > 0.3
    rows = np.flatnonzero(red.any(axis=1))
    assert red.sum() > 100 and np.median(rows) < 192  # Blender counts from below: the mouth
    # Without a window Blender makes no icons; where it does, the picture takes the button's place.
    monkeypatch.setattr(detect, "picture", lambda mark, name: int(name in made))
    _, layout = panels()
    assert layout.drawn("template_icon") and not layout.drawn("sketch_to_face.evidence")


def test_the_list_shows_what_the_face_does_then_what_is_likely():
    from addon.blender.panels.fit import shown_first

    def item(name, active, probability, locked=False):
        return SimpleNamespace(name=name, active=active, probability=probability, locked=locked)

    items = [
        item("blink", False, 0.1),
        item("smile", True, 0.6),
        item("jaw_open", False, 0.4),
        item("squint", True, 0.9),
        item("pucker", False, 0.05, locked=True),
    ]
    show, places = shown_first(items, False, "")
    assert show == [False, True, True, True, True]
    assert [items[places.index(k)].name for k in range(5)] == [
        "squint", "smile", "jaw_open", "blink", "pucker",
    ]  # fmt: skip
    assert shown_first(items, True, "")[0] == [True] * 5
    assert shown_first(items, True, "smi")[0] == [False, True, False, False, False]
    assert shown_first([], False, "") == ([], [])


# --- presets, preferences, help -------------------------------------------------------------------


def test_a_preset_keeps_how_faces_are_fitted(shell, tmp_path, monkeypatch):
    monkeypatch.setenv("BLENDER_USER_SCRIPTS", str(tmp_path))
    settings = bpy.context.scene.sketch_to_face
    settings.method, settings.strokes, settings.tweakables.max_delta = "thesis", "emboss", 7.5
    settings.tweakables.mirror = True
    assert bpy.ops.sketch_to_face.add_preset(name="Loose pencil") == {"FINISHED"}
    (kept,) = tmp_path.rglob("*.py")
    assert kept.parent.name == "fit" and kept.parent.parent.name == "sketch_to_face"
    bpy.ops.sketch_to_face.default_tweakables()
    assert settings.method == "lines" and not settings.tweakables.mirror
    bpy.ops.script.execute_preset(filepath=str(kept), menu_idname="SKETCHTOFACE_PT_presets")
    assert (settings.method, settings.strokes) == ("thesis", "emboss")
    assert settings.tweakables.max_delta == 7.5 and settings.tweakables.mirror


def test_preferences_choose_quality_and_threads(shell, sketch, monkeypatch):
    from addon.blender.background import sketching
    from addon.blender.state import preferences, properties

    assert preferences.of(bpy.context) == preferences.Defaults()
    assert properties.fit_values(bpy.context)["method"] == "lines"
    quick = preferences.Defaults(quality="QUICK", threads=1)
    monkeypatch.setattr(preferences, "of", lambda context: quick)
    assert properties.fit_values(bpy.context)["method"] == "shape"
    bpy.context.scene.sketch_to_face.method = "thesis"
    assert properties.fit_values(bpy.context)["method"] == "thesis"  # that was asked for by name
    assert sketching.detector(1) is sketching.detector(1)


def test_the_folder_for_files_must_be_there(shell, tmp_path, monkeypatch):
    from addon.blender.state import preferences

    chosen = preferences.Defaults(folder=str(tmp_path))
    monkeypatch.setattr(preferences, "of", lambda context: chosen)
    assert preferences.in_folder(bpy.context, "a.glb") == str(tmp_path / "a.glb")
    chosen = preferences.Defaults(folder=str(tmp_path / "gone"))
    assert preferences.in_folder(bpy.context, "a.glb") == "a.glb"


def test_the_log_and_a_missing_manual_are_said(shell, monkeypatch, reports):
    from addon.blender.operators import help

    assert bpy.ops.sketch_to_face.log() == {"CANCELLED"}
    assert "The log is empty" in reports()
    monkeypatch.setattr(help, "page", lambda name: None)
    with pytest.raises(RuntimeError, match="The manual is missing"):
        bpy.ops.sketch_to_face.help()


# --- overlay --------------------------------------------------------------------------------------


def test_the_overlay_lies_where_the_sketch_has_the_face(shell, sketch, rig, evaluated):
    from addon.blender.viewport import overlay

    press(sketch)
    face = bpy.context.active_object
    face.parent.location = (0.3, -0.2, 0.1)
    bpy.context.view_layer.update()
    pixels = np.array([[100.0, 50.0], [320.0, 400.0]])
    there = overlay.on_plane(face, pixels)
    assert np.allclose(overlay.on_page(face, there), pixels, atol=1e-6)
    plane = np.array(overlay.plane_of(face))
    corners = plane @ np.column_stack([there, np.zeros(2), np.ones(2)]).T
    small, distance = face.sketch_to_face.closeness, face.sketch_to_face.distance
    assert 0.8 < small <= 1 and (small < 1) == (distance > 0)
    assert np.allclose(corners[[0, 2]].T - (0.3, 0.1), small * there, atol=1e-6)
    front = evaluated(face)[:, 2].max()  # core axes: toward the viewer
    assert (-corners[1] > front).all()

    shown = overlay.look(bpy.context, face)
    shown.task.done.wait(60)
    shown = overlay.look(bpy.context, face)
    assert shown.task is None and len(shown.lines) > 10
    local = evaluated(face) - (0.3, 0.1, 0.2)
    # From the front they cover the face, and what is behind its features is a bit smaller.
    assert np.allclose(small * shown.landmarks, local[rig.landmarks][:, :2], atol=0.01)
    drawn = local[:, :2] / (1 - local[:, 2:] / (distance or np.inf))  # as on the sketch, in metres
    assert np.allclose(shown.landmarks, drawn[rig.landmarks], atol=1e-5)
    low, high = drawn.min(axis=0), drawn.max(axis=0)
    points = np.concatenate(shown.lines)
    assert (points > low - 0.002).all() and (points < high + 0.002).all()
    assert overlay.look(bpy.context, face).task is None  # the same face is not looked at again
    face["jaw_open"] = 5.0
    face.update_tag()
    bpy.context.view_layer.update()
    assert overlay.look(bpy.context, face).task is not None


def test_lines_are_packed_and_unpacked():
    from addon.blender.state import memory

    lines = [np.array([[1.0, 2.0], [3.0, 4.5]]), np.zeros((3, 2))]
    found = memory.unpack(memory.pack(lines))
    assert [line.tolist() for line in found] == [line.tolist() for line in lines]
    assert memory.unpack(None) == [] and memory.unpack(memory.pack([])) == []


# --- export ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("ending", ["glb", "obj", "ply", "blend"])
def test_the_face_is_exported_as_it_is(shell, sketch, tmp_path, ending, evaluated):

    press(sketch)
    face = bpy.context.active_object
    face["jaw_open"] = 1.0
    face.data.shape_keys.key_blocks["Fitted"].value = 0.5
    face.update_tag()
    path, name, vertices = tmp_path / f"face.{ending}", face.name, evaluated(face)
    assert bpy.ops.sketch_to_face.export(filepath=str(path), format=f".{ending}") == {"FINISHED"}
    if ending == "blend":
        bpy.ops.wm.read_factory_settings(use_empty=True)
        with bpy.data.libraries.load(str(path)) as (there, taken):
            taken.objects = [name]
        bpy.context.collection.objects.link(taken.objects[0])
        bpy.context.collection.objects.link(taken.objects[0].parent)
        assert np.array_equal(evaluated(taken.objects[0]), vertices)
        return
    assert np.abs(points_of(path) - vertices).max() < 1e-5


def test_an_export_that_cannot_be_is_one_sentence(shell, sketch, tmp_path):
    press(sketch)
    with pytest.raises(RuntimeError, match="There is no folder"):
        bpy.ops.sketch_to_face.export(filepath=str(tmp_path / "nowhere" / "face.glb"))
