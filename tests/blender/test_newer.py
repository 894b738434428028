"""The shell's own tests once more, in Blender 5.2 and its Python 3.13."""

from __future__ import annotations

import os
import subprocess

import pytest

from tests.nightly import at_night

from .conftest import ROOT
from .newer_blender import Missing, blender_5_2_with_the_core

# What touches Blender most: properties, undo, timers, shape keys, switching off. Sketches of every
# kind, Grease Pencil and live ones among them, test_packaging.py fits in 5.2 each time; faces as
# such, retargeting and the zips have tests of their own that take as long again.
OFTEN = ("test_shell.py", "test_tasks.py")
MORE = ("test_iterate.py", "test_reshape.py", "test_sources.py", "test_traces.py")


@pytest.mark.slow
@pytest.mark.parametrize("files", [OFTEN, at_night(MORE)], ids=["often", "more"])
def test_the_shell_works_in_blender_5_2(files):
    try:
        python = blender_5_2_with_the_core()
    except Missing as why:
        pytest.skip(str(why))
    tests = [f"tests/blender/{name}" for name in files]
    done = subprocess.run(
        [python, "-m", "pytest", "-q", "-p", "no:cacheprovider", *tests],
        env={k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "BLENDER"))},
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-20_000:] + done.stderr[-2_000:]
    assert "passed" in done.stdout and "skipped" not in done.stdout, done.stdout[-2_000:]
