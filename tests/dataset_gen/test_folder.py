"""The folder of a data set: foreign files stay, damage is found, one run at a time, clean stops."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from PIL import Image

from dataset_gen import folder as folder_module
from dataset_gen import generate as module
from dataset_gen.folder import check_preview
from dataset_gen.generate import generate, read_meshes, read_shards

ROOT = Path(module.__file__).parents[1]


@pytest.fixture(autouse=True)
def small_shards(monkeypatch):
    monkeypatch.setattr(module, "SHARD", 2)


@pytest.fixture
def made(tmp_path) -> Path:
    """A finished data set: 3 samples in two shards."""
    generate(3, tmp_path / "made", seed=5)
    return tmp_path / "made"


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def flip(path: Path, place: int) -> None:
    data = bytearray(path.read_bytes())
    data[place] ^= 1
    path.write_bytes(data)


# --- damage ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("place", [3, 600, 20_000, -1500])
def test_a_flipped_bit_in_a_finished_set_is_named_and_not_certified(made, place):
    before = (made / "manifest.json").read_bytes()
    whole = (made / "shard-000000.tar").read_bytes()
    flip(made / "shard-000000.tar", place)
    damaged = contents(made)
    with pytest.raises(ValueError, match="shard-000000.tar is damaged; delete it to make it anew"):
        generate(3, made, seed=5, resume=True)
    assert contents(made) == damaged
    (made / "shard-000000.tar").unlink()
    generate(3, made, seed=5, resume=True)
    assert (made / "shard-000000.tar").read_bytes() == whole
    assert (made / "manifest.json").read_bytes() == before


def test_all_damaged_shards_are_named_at_once(made):
    for path in made.glob("shard-*.tar"):
        flip(path, 600)
    with pytest.raises(ValueError, match="shard-000000.tar, shard-000001.tar are damaged"):
        generate(3, made, seed=5, resume=True)


def test_a_flipped_bit_in_an_unfinished_set_is_found_too(tmp_path):
    """Also where it only makes one number another: the sums of what is there are kept."""

    class Enough(Exception):
        pass

    def enough(done: int, count: int) -> None:
        if done == 4:
            raise Enough

    with pytest.raises(Enough):
        generate(6, tmp_path, seed=5, progress=enough)
    assert sorted(contents(tmp_path)) == ["shard-000000.tar", "shard-000001.tar", "unfinished.json"]
    shard = tmp_path / "shard-000001.tar"
    shard.write_bytes(shard.read_bytes().replace(b'"yaw": ', b'"yaw":-', 1))
    with pytest.raises(ValueError, match="shard-000001.tar is damaged"):
        generate(6, tmp_path, seed=5, resume=True)


@pytest.mark.parametrize("damage", [b"", b"PNG", b'"index": 1'])
def test_without_any_sums_every_sample_is_looked_at(made, damage):
    """A data set of an older version, or a run that was killed before it told of a shard."""
    (made / "manifest.json").unlink()
    shard = made / "shard-000000.tar"
    whole = shard.read_bytes()
    if damage:
        shard.write_bytes(whole.replace(damage, damage[:-1] + b"2"))
        with pytest.raises(ValueError, match="shard-000000.tar is damaged"):
            generate(3, made, seed=5, resume=True)
        shard.write_bytes(whole)
    generate(3, made, seed=5, resume=True)
    assert shard.read_bytes() == whole


def test_a_torn_shard_is_one_sentence_for_whoever_reads(made):
    shard = made / "shard-000001.tar"
    whole = shard.read_bytes()
    shard.write_bytes(whole[: len(whole) // 2])  # a tar's end is up to 10 kB of nothing
    for read in (read_shards, read_meshes):
        with pytest.raises(ValueError, match="shard-000001.tar is (damaged|cut short)"):
            list(read(made))


# --- what is foreign ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["manifest.json", "preview.png", "unfinished.json", "notes.txt"])
@pytest.mark.parametrize("resume", [False, True])
def test_a_foreign_file_is_named_and_left(tmp_path, name, resume):
    (tmp_path / name).write_text('{"of": "another program"}')
    if resume and name == "preview.png":  # nothing replaces it unless --preview is given
        with pytest.raises(ValueError, match="preview.png was not drawn by --preview"):
            check_preview(tmp_path)
        generate(1, tmp_path, resume=True)
        assert (tmp_path / name).read_text() == '{"of": "another program"}'
        return
    with pytest.raises(ValueError, match=name):
        generate(1, tmp_path, resume=resume)
    assert contents(tmp_path) == {name: b'{"of": "another program"}'}


def test_our_own_preview_is_drawn_again(made):
    from addon.cli import main

    arguments = ["generate", "--count", "3", "--out", str(made), "--seed", "5", "--resume"]
    assert main([*arguments, "--preview", "2"]) == 0
    assert main([*arguments, "--preview", "3"]) == 0
    check_preview(made)
    Image.new("L", (8, 8)).save(made / "preview.png")
    before = (made / "preview.png").read_bytes()
    assert main([*arguments, "--preview", "3"]) == 2
    assert (made / "preview.png").read_bytes() == before


def test_no_sample_is_dropped_by_a_smaller_count(made):
    before = contents(made)
    for count in (2, 1):
        with pytest.raises(ValueError, match="--count"):
            generate(count, made, seed=5, resume=True)
    generate(4, made, seed=5, resume=True)
    (made / "shard-000002.tar").write_bytes(before["shard-000000.tar"])
    with pytest.raises(ValueError, match="shard-000002.tar is of a longer data set"):
        generate(4, made, seed=5, resume=True)
    (made / "shard-000002.tar").unlink()
    with pytest.raises(ValueError, match="shard-000001.tar holds more samples than --count"):
        generate(3, made, seed=5, resume=True)
    assert contents(made).keys() == before.keys()


def test_packages_that_differ_from_those_of_the_set_are_named(made, monkeypatch):
    manifest = json.loads((made / "manifest.json").read_text())
    manifest["versions"]["numpy"] = "1.2.3"
    (made / "manifest.json").write_text(json.dumps(manifest))
    generate(3, made, seed=5, resume=True)  # nothing is to be drawn
    assert json.loads((made / "manifest.json").read_text())["versions"]["numpy"] == "1.2.3"
    with pytest.raises(ValueError, match="manifest.json tells of numpy 1.2.3 and here is"):
        generate(5, made, seed=5, resume=True)


# --- arguments ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--seed", "-1"], "--seed must be at least 0, got -1"),
        (["--count", "0"], "--count must be at least 1, got 0"),
        (["--count", "-5"], "--count must be at least 1, got -5"),
        (["--count", "10000000000"], "--count must be at most 250000000"),
        (["--jobs", "0"], "--jobs must be at least 1, got 0"),
        (["--out", ""], "--out"),
        (["--out", "/dev/null"], "/dev/null is a file"),
        (["--out", "/dev/null/sub"], "/dev/null/sub cannot be written"),
        (["--out", "x" * 300], "the name is too long"),
        (["--preview", "-1"], "--preview must be at least 0"),
    ],
)
def test_impossible_arguments_name_the_option(tmp_path, monkeypatch, capsys, arguments, said):
    from addon.cli import main

    monkeypatch.setattr(module, "SHARD", 250)
    monkeypatch.chdir(tmp_path)
    assert main(["generate", "--count", "1", "--out", "out", *arguments]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_more_jobs_than_shards_start_no_more_workers(tmp_path, monkeypatch):
    asked = []

    class Pool(module.ProcessPoolExecutor):
        def __init__(self, jobs, **more):
            asked.append(jobs)
            super().__init__(jobs, **more)

    monkeypatch.setattr(module, "ProcessPoolExecutor", Pool)
    generate(4, tmp_path / "out", seed=5, jobs=10_000)
    assert asked == [2]


# --- several at once, and stops ------------------------------------------------------------------


def hears_ctrl_c() -> None:
    """A process of the background, as these tests may be one, is started deaf to it."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def started(out: Path, *more: str, count: int = 4000) -> subprocess.Popen[str]:
    """The command, generating, as soon as both of its workers draw."""
    run = subprocess.Popen(
        [sys.executable, "-m", "addon", "generate", "--count", str(count), "--out", str(out),
         "--seed", "3", *more],
        cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        preexec_fn=hears_ctrl_c,
    )  # fmt: skip
    workers = 2 if "--jobs" in more else 1
    while len(list(out.glob(".sketch2face-*.part/*"))) < workers:
        assert run.poll() is None, run.communicate()
        time.sleep(0.02)
    return run


@pytest.mark.skipif(os.name != "posix", reason="signals and locks of Linux and macOS")
@pytest.mark.parametrize("jobs", [(), ("--jobs", "2")])
@pytest.mark.parametrize("kill", [signal.SIGINT, signal.SIGTERM])
def test_a_stop_stops_at_once_and_leaves_nothing_half_made(tmp_path, kill, jobs):
    """Ctrl-C reaches all processes of a terminal; a polite kill the first one alone."""
    out = tmp_path / "out"
    run = started(out, *jobs)
    if kill == signal.SIGINT:
        os.killpg(run.pid, kill)
    else:
        run.send_signal(kill)
    _, error = run.communicate(timeout=600)
    assert run.returncode not in (0, 1)
    assert "Traceback" not in error
    assert not list(out.glob(".*"))
    assert len(list(out.glob("shard-*.tar"))) < 4  # of 16


@pytest.mark.skipif(os.name != "posix", reason="signals and locks of Linux and macOS")
def test_two_runs_do_not_share_a_folder(tmp_path):
    out = tmp_path / "out"
    run = started(out)
    try:
        for resume in (False, True):
            with pytest.raises(ValueError, match="another run is writing into"):
                generate(4, out, seed=3, resume=resume)
        assert list(out.glob(".sketch2face-*.part/*"))
    finally:
        run.kill()
        run.communicate()


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads processes from /proc")
def test_a_killed_worker_is_one_sentence(tmp_path):
    out = tmp_path / "out"
    run = started(out, "--jobs", "2")
    children = Path(f"/proc/{run.pid}/task/{run.pid}/children").read_text().split()
    workers = [
        pid for pid in children if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()
    ]
    os.kill(int(workers[0]), signal.SIGKILL)
    _, error = run.communicate(timeout=600)
    assert run.returncode == 2
    assert "a worker was killed" in error
    assert "--resume" in error
    assert not list(out.glob(".*"))


def test_locks_that_a_disk_does_not_know_are_done_without(tmp_path, monkeypatch):
    fcntl = pytest.importorskip("fcntl", reason="locks of Linux and macOS")

    def flock(*_):
        raise OSError(38, "no locks")

    monkeypatch.setattr(fcntl, "flock", flock)
    generate(1, tmp_path / "out")
    assert folder_module.MANIFEST in contents(tmp_path / "out")
