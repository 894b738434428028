"""What runs every time, and what in the night (see docs/development.md)."""

from __future__ import annotations

from collections.abc import Sequence

import pytest


def sample(cases: Sequence, count: int) -> list:
    """Cases for `pytest.mark.parametrize`: `count` of them, spread evenly, in every run.

    The others are more of the same kind and wait for `make test-all`.
    """
    often = {round(k * (len(cases) - 1) / max(count - 1, 1)) for k in range(count)}
    return [case if k in often else at_night(case) for k, case in enumerate(cases)]


def at_night(*case: object):
    """One case for `pytest.mark.parametrize`, of `make test-all` alone."""
    return pytest.param(*case, marks=pytest.mark.nightly)
