"""What the tests of the rig share."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest

from facs_rig import load_rig

# The tests are collected with importlib and are no package: load the helper by its path.
_spec = importlib.util.spec_from_file_location("rig_sanity", Path(__file__).with_name("sanity.py"))
_module = importlib.util.module_from_spec(_spec)
sys.modules["rig_sanity"] = _module
_spec.loader.exec_module(_module)


@pytest.fixture(scope="session")
def sanity():
    """The module that measures how sane a posed face is."""
    return _module


@pytest.fixture(scope="session")
def rig():
    return load_rig()


@pytest.fixture(scope="session")
def surface(sanity, rig):
    return sanity.Surface(rig)
