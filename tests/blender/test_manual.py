"""The manual names buttons and fields as they are called: what it has in bold, the panels show."""

from __future__ import annotations

import re
from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")

from facs_rig import CONTROLS, IDENTITY, LANDMARKS  # noqa: E402

from .conftest import ROOT  # noqa: E402
from .test_shell import press  # noqa: E402

MANUAL = ROOT / "docs" / "manual"
OURS = ("SKETCHTOFACE_", "MESH_OT_add_facs_face")


class Layout:
    """Stands for Blender's layout: what would be read is noted, how it looks is not asked for.

    handles : names of buttons and fields      shown : these, labels, and what can be chosen
    """

    def __init__(self, handles: set[str], shown: set[str]) -> None:
        self.__dict__.update(handles=handles, shown=shown)

    def __setattr__(self, name, value):
        pass

    def __getattr__(self, name):
        return self._element

    def _element(self, *_, text="", **__):
        self.shown.add(text)
        return self  # rows, columns and splits are as good as the layout that they are in

    def prop(self, owner, name, text=None, expand=False, **_):
        """A field, under its own name or another."""
        if name.startswith("["):  # a slider of the face itself
            self.shown.add(text)
            return
        known = type(owner).bl_rna.properties[name]
        items = {item.name for item in known.enum_items} if known.type == "ENUM" else set()
        self.handles.update(items if expand else {known.name if text is None else text})
        self.shown.update(items, {known.name})  # where an icon stands for it, the tooltip says it

    def operator(self, idname, text=None, **_):
        """A button; its options are another matter."""
        self.handles.add(of_operator(idname).name if text is None else text)
        return SimpleNamespace()


def classes() -> list[type]:
    """All that the add-on has registered."""
    kinds = (bpy.types.Panel, bpy.types.Operator, bpy.types.AddonPreferences, bpy.types.UIList)
    every = [cls for kind in kinds for cls in kind.__subclasses__()]
    return [cls for cls in every if cls.__name__.startswith(OURS) and cls.is_registered]


def of_operator(idname: str) -> bpy.types.Struct:
    """What Blender knows of an operator's name and options."""
    group, name = idname.split(".")
    return getattr(getattr(bpy.ops, group), name).get_rna_type()


def dialog(cls: type) -> set[str]:
    """The options of an operator or of the preferences, and what can be chosen in each."""
    known = of_operator(cls.bl_idname) if issubclass(cls, bpy.types.Operator) else cls.bl_rna
    options = [known.properties[name] for name in getattr(cls, "__annotations__", {})]
    options = [option for option in options if not option.is_hidden]
    choices = [option.enum_items for option in options if option.type == "ENUM"]
    return {named.name for several in (options, *choices) for named in several}


def draw(cls: type, layout: Layout) -> None:
    """Have a panel say what it shows now."""
    plain = type(cls.__name__, (), {k: v for k, v in vars(cls).items() if callable(v)})
    plain.bl_rna, plain.layout = cls.bl_rna, layout
    plain().draw(bpy.context)


@pytest.fixture
def layout(shell, sketch) -> Layout:
    """What the panels show, in all their states."""
    layout = Layout(set(), {shell.panels.tab.TAB})
    settings = bpy.context.scene.sketch_to_face
    others = (shell.panels.presets.SKETCHTOFACE_PT_presets,)  # drawn by Blender
    panels = [cls for cls in classes() if issubclass(cls, bpy.types.Panel) and cls not in others]
    press(sketch)
    face = bpy.context.active_object
    face.sketch_to_face.detections["smile"].locked = True
    bpy.ops.sketch_to_face.pin(name="chin", place=(400, 700))
    bpy.ops.sketch_to_face.beard(kind="GOATEE")
    for kind, method, strokes in (
        ("FILE", "lines", "ignore"),
        ("IMAGE", "shape", "engrave"),
        ("PENCIL", "thesis", "emboss"),
    ):
        settings.sketch_kind, settings.method, settings.strokes = kind, method, strokes
        settings.overlay = settings.place_head = settings.one_sided = kind == "PENCIL"
        for action in ("smile", "sneer"):  # locked, and not
            face.sketch_to_face.shown = face.sketch_to_face.detections.find(action)
            for cls in panels:
                if not hasattr(cls, "poll") or cls.poll(bpy.context):
                    draw(cls, layout)
    layout.handles.update(dialog(shell.state.preferences.SKETCHTOFACE_AP_preferences))
    layout.operator(shell.operators.help.SKETCHTOFACE_OT_log.bl_idname)
    layout.operator(shell.operators.help.SKETCHTOFACE_OT_help.bl_idname, text="Manual")
    for cls in classes():
        layout.shown.update({getattr(cls, "bl_label", "")}, dialog(cls))
    return layout


def texts() -> dict[str, str]:
    """Page of the manual -> its text, in one line."""
    return {
        page.stem: " ".join(page.read_text(encoding="utf-8").split())
        for page in MANUAL.glob("*.md")
    }


def test_what_the_manual_has_in_bold_is_a_label_of_the_add_on(layout):
    bold = {name: set(re.findall(r"\*\*([^*]+)\*\*", text)) for name, text in texts().items()}
    known = layout.shown | layout.handles
    assert not {name: words - known for name, words in bold.items() if words - known}
    assert len(set().union(*bold.values())) > 80


def test_every_button_and_field_of_the_panels_is_in_the_manual(layout):
    many = {c.label for c in CONTROLS} | {f.label for f in IDENTITY}
    told = " ".join(texts().values()).casefold()
    pins = {name.replace("_", " ").capitalize() for name in LANDMARKS}
    few = layout.handles - many - pins
    assert not {text for text in few if text.casefold() not in told}
    assert len(few) > 60


def test_the_manual_that_the_panels_open_is_there(shell):
    for name in shell.operators.help.PAGES:
        assert shell.operators.help.page(name).name == f"{name}.md"
    pages = {cls.page for cls in classes() if getattr(cls, "page", "")}
    assert pages <= set(shell.operators.help.PAGES)
