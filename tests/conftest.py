"""What every test may use."""

from __future__ import annotations

import os

# Before numpy is imported anywhere: on a small machine the threads of BLAS only hinder each other.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np  # noqa: E402
import pytest  # noqa: E402
from hypothesis import settings  # noqa: E402

# Correctness never depends on the clock, so no deadline; the same examples on every run.
settings.register_profile("project", deadline=None, derandomize=True, max_examples=25)
settings.load_profile("project")


@pytest.fixture
def rng() -> np.random.Generator:
    """A generator with a fixed seed: a failing test fails again."""
    return np.random.default_rng(20240229)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files with slow tests first: beside each other, processes end together (see the Makefile)."""
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in slow)
