"""In CI nothing is skipped in silence."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from .no_skips import SWITCH

ROOT = Path(__file__).resolve().parents[1]
SKIPS = {
    "by a mark": "@pytest.mark.skipif(True, reason='no Blender')\ndef test_it(): pass",
    "in the test": "def test_it(): pytest.skip('no Blender')",
    "in a fixture": "@pytest.fixture\ndef it(): pytest.skip('no Blender')\ndef test_it(it): pass",
    "the file": "pytest.skip('no Blender', allow_module_level=True)",
    "an import": "pytest.importorskip('nobodys', reason='no Blender')",
}


def run(path: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    kept = {k: v for k, v in os.environ.items() if k != SWITCH}
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "tests.no_skips", "-c", os.devnull,
         "-p", "no:cacheprovider", str(path)],
        env=kept | {"PYTHONPATH": str(ROOT)} | environment, cwd=path,
        capture_output=True, text=True, check=False,
    )  # fmt: skip


def test_what_is_skipped_has_failed_where_everything_can_be_installed(tmp_path):
    for name, text in SKIPS.items():
        (tmp_path / f"test_{name.replace(' ', '_')}.py").write_text(f"import pytest\n{text}\n")
    (tmp_path / "test_expected.py").write_text(
        "import pytest\n@pytest.mark.xfail\ndef test_it(): assert False\n"
    )
    elsewhere = run(tmp_path)
    assert elsewhere.returncode == 0
    assert f"{len(SKIPS)} skipped, 1 xfailed in" in elsewhere.stdout
    said = run(tmp_path, **{SWITCH: "1"}, PYTEST_ADDOPTS="--continue-on-collection-errors")
    assert said.returncode == 1
    assert said.stdout.count(f"no Blender: nothing may be skipped here ({SWITCH})") >= len(SKIPS)
    assert "skipped" not in said.stdout.splitlines()[-1] and "1 xfailed" in said.stdout
