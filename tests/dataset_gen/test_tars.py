"""Shards as anybody may have left them: what is wrong is one sentence that names the shard."""

import io
import json
import tarfile

import numpy as np
import pytest
from PIL import Image

from dataset_gen.tars import InputError, files_of, record_of, samples_of, size_of


def png() -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(np.arange(256, dtype=np.uint8).reshape(16, 16)).save(buffer, "PNG")
    return buffer.getvalue()


RECORD = json.dumps({"index": 0}).encode()


def write(path, *files):
    """A tar of (name, content), in this order."""
    with tarfile.open(path, "w") as tar:
        for name, data in files:
            info = tarfile.TarInfo(name)
            info.size = len(data)
            tar.addfile(info, io.BytesIO(data))
    return path


@pytest.fixture
def shard(tmp_path):
    files = [(f"{k:08d}.{end}", data) for k in range(3) for end, data in
             (("json", RECORD), ("png", png()))]  # fmt: skip
    return write(tmp_path / "shard-000000.tar", *files)


def test_samples_are_read_in_order(shard):
    found = list(samples_of(shard))
    assert [key for key, _ in found] == ["00000000", "00000001", "00000002"]
    assert all(parts == {"json": RECORD, "png": png()} for _, parts in found)
    assert size_of(shard, "0", found[0][1]["png"]) == (16, 16)
    assert record_of(shard, "0", RECORD) == {"index": 0}


def test_what_else_lies_in_a_shard_is_passed_over(tmp_path):
    files = ("README.txt", b"x"), ("set/a.json", RECORD), ("set/a.png", png()), ("set/a.ply", b"p")
    path = write(tmp_path / "s.tar", *files)
    with tarfile.open(path, "a") as tar:
        folder, link = tarfile.TarInfo("b.png"), tarfile.TarInfo("b.json")
        folder.type, link.type, link.linkname = tarfile.DIRTYPE, tarfile.SYMTYPE, "/etc/passwd"
        tar.addfile(folder)
        tar.addfile(link)
    assert [(key, set(parts)) for key, parts in samples_of(path)] == [
        ("set/a", {"json", "png", "ply"})
    ]


def test_a_shard_cut_anywhere_is_damaged(shard):
    """Also between two files, and where only the end's empty blocks are missing."""
    whole = shard.read_bytes()
    with tarfile.open(shard) as tar:
        last = tar.getmembers()[-1]
    end = last.offset_data + -(-last.size // 512) * 512
    for length in (0, 1, 100, 512, 700, *range(1024, end + 1, 512), end + 512):
        shard.write_bytes(whole[:length])
        with pytest.raises(
            InputError, match=r"shard-000000.tar is (damaged|cut short|empty).*anew"
        ):
            list(samples_of(shard))
    shard.write_bytes(whole)
    assert len(list(samples_of(shard))) == 3


@pytest.mark.parametrize(
    ("files", "sentence"),
    [
        ((("a.json", RECORD), ("b.json", RECORD), ("a.png", b"")), "a.json stands no a.png"),
        ((("a.json", RECORD), ("a.png", b""), ("b.png", b"")), "b.png stands no b.json"),
        ((("a.json", RECORD), ("a.png", b""), ("a.png", b"")), "a.png twice"),
    ],
)  # fmt: skip
def test_a_picture_without_its_record(tmp_path, files, sentence):
    path = write(tmp_path / "s.tar", *files)
    with pytest.raises(InputError, match=sentence) as told:
        list(samples_of(path))
    assert str(path) in str(told.value)


def test_what_is_no_tar_or_out_of_reach(tmp_path):
    (tmp_path / "s.tar").write_bytes(b"not a tar" * 1000)
    with pytest.raises(InputError, match="no tar"):
        list(files_of(tmp_path / "s.tar"))
    with pytest.raises(InputError, match="cannot be read"):
        list(files_of(tmp_path))
    with pytest.raises(InputError, match="cannot be read"):
        list(files_of(tmp_path / "none.tar"))


@pytest.mark.parametrize("data", [b"", b"{", b"[1]", b"\xff\xfe", b"null"])
def test_a_record_that_is_none(tmp_path, data):
    with pytest.raises(InputError, match=r"s.tar: 7.json is damaged"):
        record_of(tmp_path / "s.tar", "7", data)


def test_a_picture_cut_anywhere_or_with_any_bit_flipped(tmp_path):
    whole = png()
    for length in range(len(whole)):
        with pytest.raises(InputError):
            size_of(tmp_path / "s.tar", "7", whole[:length])
    for place in range(8 * len(whole)):
        data = bytearray(whole)
        data[place // 8] ^= 1 << place % 8
        with pytest.raises(InputError, match=r"s.tar: 7.png is damaged"):
            size_of(tmp_path / "s.tar", "7", bytes(data))
