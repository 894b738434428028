"""Closed, full and broken streams, streams without degree signs, and signals."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from addon.sketches.render import FOLDER as SKETCHES
from addon.terminal import Stopped, printable, stoppable
from tests.nightly import at_night

ROOT = Path(__file__).resolve().parents[2]
SKETCH = SKETCHES / "smiling_woman.png"
COMMAND = f"{sys.executable} -m addon"
STOPPED = "sketch2face: stopped; nothing half-done was left behind.\n"


def shell(line: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """A line of a shell, in which $S is the command."""
    known = os.environ | {"PYTHONPATH": str(ROOT), "S": COMMAND} | environment
    return subprocess.run(
        ["bash", "-c", line.replace("$S", COMMAND)],
        cwd=folder,
        env=known,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize(
    "closed", ["2>&-", *map(at_night, (">&-", ">&- 2>&-")), "<&- >&- 2>&-"]
)  # one of them, and all
def test_closed_streams_do_not_hinder_the_work(tmp_path, closed):
    done = shell(f"$S fit {SKETCH} -o face.ply --report r.json {closed}", tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert sorted(os.listdir(tmp_path)) == ["face.ply", "r.json"]
    assert (tmp_path / "face.ply").read_bytes().startswith(b"ply")
    assert json.loads((tmp_path / "r.json").read_text())["aus"]


# Every command and every stream in each run, every pair of them at night.
COMMANDS = ("detect nobody.png", "fit nobody.png", "rig -o a.stl", "paint")
CLOSED = ("2>&-", ">&- 2>&-", "2>/dev/full", ">/dev/full 2>/dev/full")


@pytest.mark.parametrize(("what", "closed"), [
    (what, closed) if k == m else at_night(what, closed)
    for k, what in enumerate(COMMANDS) for m, closed in enumerate(CLOSED)
])  # fmt: skip
def test_the_exit_status_is_said_where_nothing_else_can_be(tmp_path, closed, what):
    done = shell(f"$S {what} {closed}", tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", "")


@pytest.mark.parametrize("what", [f"detect {SKETCH} --json", "rig --list", "evaluate --json"])
def test_output_that_cannot_be_written_is_told(tmp_path, what):
    done = shell(f"$S {what} >/dev/full", tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("sketch2face: what the command says")
    assert "the disk is full" in done.stderr and done.stderr.count("\n") == 1


def test_files_count_more_than_what_is_said_of_them(tmp_path):
    done = shell("$S rig -o face.ply >/dev/full", tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert os.listdir(tmp_path) == ["face.ply"]


def test_a_picture_is_made_though_the_reader_has_left(tmp_path):
    line = f"$S detect {SKETCH} {SKETCHES / 'angry_man.png'} --json --explain e.png | true"
    done = shell(f"set -o pipefail; {line}", tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert os.listdir(tmp_path) == ["e.png"]


def test_a_reader_that_leaves_early_ends_a_command_of_many_lines(tmp_path):
    done = shell(f"$S detect {SKETCH} --json | head -c 9", tmp_path)
    assert (done.stdout, done.stderr) == ('{"sketch"', "")


@pytest.mark.parametrize(
    ("environment", "degrees"),
    [
        ({"PYTHONIOENCODING": "ascii"}, "-1 deg"),
        ({"PYTHONIOENCODING": "cp437"}, "-1"),
        ({"PYTHONIOENCODING": "utf-8"}, "-1°"),
        ({"LC_ALL": "C"}, "-1"),
        ({"LC_ALL": "POSIX", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}, "-1 deg"),
    ],
)
def test_a_terminal_without_degree_signs(tmp_path, environment, degrees):
    shutil.copy(SKETCH, tmp_path / "Zoë.png")
    done = subprocess.run(
        [*COMMAND.split(), "detect", "Zoë.png"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)} | environment,
        capture_output=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, b"")
    encoding = environment.get("PYTHONIOENCODING", "ascii" if "PYTHONUTF8" in environment else "")
    assert f"pitch {degrees}" in done.stdout.decode(encoding or "utf-8")
    done = subprocess.run(
        [*COMMAND.split(), "detect", "Noël.png"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)} | environment,
        capture_output=True,
        check=False,
    )
    assert done.returncode == 2 and done.stderr.count(b"\n") == 1
    assert b"There is no file 'No" in done.stderr and b".png'" in done.stderr


def test_names_that_are_no_text(tmp_path):
    """Bytes that are no UTF-8, line feeds, escape sequences: in one line, and nothing is lost."""
    for name in (b"\xff.png", b"two\nlines.png", b"\x1b[2Jred.png"):
        place = os.path.join(os.fsencode(tmp_path), name)
        shutil.copy(SKETCH, place)
        explained = tmp_path / "e.png"
        command = [*COMMAND.split(), "detect", place, "--explain", explained]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, check=False)
        assert (done.returncode, done.stderr) == (0, b"")
        assert b"\x1b" not in done.stdout and explained.exists()
        missing = subprocess.run(
            [*COMMAND.split(), "fit", place + b"x"], cwd=ROOT, capture_output=True, check=False
        )
        assert missing.returncode == 2 and missing.stderr.count(b"\n") == 1
        assert b"\x1b" not in missing.stderr


def test_printable():
    assert printable("plain °…") == "plain °…"
    assert printable("a\nb\r\n  c") == "a b c"
    assert printable("a  b") == "a  b"
    assert printable("\x1b[2J\udcff\0") == "\\x1b[2J\\udcff\\x00"


# --- signals -------------------------------------------------------------------------------------

SLOW = """
import sys, time
from addon import cli, export

write = export.WRITERS[".ply"]

def slowly(*arguments):
    write(*arguments)
    print("writing", flush=True)
    time.sleep(60)

export.WRITERS[".ply"] = slowly
sys.exit(cli.main(sys.argv[1:]))
"""


def heard() -> None:
    """Hear signals as on a terminal, even where these tests run under nohup or in a background."""
    for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
        signal.signal(number, signal.SIG_DFL)


def while_it_writes(folder: Path, before: str = "") -> subprocess.Popen[str]:
    """The command with its outputs half-written."""
    line = f"{before} exec '{sys.executable}' -c '{SLOW.replace(chr(39), chr(34))}'"
    process = subprocess.Popen(
        ["bash", "-c", f"{line} rig -o '{folder}/face.ply'"],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=heard,
    )
    assert process.stdout.readline() == "writing\n"
    assert any(path.is_dir() for path in folder.iterdir())
    return process


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP", "SIGINT"])
def test_a_signal_leaves_nothing_behind(tmp_path, name):
    number = getattr(signal, name)
    (tmp_path / "face.ply").write_text("old")
    process = while_it_writes(tmp_path)
    process.send_signal(number)
    said = process.communicate(timeout=60)[1]
    assert (process.returncode, said) == (128 + number, STOPPED)
    assert os.listdir(tmp_path) == ["face.ply"]
    assert (tmp_path / "face.ply").read_text() == "old"


def test_what_is_killed_is_cleared_by_the_next_run(tmp_path):
    for _ in range(2):
        process = while_it_writes(tmp_path)
        process.kill()
        process.communicate(timeout=60)
        assert len(os.listdir(tmp_path)) == 1
    done = shell("$S rig -o face.ply", tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert os.listdir(tmp_path) == ["face.ply"]


def test_nohup_is_heeded(tmp_path):
    process = while_it_writes(tmp_path, before="trap '' HUP;")
    process.send_signal(signal.SIGHUP)
    time.sleep(0.3)
    assert process.poll() is None
    process.terminate()
    assert process.communicate(timeout=60)[1] == STOPPED


def test_impatience_does_not_hinder_the_clearing_up():
    with pytest.raises(Stopped), stoppable():
        try:
            signal.raise_signal(signal.SIGTERM)
        finally:
            signal.raise_signal(signal.SIGTERM)
            signal.raise_signal(signal.SIGHUP)
            cleared = True
    assert cleared


def test_handlers_are_put_back():
    before = [signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGHUP)]
    with pytest.raises(Stopped) as told, stoppable():
        signal.raise_signal(signal.SIGTERM)
    assert told.value.number == signal.SIGTERM
    assert [signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGHUP)] == before
