"""The add-on speaks German: every string that it shows, and nothing that it does not show."""

from __future__ import annotations

import ast
import json
import os
import re
import shutil
import string
import subprocess
import sysconfig
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")

from bl_ui.utils import PresetPanel  # noqa: E402

from facs_rig import CONTROLS, IDENTITY, LANDMARKS  # noqa: E402

from .conftest import ROOT  # noqa: E402

SHELL = ROOT / "addon" / "blender"
SCRIPT = Path(__file__).with_name("speak_german.py")
# The contexts that Blender looks things up in, and ours for words that it means otherwise.
PANEL, BUTTON, OWN = "*", "Operator", "Sketch to Face"
String = tuple[str, str]  # context, English

# Calls whose first text is a template, and the place of that text.
TEMPLATES = {"text": 0, "tip": 0, "label": 0, "say": 2}
# Calls that show what they are given; from code only through one of the above.
SHOWING = {"report": 1, "poll_message_set": 0, "status_text_set": 0, "ValueError": 0,
           "InputError": 0, "Tick": 0, "in_background": 1, "within": 1}  # fmt: skip
OPERATORS = {"operator", "operator_menu_enum"}
LAYOUT = {"label", "prop", "menu", "progress", "popover", "separator", *OPERATORS}

# German that is much longer than the English, since the English is very short: looked at.
LONG = {
    "Squint", "Wince", "Frown", "Fit", "Preferences", "Seed", "Mark", "Accept", "Decide",
    "Export", "Copy", "Save", "Reset",
}  # fmt: skip
SHORT, LONGER = 20, 1.8

# Properties whose items have names that say all.
NO_DESCRIPTION = {
    ("SKETCHTOFACE_OT_help", "page"),
    ("SKETCHTOFACE_PG_tweakables", "snake_type"),
    ("SKETCHTOFACE_PG_tweakables", "soft_select_curve"),
}


def classes() -> list[type]:
    """Every class of ours that Blender has registered."""
    kinds = (bpy.types.AddonPreferences, bpy.types.Header, bpy.types.Menu, bpy.types.Operator,
             bpy.types.Panel, bpy.types.PropertyGroup, bpy.types.UIList)  # fmt: skip
    found = [cls for kind in kinds for cls in kind.__subclasses__()]
    return [cls for cls in found if cls.__module__.startswith("addon.blender.")
            and cls.is_registered]  # fmt: skip


def rna_of(cls):
    """What Blender knows of a class; of an operator the class itself knows less."""
    if issubclass(cls, bpy.types.Operator):
        module, name = cls.bl_idname.split(".")
        return getattr(getattr(bpy.ops, module), name).get_rna_type()
    return cls.bl_rna


def own_properties(cls) -> Iterator:
    """The properties that we have given a class, but for those that are never shown."""
    ours = {
        name
        for base in cls.__mro__ if base.__module__.startswith("addon.blender")
        for name in vars(base).get("__annotations__", {})
    }  # fmt: skip
    for found in rna_of(cls).properties:
        if found.identifier in ours and not found.is_hidden:
            yield found


def attached() -> list:
    """The properties that hang on Blender's own types."""
    return [t.bl_rna.properties["sketch_to_face"] for t in (bpy.types.Scene, bpy.types.Object)]


def registered(module) -> dict[String, str]:
    """Every string that Blender itself shows of the registered classes -> where it is from."""
    found: dict[String, str] = {}
    for cls in classes():
        where = cls.__name__
        if issubclass(cls, bpy.types.Operator):
            found[BUTTON, cls.bl_label] = where
            found[PANEL, rna_of(cls).description] = where
        elif issubclass(cls, bpy.types.Panel):
            if not issubclass(cls, PresetPanel):  # called as the preset that was chosen last
                found[getattr(cls, "bl_translation_context", None) or PANEL, cls.bl_label] = where
            found[PANEL, getattr(cls, "bl_description", None) or cls.__doc__] = where
        for item in own_properties(cls):
            found |= of_property(item, f"{where}.{item.identifier}")
    for item in attached():
        found |= of_property(item, "sketch_to_face")
    for name in ("name", "location", "description"):
        found[PANEL, module.bl_info[name]] = f"bl_info, {name}"
    return found


def of_property(item, where: str) -> dict[String, str]:
    """Name and description of a property and of its items."""
    context, choices = item.translation_context or PANEL, list(getattr(item, "enum_items", ()))
    found = {(context, thing.name): where for thing in (item, *choices)}
    tips = {(PANEL, thing.description): where for thing in (item, *choices) if thing.description}
    return found | tips


def of_tables() -> dict[String, str]:
    """What stands in tables and is shown by a layout call with a variable."""
    from addon.blender.operators import detect, people
    from addon.blender.panels import face as face_panel
    from facs_rig.blender import keys as blender_keys

    found: dict[String, str] = {}
    for control in CONTROLS:
        found[PANEL, control.label] = f"control {control.name}"
        found[PANEL, blender_keys._tooltip(control)] = f"control {control.name}"
    for name in blender_keys.GAZE:
        found[PANEL, blender_keys._OTHERS[name][-1]] = name
    for feature in IDENTITY:
        found[PANEL, feature.label] = f"feature {feature.name}"
    for name in LANDMARKS:
        found[PANEL, name.replace("_", " ").capitalize()] = f"landmark {name}"
    for title in ("Head", "Neck"):
        found[PANEL, title] = "face_panel"
        for axis, _ in face_panel.AXES:
            found[PANEL, f"{title} {axis}"] = "face_panel"
    for text in ("Eyes Turn", "Eyes Down", *"RL", "Left", "Top", "Right", "Bottom"):
        found[PANEL, text] = "a slider's text"
    for _, text, _ in detect.DECISIONS:
        found[OWN, text] = "detect_operators.DECISIONS"
    found[PANEL, "Fit Presets"] = "presets, before one is chosen"
    found[BUTTON, people.NAME] = "the menu Add > Mesh"
    return found


def calls() -> Iterator[tuple[str, ast.Call, str]]:
    """(name of what is called, the call, where) all over the shell."""
    for path in sorted(SHELL.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call):
                func = node.func
                name = func.attr if isinstance(func, ast.Attribute) else getattr(func, "id", "")
                yield name, node, f"{path.relative_to(SHELL)}:{node.lineno}"


def constants(node: ast.AST | None) -> list[str]:
    """The texts that an argument may be."""
    if isinstance(node, ast.IfExp):
        return constants(node.body) + constants(node.orelse)
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return [node.value]
    return []


def is_helper(name: str, call: ast.Call) -> bool:
    """Whether a call is of `translation` or of `reporting.say`; layouts have a `label`, too."""
    func = call.func
    if name == "say":
        return True
    return (name in TEMPLATES and isinstance(func, ast.Attribute)
            and isinstance(func.value, ast.Name) and func.value.id == "translation")  # fmt: skip


def of_source() -> dict[String, str]:
    """Templates, and the `text=` of layout calls."""
    found: dict[String, str] = {}
    for name, call, where in calls():
        if is_helper(name, call):
            for text in constants(call.args[TEMPLATES[name]]):
                found[PANEL, text] = where
        elif name in LAYOUT:
            words = {word.arg: word.value for word in call.keywords}
            context = BUTTON if name in OPERATORS else PANEL
            for text in filter(None, constants(words.get("text"))):
                found[OWN if "text_ctxt" in words else context, text] = where
    return found


def everything(module) -> dict[String, str]:
    """All that is shown -> where."""
    return {**of_tables(), **of_source(), **registered(module)}


def table() -> dict[String, str]:
    """All that there is German for."""
    from addon.blender.messages.german import TABLE

    return {(context, text): said for context, entries in TABLE.items()
            for text, said in entries.items()}  # fmt: skip


@pytest.fixture
def german(monkeypatch):
    """Function: let the add-on look things up as a German Blender would; this one is built without
    languages."""

    def switch():
        from addon.blender.messages import translation

        def look_up(message: str, context: str = PANEL) -> str:
            return table().get((context, message), message)

        names = ("pgettext_iface", "pgettext_rpt", "pgettext_tip")
        translations = SimpleNamespace(**dict.fromkeys(names, look_up))
        translations.unregister = bpy.app.translations.unregister
        app = SimpleNamespace(translations=translations)
        monkeypatch.setattr(translation, "bpy", SimpleNamespace(app=app))

    return switch


def test_every_class_is_looked_at(shell):
    listed = {cls for module in shell._MODULES for cls in getattr(module, "CLASSES", ())}
    assert listed and listed <= set(classes())


def test_every_string_has_german(shell):
    there = table()
    missing = [f"{where}: {key}" for key, where in everything(shell).items() if key not in there]
    assert not missing, "\n".join(missing)


def test_there_is_no_german_for_what_is_gone(shell):
    shown = everything(shell)
    stale = [key for key in table() if key not in shown]
    assert not stale, "\n".join(map(str, stale))


def test_what_is_said_in_code_goes_through_a_template():
    """A text that is given to Blender as it is, or put together on the spot, stays English."""
    raw = []
    for name, call, where in calls():
        if is_helper(name, call):
            given = call.args[TEMPLATES[name]]
            if isinstance(given, ast.JoinedStr):
                raw.append(f"{where}: a template must be whole: {ast.unparse(given)}")
            continue
        given = [word.value for word in call.keywords if name in LAYOUT and word.arg == "text"]
        if name in SHOWING:
            given += call.args[SHOWING[name] :][:1]
        for node in given:
            inside = node.values if isinstance(node, ast.JoinedStr) else [node]
            if name in LAYOUT and not isinstance(node, ast.JoinedStr):
                continue
            raw += [f"{where}: {text}" for part in inside for text in constants(part)
                    if re.search("[A-Za-z]", text)]  # fmt: skip
    assert not raw, "\n".join(raw)


def placeholders(text: str) -> list[tuple[str, str]]:
    """(name, format) of every placeholder, in any order."""
    parsed = string.Formatter().parse(text)
    return sorted((name, spec or "") for _, name, spec, _ in parsed if name is not None)


def test_placeholders_are_the_same_on_both_sides():
    for (_, english), said in table().items():
        assert placeholders(english) == placeholders(said), english


def test_german_is_written_as_blender_s_is():
    """Nobody is addressed, and a sentence ends as the English one does."""
    for (_, english), said in table().items():
        assert said.strip() == said and said, english
        assert said.endswith(".") == english.endswith("."), english
        assert not re.search(r"\b(Sie|Ihr\w*|[Dd]u|[Dd]ein\w*|[Bb]itte)\b", said), said


def test_german_labels_are_not_much_longer():
    """Panels are narrow."""
    long = {english for (_, english), said in table().items()
            if len(english) < SHORT and len(said) > LONGER * len(english)}  # fmt: skip
    assert long == LONG


def test_everything_has_a_description(shell):
    for cls in classes():
        if issubclass(cls, bpy.types.Operator):
            assert rna_of(cls).description, cls
        for item in own_properties(cls):
            where = f"{cls.__name__}.{item.identifier}"
            assert item.name and item.name != item.identifier, where
            assert item.description, where
            bare = [choice.name for choice in getattr(item, "enum_items", ())
                    if not choice.description]  # fmt: skip
            assert bool(bare) == ((cls.__name__, item.identifier) in NO_DESCRIPTION), where
    assert all(item.name and item.description for item in attached())


def test_tooltips_are_of_one_line(shell):
    for (_, english), where in everything(shell).items():
        assert "\n" not in english, where


def test_error_is_reported_in_german(shell, german):
    german()
    with pytest.raises(RuntimeError, match="Keine Skizze gewählt: erst das Bild eines"):
        bpy.ops.sketch_to_face.fit()


def test_button_reports_in_german(shell, rig, reports, german, tmp_path):
    from addon.blender.state import faces
    from facs_rig import FaceParameters
    from facs_rig.blender import build_face

    faces.select_alone(bpy.context, build_face("Face", rig, FaceParameters()))
    german()
    reports()
    bpy.ops.sketch_to_face.save_expression(filepath=str(tmp_path / "ruhe.json"))
    assert "ruhe.json gespeichert" in reports()


def test_list_of_actions_is_searched_in_german(shell, german):
    from addon.blender.panels import fit

    item = SimpleNamespace(name="smile", active=True, probability=0.9, locked=False)
    assert fit.shown_first([item], False, "smi")[0] == [True]
    german()
    assert fit.shown_first([item], False, "lächel")[0] == [True]
    assert fit.shown_first([item], False, "smi")[0] == [False]


def test_counts_and_names_are_filled_in_after_the_look_up(shell, german):
    from addon.blender.operators import retarget

    german()
    assert retarget.some("abcdefg") == "a, b, c, d, e und 2 weitere"


@pytest.mark.slow
def test_german_blender_speaks_german(tmp_path):
    """In an installed Blender, which has languages: what it shows is what the table has."""
    program = shutil.which("blender")
    if program is None:
        pytest.skip("no installed Blender (Debian: apt install blender)")
    result = tmp_path / "result.json"
    environment = os.environ | {
        "HOME": str(tmp_path),
        "PYTHONPATH": os.pathsep.join([str(ROOT), sysconfig.get_paths()["purelib"]]),
    }
    done = subprocess.run(
        [program, "-b", "--factory-startup", "--python-use-system-env", "--python-exit-code", "1",
         "-P", str(SCRIPT), "--", str(result)],
        env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    told = json.loads(result.read_text(encoding="utf-8"))
    if "skip" in told:
        pytest.skip(told["skip"])
    wanted = [[context, english, said] for (context, english), said in table().items()]
    others = [(now, said) for now, said in zip(told["labels"], wanted, strict=True) if now != said]
    assert not others, "Blender's own word is shown instead; ours is to be the same, or in OWN"
    # Tooltips and reports are looked up without a context.
    assert told["tips"] == [said for context, _, said in wanted if context == PANEL]
    assert "Keine Skizze gewählt" in told["error"]
    assert told["drawn"] == "Wie gezeichnet"
    assert told["button"] == "Gesicht aus Skizze wurde abgebrochen; nichts ist verändert"
    assert told["english"] == told["left"] == []
