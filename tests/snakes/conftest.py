"""What the tests of the snakes share."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

# The tests are collected with importlib and are no package: load the helper by its path.
_spec = importlib.util.spec_from_file_location("snakes_ball", Path(__file__).with_name("ball.py"))
_module = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(_module)


@pytest.fixture(scope="session")
def scene():
    """The module of the sphere example: Ball, camera(), ellipse(), RADIUS, SIZE, SCALE."""
    return _module


@pytest.fixture(scope="session")
def ball(scene):
    return scene.Ball()
