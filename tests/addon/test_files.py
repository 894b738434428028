"""Files appear whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from addon.files import OutputError, Outputs, check_output, write_text


def contents(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_outputs_appear_together(tmp_path):
    with Outputs() as outputs:
        outputs.beside(tmp_path / "one.txt").write_text("1")
        outputs.beside(tmp_path / "two.txt").write_text("2")
        assert not (tmp_path / "one.txt").exists()
    assert contents(tmp_path) == {"one.txt", "two.txt"}


def test_outputs_fall_together(tmp_path):
    (tmp_path / "one.txt").write_text("old")
    with pytest.raises(RuntimeError), Outputs() as outputs:
        outputs.beside(tmp_path / "one.txt").write_text("new")
        outputs.beside(tmp_path / "two.txt").write_text("2")
        raise RuntimeError("in the middle of the work")
    assert contents(tmp_path) == {"one.txt"}
    assert (tmp_path / "one.txt").read_text() == "old"


def test_outputs_keep_the_ending_and_are_readable_by_others(tmp_path):
    with Outputs() as outputs:
        part = outputs.beside(tmp_path / "face.glb")
        assert part.suffix == ".glb" and part.parent == tmp_path
    umask = os.umask(0)
    os.umask(umask)
    assert (tmp_path / "face.glb").stat().st_mode & 0o777 == 0o666 & ~umask


def test_write_text(tmp_path):
    write_text(tmp_path / "note.txt", "ä\n")
    assert (tmp_path / "note.txt").read_bytes() == "ä\n".encode()


def test_checking_an_output_changes_nothing(tmp_path):
    check_output(tmp_path / "new.glb", (".glb",))
    assert not contents(tmp_path)
    with pytest.raises(OutputError, match="is a folder"):
        check_output(tmp_path)
