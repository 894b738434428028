"""Every operator as scripts call it: any property, in any order, with odd values. One sentence."""

from __future__ import annotations

from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

from .test_shell import press  # noqa: E402
from .test_translation import classes  # noqa: E402

pytestmark = pytest.mark.usefixtures("kept_fits")
TEXTS = ("", ".", "/", "a" * 300, "/proc/self/mem/x", "😀.json")
ODD = {
    "STRING": lambda _: TEXTS,
    "INT": lambda p: (p.hard_min, p.hard_max),
    "FLOAT": lambda p: (float("nan"), float("inf"), -1e30),
    "BOOLEAN": lambda _: (False, True),
    "ENUM": lambda p: tuple(item.identifier for item in p.enum_items),
}
# They wait for the mouse, or open a program of the desktop: nobody is there.
WAITING = {"sketch_to_face.drag_pins", "sketch_to_face.log"}


def operators() -> list[str]:
    return sorted(c.bl_idname for c in classes() if issubclass(c, bpy.types.Operator))


def operator_of(name: str):
    family, _, verb = name.partition(".")
    return getattr(getattr(bpy.ops, family), verb)


def odd_values(name: str):
    """Each property of an operator on its own, with each odd value; and nothing at all."""
    yield {}
    for prop in operator_of(name).get_rna_type().properties:
        if prop.identifier == "rna_type" or prop.is_readonly or prop.type not in ODD:
            continue
        for value in ODD[prop.type](prop):
            many = prop.type in ("INT", "FLOAT") and prop.is_array
            yield {prop.identifier: (value,) * prop.array_length if many else value}


def spoilt(name: str, values: dict, capfd) -> str:
    """Call it as a script does; '' if it did its work or said in one sentence why not."""
    capfd.readouterr()
    try:
        operator_of(name)("EXEC_DEFAULT", **values)
        said = ""
    except RuntimeError as error:
        said = str(error).removeprefix("Error: ").strip()
    printed = "".join(capfd.readouterr())
    bad = "\n" in said or "[Errno" in said or "Traceback" in printed or said.endswith("broke")
    return f"{name} {values}: {said} {printed}" if bad else ""


@pytest.fixture
def quiet(shell, monkeypatch, tmp_path):
    """In a folder of the test's own; nothing of the machine's browser or file manager opens."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("webbrowser.open", lambda *_a, **_k: True)
    return shell


@pytest.mark.slow
@pytest.mark.parametrize("made", ["nothing", "a sketched face"])
def test_any_operator_with_any_odd_value_says_one_sentence(quiet, sketch, capfd, made):
    if made == "a sketched face":
        press(sketch)
    bpy.ops.wm.save_as_mainfile(filepath="here.blend")
    every = []
    for name in operators():
        bpy.ops.wm.open_mainfile(filepath="here.blend")
        for values in odd_values(name) if name not in WAITING else ():
            every.append(spoilt(name, values, capfd))
    assert len(every) > 100 and not any(every), "\n".join(filter(None, every))


@pytest.mark.parametrize("order", [("filepath", "format"), ("format", "filepath")])
def test_the_ending_follows_the_format_that_a_script_sets(quiet, capfd, order):
    bpy.ops.mesh.add_facs_face(identity_keys=False)
    given = {"filepath": "my.head.v2.glb", "format": ".ply"}
    values = {name: given[name] for name in order}
    assert bpy.ops.sketch_to_face.export(**values) == {"FINISHED"}
    assert [path.name for path in Path().glob("my*")] == ["my.head.v2.ply"]
    assert "Traceback" not in "".join(capfd.readouterr())
