"""What every test may use."""

from __future__ import annotations

import os

# Before numpy is imported anywhere: on a small machine the threads of BLAS only hinder each other.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np  # noqa: E402
import pytest  # noqa: E402
from hypothesis import settings  # noqa: E402

from tests.no_skips import (  # noqa: E402, F401
    pytest_make_collect_report,
    pytest_runtest_makereport,
)

# Correctness never depends on the clock, so no deadline; the same examples on every run.
settings.register_profile("project", deadline=None, derandomize=True, max_examples=25)
settings.load_profile("project")


# Each takes a minute or more.
LONGEST = (
    "test_packaging.py",
    "test_window.py",
    "test_freestyle.py",
    "test_newer.py",
    "test_random_use.py",
    "test_shipped.py",
    "test_detect.py",
    "test_plausible.py",
    "test_cluster.py",
    "test_export.py",
    "test_terminal.py",
    "test_known_faces.py",
)


@pytest.fixture
def rng() -> np.random.Generator:
    """A generator with a fixed seed: a failing test fails again."""
    return np.random.default_rng(20240229)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest files first: beside each other, processes end together (see the Makefile)."""
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    longest = {name: k for k, name in enumerate(LONGEST)}
    items.sort(key=lambda item: (longest.get(item.path.name, len(longest)), item.path not in slow))
