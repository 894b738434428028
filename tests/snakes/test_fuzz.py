"""Whatever is on the page: no crash, no nan, and no vertex moves farther than Max Delta allows.

tests/benchmarks/fuzz_fit.py runs the same on as many pages as one likes.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from tests.nightly import at_night

_spec = importlib.util.spec_from_file_location(
    "fuzz_fit", Path(__file__).parents[1] / "benchmarks" / "fuzz_fit.py"
)
fuzz_fit = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(fuzz_fit)


# Nine kinds of page, one after the other: four of each kind in every run, two in the thesis' way.
@pytest.mark.slow
@pytest.mark.parametrize(("method", "pages"), [
    ("lines", range(36)), ("thesis", range(18)),
    at_night("lines", range(36, 90)), at_night("thesis", range(18, 27)),
], ids=str)  # fmt: skip
def test_any_page_gives_a_whole_face(method, pages):
    for seed in pages:
        fuzz_fit.check(seed, method)


def test_a_farther_vertex_would_be_noticed(monkeypatch):
    """The check can fail."""
    fits = fuzz_fit.FITS["lines"]

    def far(*arguments):
        offsets, limit = fits(*arguments)
        offsets[7] += 2 * limit
        return offsets, limit

    monkeypatch.setitem(fuzz_fit.FITS, "lines", far)
    with pytest.raises(AssertionError, match="page 0"):
        fuzz_fit.check(0, "lines")
    monkeypatch.setitem(fuzz_fit.FITS, "lines", lambda *a: (np.full_like(fits(*a)[0], np.nan), 1.0))
    with pytest.raises(AssertionError, match="page 0"):
        fuzz_fit.check(0, "lines")
