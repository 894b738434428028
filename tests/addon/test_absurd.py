"""Every option of every command with values that nobody means: one sentence, and nothing touched.

The table is made from the parsers themselves, so that a new option is in it at once.
"""

from __future__ import annotations

import argparse
import errno
import os
import shutil
from pathlib import Path

import pytest

from addon import cli
from addon.sketches.render import FOLDER as SKETCHES
from dataset_gen.generate import generate

NUMBERS = ["nan", "inf", "-inf", "-1", "1e308", "9" * 30, "1e-320", "0x10", "1,5", "²", ""]
NAMES = ["", "é", "no\nsuch", "\udcff", "__class__", "x" * 5000]
PATHS = [
    "", ".", "folder", "pipe", "loop", "/dev/null", "/dev/full", "file/inside", "missing/inside",
    "locked/inside", "x" * 300, "/".join(["y" * 200] * 30), "no\nsuch", "\udcff", "é", "file",
    "hidden",
]  # fmt: skip
ENDINGS = ("", ".png", ".json", ".glb", ".obj", ".blend")

# What each command needs beside the option that is tried.
BASES = {
    "fit": ["sketch.png", "--method", "shape", "-q"],
    "detect": ["sketch.png"],
    "generate": ["--count", "1", "--out", "new"],
    "train": ["--data", "shards", "--steps", "1"],
    "evaluate": ["--data", "shards", "--limit", "1"],
    "rig": [],
}
OWN = {"sheet": [], "output": []}  # these options of `rig` are its jobs themselves
LISTS = ("only", "layers", "sketch", "split")


@pytest.fixture(scope="module")
def shards(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("data") / "shards"
    generate(1, folder, seed=1)
    return folder


@pytest.fixture
def place(tmp_path, monkeypatch, shards):
    """A current folder with something of every kind; locked ones are locked for root as well."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(SKETCHES / "smiling_woman.png", "sketch.png")
    shutil.copytree(shards, "shards")
    os.mkfifo("pipe")
    Path("loop").symlink_to("loop")
    Path("file").write_text("precious")
    for ending in ENDINGS[1:]:
        Path(f"old{ending}").write_text("precious")
        os.mkfifo(f"pipe{ending}")
        Path(f"loop{ending}").symlink_to(f"loop{ending}")
        Path(f"folder{ending}").mkdir()
    for name in ("folder", "locked"):
        Path(name).mkdir()
    Path("hidden").write_text("precious")
    real = Path.stat

    def stat(self, **how):
        if "locked" in self.parts[:-1] or self.name == "hidden":
            raise PermissionError(errno.EACCES, "Permission denied", str(self))
        return real(self, **how)

    monkeypatch.setattr(Path, "stat", stat)
    return tmp_path


def options_of(command: str) -> list[argparse.Action]:
    (subparsers,) = (
        action
        for action in cli._parser(command)._actions
        if isinstance(action, argparse._SubParsersAction)
    )
    actions = subparsers.choices[command]._actions
    return [action for action in actions if action.nargs != 0 and action.dest != "help"]


def values_of(action: argparse.Action) -> list[str]:
    if action.type in (int, float):
        return NUMBERS
    if action.choices:
        return NAMES
    if getattr(action.type, "__name__", "") in ("file_name", "file_path"):
        return [path + ending for path in PATHS for ending in ENDINGS if path or not ending]
    return [*NAMES, *NUMBERS, "a=b=c", "smile=", "=1", "smile=nan", "smile=-1", "1,2", "nan,nan,1"]


def snapshot(folder: Path) -> dict[str, str]:
    return {
        entry.path: entry.name if not entry.is_file(follow_symlinks=False) else _text(entry.path)
        for entry in os.scandir(folder)
    }


def _text(path: str) -> str:
    with open(path, "rb") as file:
        return repr(file.read(100))


class Reached(Exception):
    """The options were taken, and the work would begin."""


@pytest.fixture
def idle(monkeypatch):
    """The long work is not done: whether a value is refused is known before it."""

    def reached(*_, **__):
        raise Reached

    monkeypatch.setattr("addon.explain.explain", reached)
    monkeypatch.setattr("addon.sheet.contact_sheet", reached)
    monkeypatch.setattr("addon.export.write_mesh", reached)
    monkeypatch.setattr("dataset_gen.generate._run", reached)
    for name in ("train.train", "train.speed", "googlenet.train_baseline", "retrain.retrain"):
        monkeypatch.setattr(f"classifiers.training.{name}", reached)


@pytest.mark.slow
@pytest.mark.parametrize("command", BASES)
def test_every_option_with_values_that_nobody_means(place, idle, capfd, monkeypatch, command):
    fit_of = {}
    if command == "fit":
        from addon import pipeline

        known = pipeline.fit

        def once(sketch, options, progress):
            """Options that say the same are fitted once."""
            key = str(sketch), repr(options.align), repr(options.pins)
            if key not in fit_of:
                fit_of[key] = known(sketch, options, progress)
            return fit_of[key]

        monkeypatch.setattr(pipeline, "fit", once)
        monkeypatch.setattr(pipeline, "write_face", lambda *_: (_ for _ in ()).throw(Reached))
    tried, wrong = 0, []
    for action in options_of(command):
        flag = action.option_strings[-1] if action.option_strings else ""
        for value in values_of(action):
            if flag:
                given = [*BASES[command], f"{flag}={value}"]
                if action.dest in LISTS:
                    given = [*BASES[command], flag, value]
                if command == "rig" and action.dest not in OWN:
                    job = "--sheet=s.png" if _belongs(action.dest) else "-o=f.ply"
                    given.append(job.replace("-o=", "--output="))
            else:
                given = [value, *BASES[command][1:]]
            before = snapshot(place)
            try:
                status = cli.main([command, *given])
            except Reached:
                status = 0
            said = capfd.readouterr()
            told = f"{command} {given}: {status} {said.err[-2000:]}"
            if "Reached" in said.err:
                status = 0
            tried += 1
            plain = said.err.count("\n") == 1 and said.err.startswith("sketch2face")
            if status not in (0, 2):
                wrong.append(f"a fault of ours: {told}")
            elif status == 2 and not plain:
                wrong.append(f"more than a line: {told}")
            elif status == 2 and not _names(said.err, value, flag or action.dest):
                wrong.append(f"names nothing: {told}")
            elif status == 2 and snapshot(place) != before:
                wrong.append(f"touched something: {told}")
            for name in set(snapshot(place)) - set(before):
                shutil.rmtree(name) if os.path.isdir(name) else os.unlink(name)
    assert tried > 20
    assert not wrong, "\n".join([f"{len(wrong)} of {tried}", *wrong[:20]])


def _belongs(dest: str) -> bool:
    from addon.rig_command import OWN as JOBS

    return dest in JOBS["--sheet OUT.png"]


def _names(sentence: str, value: str, flag: str) -> bool:
    """Whether a sentence says which value, or of which option, it is about."""
    from addon.terminal import printable

    plain = flag.strip("-").replace("-", "_")
    parts = (Path(value).name[:40], *Path(value).parts[:1]) if value else ()
    parts += (*value.rpartition("=")[::2], value.replace(",", ", "), "control ''", "unit named")
    known = (*parts, value[:40], printable(value)[:40], repr(value)[1:40], flag, plain, "empty")
    return any(part and part in sentence for part in known)
