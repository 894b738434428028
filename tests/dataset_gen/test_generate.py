"""Data sets: what is in them, and that the same seed gives the same bytes."""

import errno
import hashlib
import io
import json
import os
import subprocess
import sys
import tarfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import minimum_filter

from dataset_gen import generate as module
from dataset_gen import stroke_of
from dataset_gen.generate import generate, make_sample, read_meshes, read_shards
from dataset_gen.linework.paper import through
from dataset_gen.sampling import sample_face, sample_rng
from facs_rig import CONTROL_NAMES, LANDMARKS, Camera, FaceParameters, load_rig


@pytest.fixture
def small_shards(monkeypatch):
    monkeypatch.setattr(module, "SHARD", 2)


def names(path):
    with tarfile.open(path) as tar:
        return tar.getnames()


def test_a_data_set_is_what_the_contract_says(tmp_path, small_shards):
    seen = []
    shards = generate(3, tmp_path, seed=5, progress=lambda done, total: seen.append((done, total)))
    assert [p.name for p in shards] == ["shard-000000.tar", "shard-000001.tar"]
    assert names(shards[0]) == ["00000000.json", "00000000.png", "00000001.json", "00000001.png"]
    assert seen == [(2, 3), (3, 3)]
    with tarfile.open(shards[1]) as tar:
        picture = Image.open(io.BytesIO(tar.extractfile("00000002.png").read()))
        meta = json.loads(tar.extractfile("00000002.json").read())
    assert (picture.mode, picture.size) == ("L", (256, 256))
    pixels = np.asarray(picture)
    assert np.median(pixels) > 150
    assert pixels.min() < np.median(pixels) - 80
    assert set(meta["aus"]) == set(CONTROL_NAMES)
    assert set(meta["landmarks"]) == set(LANDMARKS)
    for key in ("identity", "head", "camera", "style"):
        assert isinstance(meta[key], dict)
    assert (meta["seed"], meta["index"], meta["engine"]) == (5, 2, "contours")
    assert meta["detail"] in (0, 1, 2)


@pytest.mark.parametrize("index", range(6))
def test_the_parameters_make_the_landmarks_again(index):
    """What is stored is enough to rebuild the face, its camera and the slant of the photograph."""
    _, meta = make_sample(3, index)
    rig = load_rig()
    camera = meta["camera"]
    again = Camera(
        camera["width"], camera["height"], tuple(camera["scale"]), tuple(camera["centre"]),
        camera["distance"] or np.inf,
    )  # fmt: skip
    posed = rig.pose(FaceParameters.from_json(meta))
    pixels = through(np.array(meta["page"]), again.project(posed[rig.landmarks]))
    stored = np.array([meta["landmarks"][name] for name in LANDMARKS])
    np.testing.assert_allclose(pixels, stored, atol=0.05)


def test_same_seed_same_bytes_whatever_came_before(tmp_path, small_shards):
    one = generate(4, tmp_path / "one", seed=9)
    two = generate(4, tmp_path / "two", seed=9, jobs=2)
    assert [p.read_bytes() for p in one] == [p.read_bytes() for p in two]
    # interrupted after the first shard, and with a torn file beside it
    (tmp_path / "three").mkdir()
    (tmp_path / "three" / "shard-000000.tar").write_bytes(one[0].read_bytes())
    three = generate(4, tmp_path / "three", seed=9, resume=True)
    assert [p.read_bytes() for p in three] == [p.read_bytes() for p in one]
    kept = sorted(p.name for p in (tmp_path / "three").iterdir())
    assert kept == ["manifest.json", *(p.name for p in three)]
    manifests = [(tmp_path / name / "manifest.json").read_bytes() for name in ("one", "three")]
    assert manifests[0] == manifests[1]


def test_the_manifest_counts_and_checks(tmp_path, small_shards):
    shards = generate(3, tmp_path, seed=5, strokes=True)
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    assert manifest["samples"] == 3
    assert manifest["recipe"] == {
        "seed": 5, "scheme": "people", "engine": "contours", "strokes": True, "meshes": False,
        "hair": 0.75,
    }  # fmt: skip
    for told, path in zip(manifest["shards"], shards, strict=True):
        assert told["name"] == path.name
        assert told["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
    assert [told["samples"] for told in manifest["shards"]] == [2, 1]


def test_strokes_are_kept_on_request():
    """Drawn again as clean ink they lie on the dark of the picture."""
    shares = []
    for index in range(5):
        picture, meta = make_sample(4, index, strokes=True)
        plain, without = make_sample(4, index)
        np.testing.assert_array_equal(picture, plain)
        assert "strokes" not in without
        strokes = [stroke_of(stored) for stored in meta["strokes"]]
        strong = np.concatenate([s.points[s.strength > 0.5] for s in strokes if s.width >= 1])
        inside = strong[((strong > 2) & (strong < 253)).all(axis=1)]
        column, row = np.floor(inside).astype(int).T
        shade = minimum_filter(picture, 3)[row, column]
        shares.append(np.mean(shade < np.median(picture) - 40))
    assert np.median(shares) > 0.98  # one or the other is a faint pencil
    assert min(shares) > 0.7


def test_meshes_are_kept_on_request(tmp_path, small_shards):
    shards = generate(3, tmp_path / "with", seed=5, meshes=True)
    assert names(shards[1]) == ["00000002.json", "00000002.png", "00000002.ply"]
    generate(3, tmp_path / "without", seed=5)
    both = zip(read_shards(tmp_path / "with"), read_shards(tmp_path / "without"), strict=True)
    for (picture, meta), (other, told) in both:
        np.testing.assert_array_equal(picture, other)
        assert meta == told
    rig = load_rig()
    again = zip(read_shards(tmp_path / "with"), read_meshes(tmp_path / "with"), strict=True)
    for (_, meta), mesh in again:
        posed = rig.pose(FaceParameters.from_json(meta))
        np.testing.assert_array_equal(mesh.vertices, posed)  # metres, in the rig's order
        np.testing.assert_array_equal(mesh.faces, rig.triangles)
    assert not list(read_meshes(tmp_path / "without"))
    jobs = generate(3, tmp_path / "jobs", seed=5, meshes=True, jobs=2)
    assert [p.read_bytes() for p in jobs] == [p.read_bytes() for p in shards]
    with tarfile.open(shards[0]) as tar:
        assert tar.extractfile("00000000.ply").read(40).startswith(b"ply\nformat binary_little_")
    for folder, meshes in (("with", False), ("without", True)):
        with pytest.raises(ValueError, match=f"{folder} meshes; resume with the same"):
            generate(3, tmp_path / folder, seed=5, meshes=meshes, resume=True)
    shards[1].unlink()
    generate(3, tmp_path / "with", seed=5, meshes=True, resume=True)
    assert shards[1].read_bytes() == jobs[1].read_bytes()


def test_a_shard_without_one_mesh_is_made_again(tmp_path, small_shards):
    (shard,) = generate(2, tmp_path, seed=5, meshes=True)
    whole = shard.read_bytes()
    with tarfile.open(fileobj=io.BytesIO(whole)) as old, tarfile.open(shard, "w") as new:
        for member in old.getmembers()[:-1]:
            new.addfile(member, old.extractfile(member))
    generate(2, tmp_path, seed=5, meshes=True, resume=True)
    assert shard.read_bytes() == whole


def test_shards_with_meshes_hold_fewer_samples(tmp_path, monkeypatch):
    made = []

    def run(todo, *_):
        made.extend(todo.values())
        yield from ()

    monkeypatch.setattr(module, "_run", run)
    generate(60, tmp_path, meshes=True)
    assert made == [range(0, 25), range(25, 50), range(50, 60)]


def test_a_killed_run_is_resumed_to_the_same_bytes(tmp_path, small_shards):
    """Killed between any two samples: what is whole stays, what is torn is made again."""
    whole = generate(8, tmp_path / "whole", seed=3)
    program = (
        "from dataset_gen import generate as g; g.SHARD = 2\n"
        f"g.generate(8, {str(tmp_path / 'torn')!r}, seed=3)"
    )
    run = subprocess.Popen([sys.executable, "-c", program], cwd=Path(module.__file__).parents[1])
    while not list((tmp_path / "torn").glob("shard-000001.tar")):
        assert run.poll() is None
        time.sleep(0.02)
    run.kill()
    run.wait()
    assert len(list((tmp_path / "torn").glob("shard-*.tar"))) < 4
    (tmp_path / "torn" / ".shard-000003.tar.99").write_bytes(b"torn")
    torn = generate(8, tmp_path / "torn", seed=3, resume=True)
    assert [p.read_bytes() for p in torn] == [p.read_bytes() for p in whole]
    assert not list((tmp_path / "torn").glob(".*"))


def workers_of(parent: int) -> list[int]:
    """Process numbers of the pool's workers that a process has started."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            stat = (folder / "stat").read_text().rsplit(")", 1)[1].split()
            command = (folder / "cmdline").read_bytes()
        except OSError:  # ended meanwhile
            continue
        if int(stat[1]) == parent and stat[0] != "Z" and b"spawn_main" in command:
            found.append(int(folder.name))
    return found


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads processes from /proc")
def test_workers_end_when_their_parent_is_killed(tmp_path):
    script = tmp_path / "run.py"
    script.write_text(
        "from dataset_gen import generate as g; g.SHARD = 400\n"
        f"if __name__ == '__main__': g.generate(800, {str(tmp_path / 'd')!r}, seed=3, jobs=2)"
    )
    environment = os.environ | {"PYTHONPATH": str(Path(module.__file__).parents[1])}
    run = subprocess.Popen([sys.executable, str(script)], env=environment)
    while len(list(tmp_path.glob("d/.sketch2face-*.part/*"))) < 2:
        assert run.poll() is None
        time.sleep(0.05)
    workers = workers_of(run.pid)
    assert len(workers) == 2
    run.kill()
    run.wait()
    patience = time.monotonic() + 10  # they look every half second
    while any(Path(f"/proc/{pid}").exists() for pid in workers) and time.monotonic() < patience:
        time.sleep(0.1)
    left = [pid for pid in workers if Path(f"/proc/{pid}").exists()]
    for pid in left:
        os.kill(pid, 9)
    assert not left


def test_somebody_elses_folder_is_left_alone(tmp_path):
    (tmp_path / "thesis.pdf").write_text("x")
    for resume in (False, True):
        with pytest.raises(ValueError, match=r"holds something else \('thesis.pdf'\)"):
            generate(1, tmp_path, resume=resume)
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.pdf"]


def test_a_full_disk_is_one_sentence(tmp_path, small_shards, monkeypatch):
    generate(2, tmp_path, seed=1)

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("dataset_gen.shards._add", full)
    with pytest.raises(ValueError, match="the disk is full.*--resume"):
        generate(4, tmp_path, seed=1, resume=True)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["manifest.json", "shard-000000.tar"]


def test_a_damaged_shard_is_named(tmp_path, small_shards):
    shards = generate(2, tmp_path, seed=1)
    shards[0].write_bytes(b"not a tar")
    with pytest.raises(ValueError, match="shard-000000.tar is damaged; delete it"):
        generate(2, tmp_path, seed=1, resume=True)


def test_resuming_to_a_larger_count_fills_the_last_shard(tmp_path, small_shards):
    generate(3, tmp_path, seed=1)
    shards = generate(4, tmp_path, seed=1, resume=True)
    assert [m["index"] for _, m in read_shards(tmp_path)] == [0, 1, 2, 3]
    assert len(shards) == 2


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"count": 0}, "--count must be at least 1"),
        ({"jobs": 0}, "--jobs must be at least 1"),
        ({"engine": "crayon"}, "no engine 'crayon'"),
        ({"scheme": "wild"}, "no scheme 'wild'"),
    ],
)
def test_impossible_arguments_are_refused(tmp_path, change, sentence):
    arguments = {"count": 1, "out": tmp_path / "d", **change}
    with pytest.raises(ValueError, match=sentence):
        generate(**arguments)
    assert not (tmp_path / "d").exists()


def test_a_folder_with_shards_is_not_overwritten(tmp_path, small_shards):
    generate(1, tmp_path, seed=1)
    with pytest.raises(ValueError, match="already holds shards"):
        generate(1, tmp_path, seed=1)
    with pytest.raises(ValueError, match="made with seed 1"):
        generate(1, tmp_path, seed=2, resume=True)


def test_a_file_for_a_folder(tmp_path):
    (tmp_path / "f").write_text("x")
    with pytest.raises(ValueError, match="is a file"):
        generate(1, tmp_path / "f")


@pytest.mark.parametrize("scheme", ["people", "sparse"])
def test_one_person_may_be_drawn_twice(scheme):
    """Another expression, view and look; all but the person is what the lot had drawn."""
    _, first = make_sample(6, 0, scheme=scheme)
    picture, again = make_sample(7, 0, scheme=scheme, identity=first["identity"])
    lot, other = make_sample(7, 0, scheme=scheme)
    assert again["identity"] == first["identity"] != other["identity"]
    for part in ("aus", "head", "gaze", "style"):
        assert again[part] == other[part]
    assert (picture != lot).any()


def test_smooth_and_varied_are_the_sparse_faces_with_fewer_creases():
    rig = load_rig()

    def faces(scheme):
        return [sample_face(rig, sample_rng(3, k), 64, scheme) for k in range(60)]

    sparse, smooth, varied = faces("sparse"), faces("smooth"), faces("varied")
    for one, *others in zip(sparse, smooth, varied, strict=True):
        for other in others:
            depth = {"wrinkles": one.parameters.identity["wrinkles"]}
            identity = {**other.parameters.identity, **depth}
            assert replace(other.parameters, identity=identity) == one.parameters
            assert (other.camera, other.kinds, other.style) == (one.camera, one.kinds, one.style)
    creased = rig.motions.skin_at
    for one, other in zip(sparse[:10], smooth, strict=False):
        gone = rig.shape(one.parameters) - rig.shape(other.parameters)
        still = replace(other.parameters, aus={})
        bare = rig.shape(replace(one.parameters, aus={})) - rig.shape(still)
        assert np.abs(gone[np.setdiff1d(np.arange(len(gone)), creased)]).max() < 1e-6
        assert np.abs(bare).max() < 1e-6  # a face at rest is the same
        assert not one.parameters.aus or np.abs(gone).max() > 1e-5
    depths = np.array([sample.parameters.identity["wrinkles"] for sample in varied])
    own = np.array([sample.parameters.identity["wrinkles"] for sample in sparse])
    for share in (depths == -1).mean(), (depths == own).mean():
        assert 0.15 < share < 0.55


def test_schemes():
    rig = load_rig()
    thesis = [sample_face(rig, sample_rng(0, k), 64, "thesis").parameters.aus for k in range(3)]
    for aus in thesis:
        assert set(aus) == set(CONTROL_NAMES)
        assert set(aus.values()) <= {0.0, 1.0, 2.0, 3.0, 4.0, 5.0}
    sparse = [sample_face(rig, sample_rng(0, k), 64).parameters for k in range(60)]
    assert {len(p.aus) for p in sparse} == set(range(8))
    values = [v for p in sparse for v in p.aus.values()]
    assert min(values) >= 1
    assert max(values) > 5
    yaws = np.degrees([p.head[0] for p in sparse])
    assert yaws.min() < -25
    assert yaws.max() > 25
