"""Data sets: what is in them, and that the same seed gives the same bytes."""

import io
import json
import tarfile

import numpy as np
import pytest
from PIL import Image

from dataset_gen import generate as module
from dataset_gen.generate import generate, make_sample, read_shards
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
    assert np.median(pixels) == 255
    assert pixels.min() < 60
    assert set(meta["aus"]) == set(CONTROL_NAMES)
    assert set(meta["landmarks"]) == set(LANDMARKS)
    for key in ("identity", "head", "camera", "style"):
        assert isinstance(meta[key], dict)
    assert (meta["seed"], meta["index"], meta["engine"]) == (5, 2, "contours")
    assert meta["detail"] in (0, 1, 2)


def test_the_parameters_make_the_landmarks_again(tmp_path):
    """What is stored is enough to rebuild the face and its camera."""
    _, meta = make_sample(3, 1)
    rig = load_rig()
    camera = meta["camera"]
    again = Camera(
        camera["width"], camera["height"], tuple(camera["scale"]), tuple(camera["centre"]),
        camera["distance"] or np.inf,
    )  # fmt: skip
    posed = rig.pose(FaceParameters.from_json(meta))
    pixels = again.project(posed[rig.landmarks])
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
    assert sorted(p.name for p in (tmp_path / "three").iterdir()) == [p.name for p in three]


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
