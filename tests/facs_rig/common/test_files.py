"""Files appear whole or not at all, and those of one job together."""

from __future__ import annotations

import errno
import os
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest

from facs_rig.common import files
from facs_rig.common.files import OutputError, Outputs, check_output, is_work, write_text

ROOT = Path(__file__).resolve().parents[3]


def contents(folder: Path) -> dict[str, str]:
    """Name -> text of everything in a folder, also of what is hidden."""
    return {
        str(path.relative_to(folder)): path.read_text()
        for path in folder.rglob("*")
        if not path.is_dir()
    }


def python(code: str, *arguments: object) -> list[str]:
    code = "from facs_rig.common.files import *\n" + code
    return [sys.executable, "-c", code, *map(str, arguments)]


def test_outputs_appear_together(tmp_path):
    with Outputs() as outputs:
        outputs.beside(tmp_path / "one.txt").write_text("1")
        outputs.beside(tmp_path / "two.txt").write_text("2")
        assert not (tmp_path / "one.txt").exists()
    assert contents(tmp_path) == {"one.txt": "1", "two.txt": "2"}
    assert len(os.listdir(tmp_path)) == 2


def test_outputs_fall_together(tmp_path):
    (tmp_path / "one.txt").write_text("old")
    with pytest.raises(RuntimeError), Outputs() as outputs:
        outputs.beside(tmp_path / "one.txt").write_text("new")
        outputs.beside(tmp_path / "two.txt").write_text("2")
        raise RuntimeError("in the middle of the work")
    assert contents(tmp_path) == {"one.txt": "old"}
    assert os.listdir(tmp_path) == ["one.txt"]


def spoilt(job: Path) -> list[Path]:
    """Places for files of which the last cannot be replaced: a folder is there."""
    (job / "old.txt").write_text("old")
    (job / "taken.txt").mkdir()
    (job / "taken.txt" / "inside").write_text("stays")
    return [job / "old.txt", job / "new.txt", job / "taken.txt"]


@pytest.mark.parametrize("links", [True, False])
def test_one_that_cannot_be_replaced_brings_the_others_back(tmp_path, monkeypatch, links):
    def none(*_):
        raise OSError(errno.EPERM, "no hard links on this disk")

    if not links:
        monkeypatch.setattr(os, "link", none)
    places = spoilt(tmp_path)
    before = contents(tmp_path)
    with pytest.raises(OutputError, match="taken.txt' cannot be written: a folder"):
        with Outputs() as outputs:
            for place in places:
                outputs.beside(place).write_text("new")
    assert contents(tmp_path) == before
    assert sorted(os.listdir(tmp_path)) == ["old.txt", "taken.txt"]


@pytest.mark.parametrize("moment", range(6))
def test_stopped_while_files_are_put_in_place(tmp_path, monkeypatch, moment):
    """Wherever between the renames a Ctrl-C arrives, all are as they were."""
    (tmp_path / "one.txt").write_text("old")
    (tmp_path / "keys").mkdir()
    (tmp_path / "keys" / "old.obj").write_text("old")
    before = contents(tmp_path)
    left = [moment]

    def stop_at(real):
        def call(*arguments):
            early, late = left[0] == 0, left[0] == 1
            left[0] -= 2
            if early:
                raise KeyboardInterrupt
            real(*arguments)
            if late:
                raise KeyboardInterrupt

        return call

    monkeypatch.setattr(os, "replace", stop_at(os.replace))
    with pytest.raises(KeyboardInterrupt), Outputs() as outputs:
        outputs.beside(tmp_path / "one.txt").write_text("new")
        keys = outputs.beside(tmp_path / "keys")
        keys.mkdir()
        (keys / "new.obj").write_text("new")
    assert contents(tmp_path) == before


def test_a_folder_is_an_output_too(tmp_path):
    for text in ("old", "new"):
        with Outputs() as outputs:
            outputs.beside(tmp_path / "face.obj").write_text(text)
            keys = outputs.beside(tmp_path / "face_keys")
            keys.mkdir()
            (keys / f"{text}.obj").write_text(text)
        assert contents(tmp_path) == {"face.obj": text, f"face_keys/{text}.obj": text}


def test_outputs_in_several_folders(tmp_path):
    for name in "ab":
        (tmp_path / name).mkdir()
    with Outputs() as outputs:
        for name in "ab":
            outputs.beside(tmp_path / name / "x.txt").write_text(name)
    assert contents(tmp_path) == {"a/x.txt": "a", "b/x.txt": "b"}


@pytest.mark.parametrize("length", [1, 240, 251, 255])
@pytest.mark.parametrize("letter", ["a", "ä"])
def test_names_may_be_as_long_as_the_disk_allows(tmp_path, length, letter):
    stem = letter * ((length - 4) // len(letter.encode())) or letter
    place = tmp_path / (stem + ".glb")
    check_output(place, (".glb",))
    write_text(place, "face")
    assert place.read_text() == "face"


def test_a_name_that_is_too_long_is_told_before_the_work(tmp_path):
    with pytest.raises(OutputError, match="cannot be written: the name is too long"):
        check_output(tmp_path / ("a" * 252 + ".glb"), (".glb",))
    with pytest.raises(OutputError, match="the name is too long"):
        check_output(tmp_path / "/".join(["a" * 200] * 30), ())


def test_the_ending_is_kept_while_a_file_grows(tmp_path):
    with Outputs() as outputs:
        part = outputs.beside(tmp_path / "face.glb")
        assert part.suffix == ".glb" and is_work(part.parent.name)
        part.write_text("")


def test_new_files_are_as_readable_as_others(tmp_path):
    umask = os.umask(0o027)
    try:
        write_text(tmp_path / "face.glb", "")
    finally:
        os.umask(umask)
    assert stat.S_IMODE((tmp_path / "face.glb").stat().st_mode) == 0o640


@pytest.mark.parametrize("mode", [0o600, 0o664, 0o755])
def test_a_file_that_was_there_keeps_its_permissions(tmp_path, mode):
    path = tmp_path / "face.glb"
    path.write_text("old")
    path.chmod(mode)
    write_text(path, "new")
    assert stat.S_IMODE(path.stat().st_mode) == mode
    assert path.read_text() == "new"


@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="needs two users")
def test_a_file_that_was_there_keeps_its_owner(tmp_path):
    path = tmp_path / "face.glb"
    path.write_text("old")
    os.chown(path, 65534, 65534)
    write_text(path, "new")
    assert (path.stat().st_uid, path.stat().st_gid) == (65534, 65534)


def test_a_link_is_followed(tmp_path):
    (tmp_path / "real").mkdir()
    for name in ("there.txt", "missing.txt"):
        (tmp_path / name).symlink_to(Path("real") / name)
    (tmp_path / "real" / "there.txt").write_text("old")
    for name in ("there.txt", "missing.txt"):
        check_output(tmp_path / name)
        write_text(tmp_path / name, "new")
        assert (tmp_path / name).is_symlink()
        assert (tmp_path / "real" / name).read_text() == "new"
    assert sorted(os.listdir(tmp_path / "real")) == ["missing.txt", "there.txt"]


def strange(folder: Path) -> dict[str, str]:
    """Names of places that cannot be written to, in `folder`, and what is said of each."""
    (folder / "loop").symlink_to("loop")
    (folder / "nowhere").symlink_to(folder / "missing" / "file")
    os.mkfifo(folder / "pipe")
    (folder / "file").write_text("")
    (folder / "folder").mkdir()
    return {
        "loop": "a link that leads back to itself",
        "nowhere": "There is no folder '.*missing'",
        "pipe": "a device or a pipe",
        "/dev/null": "a device or a pipe",
        "file/face": "a part of the path is a file",
        "folder": "is a folder",
        "missing/face": "There is no folder",
        "zero\0byte": "a name cannot hold such characters",
        "x" * 300: "the name is too long",
    }


def test_places_that_cannot_be_written_to_are_told(tmp_path):
    for name, said in strange(tmp_path).items():
        before = sorted(os.listdir(tmp_path))
        with pytest.raises(OutputError, match=said) as told:
            check_output(tmp_path / name)
        assert str(told.value).count("\n") == 0 and str(told.value).endswith(".")
        assert sorted(os.listdir(tmp_path)) == before
    with pytest.raises(OutputError, match="empty name"):
        check_output("")


@pytest.mark.parametrize(
    ("number", "said"),
    [(errno.EACCES, "not allowed"), (errno.ESTALE, "stale"), (errno.EIO, "input/output")],
)
def test_a_place_out_of_reach_is_told(tmp_path, monkeypatch, number, said):
    def refuse(self, **_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(Path, "stat", refuse)
    with pytest.raises(OutputError, match=f"cannot be written: .*{said}"):
        check_output(tmp_path / "face.glb")


def test_a_write_protected_file_is_left_alone(tmp_path, monkeypatch):
    path = tmp_path / "face.glb"
    path.write_text("precious")
    path.chmod(0o444)
    monkeypatch.setattr(os, "access", lambda place, how: how != os.W_OK)  # root may always
    with pytest.raises(OutputError, match="write-protected"):
        check_output(path)


def test_a_full_disk_is_told_and_leaves_nothing(tmp_path):
    (tmp_path / "big.txt").write_text("old")
    code = """
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
try:
    write_text(sys.argv[1], "x" * 100_000)
except OutputError as error:
    print(error)
"""
    done = subprocess.run(
        python(code, tmp_path / "big.txt"), cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout == (
        f"'{tmp_path / 'big.txt'}' cannot be written: the file would be larger than is allowed "
        "here.\n"
    )
    assert contents(tmp_path) == {"big.txt": "old"}
    with pytest.raises(OutputError, match="big.txt' cannot be written: the disk is full"):
        with Outputs() as outputs:
            outputs.beside(tmp_path / "big.txt")
            raise OSError(errno.ENOSPC, "No space left on device")


def test_an_error_that_is_not_of_the_files_stays_what_it_is(tmp_path):
    with pytest.raises(FileNotFoundError), Outputs():
        raise FileNotFoundError("before any file was asked for")
    with pytest.raises(ZeroDivisionError), Outputs() as outputs:
        outputs.beside(tmp_path / "face.glb")
        raise ZeroDivisionError


def test_what_a_killed_program_left_goes_with_the_next_run(tmp_path):
    code = """
import os, sys, time
with Outputs() as outputs:
    outputs.beside(sys.argv[1]).write_text("half")
    print("ready", flush=True)
    time.sleep(60)
"""
    for _ in range(3):
        command = python(code, tmp_path / "face.glb")
        with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE) as killed:
            assert killed.stdout.readline() == b"ready\n"
            killed.kill()
        assert len(os.listdir(tmp_path)) == 1
    write_text(tmp_path / "face.glb", "whole")
    assert os.listdir(tmp_path) == ["face.glb"]


def test_what_still_grows_is_left_alone(tmp_path):
    with Outputs() as outputs:
        outputs.beside(tmp_path / "one.txt").write_text("1")
        write_text(tmp_path / "one.txt", "2")  # another job for the same file
        files.clear(tmp_path)
    assert contents(tmp_path) == {"one.txt": "1"}


def test_without_locks_only_old_leftovers_are_cleared(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "fcntl", None)
    for name, age in (("young", 60), ("old", 2 * files.FORGOTTEN)):
        work = tmp_path / f"{files.PREFIX}{name}{files.SUFFIX}"
        work.mkdir()
        os.utime(work, (time.time() - age,) * 2)
    write_text(tmp_path / "face.glb", "whole")
    assert sorted(os.listdir(tmp_path)) == [f"{files.PREFIX}young{files.SUFFIX}", "face.glb"]


def test_many_processes_write_the_same_file(tmp_path):
    code = """
import sys
for _ in range(50):
    write_text(sys.argv[1], "whole" * 1000)
"""
    command = python(code, tmp_path / "face.glb")
    running = [subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE) for _ in range(4)]
    said = [process.communicate()[1].decode() for process in running]
    assert said == [""] * 4
    assert contents(tmp_path) == {"face.glb": "whole" * 1000}
    assert os.listdir(tmp_path) == ["face.glb"]


def test_write_text(tmp_path):
    write_text(tmp_path / "note.txt", "ä\n")
    assert (tmp_path / "note.txt").read_bytes() == "ä\n".encode()


def test_checking_an_output_changes_nothing(tmp_path):
    check_output(tmp_path / "new.glb", (".glb",))
    assert not os.listdir(tmp_path)
    with pytest.raises(OutputError, match="is a folder"):
        check_output(tmp_path)
