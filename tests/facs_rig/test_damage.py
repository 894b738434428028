"""A damaged head.npz is one sentence, and never another face."""

from __future__ import annotations

import errno
import io
import zipfile

import numpy as np
import pytest

from facs_rig import rig as module
from facs_rig.common.errors import InputError
from facs_rig.rig import ASSET, load_rig

WHOLE = ASSET.read_bytes()


@pytest.fixture
def arrays_of(monkeypatch, tmp_path):
    """A function: the arrays of a file of these bytes, as `load_rig` would take them. A rig misses
    those of `names` that are not there."""

    def read(content: bytes, names=()):
        monkeypatch.setattr(
            module, "FaceRig", lambda arrays: {n: arrays[n] for n in names or arrays}
        )
        path = tmp_path / "head.npz"
        path.write_bytes(content)
        return load_rig.__wrapped__(path)

    return read


SMALL = 20_000  # bytes of an array


@pytest.fixture(scope="module")
def small() -> bytes:
    """The file without its large arrays, which take long to unpack and are packed like the rest."""
    with np.load(ASSET) as arrays:
        kept = {name: array for name, array in arrays.items() if array.nbytes < SMALL}
    assert len(kept) > 20
    out = io.BytesIO()
    np.savez_compressed(out, **kept)
    return out.getvalue()


def places(content: bytes) -> list[int]:
    """Bytes of every kind: local headers, packed data, the directory, the end."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        headers = [entry.header_offset for entry in archive.infolist()[:3]]
        directory = archive.start_dir
    rng = np.random.default_rng(0)
    found = [header + k for header in headers for k in range(0, 40, 4)]
    found += [directory + k for k in range(0, 60, 3)]
    found += range(len(content) - 22, len(content))
    return sorted({*found, *rng.integers(0, len(content), 60).tolist()})


def flipped(content: bytes, place: int) -> bytes:
    out = bytearray(content)
    out[place] ^= 1 << place % 8
    return bytes(out)


def test_a_flipped_bit_is_told_or_harmless(arrays_of, small):
    whole = {name: array.tobytes() for name, array in arrays_of(small).items()}
    told = 0
    for place in places(small):
        try:
            found = arrays_of(flipped(small, place), whole)
        except InputError as error:
            assert "head.npz' is damaged; install again" in str(error)
            told += 1
        else:  # a date, or an attribute that nobody reads
            assert {name: array.tobytes() for name, array in found.items()} == whole, place
    assert told > len(places(small)) / 2


@pytest.mark.parametrize("share", [0.1, 0.9])
def test_a_flipped_bit_of_what_ships_is_told(arrays_of, share):
    with pytest.raises(InputError, match="is damaged"):
        arrays_of(flipped(WHOLE, round(share * len(WHOLE))))


@pytest.mark.parametrize("size", [0, 1, 22, 1000, len(WHOLE) // 2, len(WHOLE) - 1])
def test_a_file_that_breaks_off_is_told(arrays_of, size):
    with pytest.raises(InputError, match="is damaged"):
        arrays_of(WHOLE[:size])


@pytest.mark.parametrize(
    "text", ["__import__('os').system('touch hacked')", "smile+", "grin", "9**9**9", "smile.real"]
)
def test_forged_expressions_are_refused_and_not_run(tmp_path, monkeypatch, text):
    monkeypatch.chdir(tmp_path)
    with np.load(ASSET) as arrays:
        content = dict(arrays)
    texts = content["key_expressions"].astype(object)
    texts[-1] = text
    content["key_expressions"] = texts.astype(str)
    np.savez(tmp_path / "head.npz", **content)
    with pytest.raises(InputError, match="is damaged; install again") as told:
        load_rig.__wrapped__(tmp_path / "head.npz")
    assert str(told.value.__cause__).startswith("key '")
    assert not (tmp_path / "hacked").exists()


def test_pickles_are_refused(tmp_path):
    np.savez(tmp_path / "head.npz", base=np.array([{}], dtype=object))
    with pytest.raises(InputError, match="is damaged"):
        load_rig.__wrapped__(tmp_path / "head.npz")


def test_a_computer_at_its_limits_is_not_a_damaged_file(monkeypatch):
    def refuse(*_, **__):
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(module.np, "load", refuse)
    with pytest.raises(OSError, match="Too many open files"):
        load_rig.__wrapped__(ASSET)
