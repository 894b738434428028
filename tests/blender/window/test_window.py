"""The add-on in the real window of an installed Blender, under a virtual display."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
DRIVE = Path(__file__).with_name("drive.py")
# Environment: where a screenshot for the documentation goes, and of which sketch.
PICTURE, SKETCH = "SKETCH_TO_FACE_PICTURE", "SKETCH_TO_FACE_SKETCH"


@pytest.fixture(scope="module")
def blender() -> str:
    """The installed Blender, if it can run our wheels."""
    program = shutil.which("blender")
    if program is None:
        pytest.skip("no installed Blender (Debian: apt install blender)")
    asked = subprocess.run(
        [program, "-b", "--factory-startup", "--python-expr",
         "import sys; print('PYTHON', *sys.version_info[:2])"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    own = f"PYTHON {sys.version_info[0]} {sys.version_info[1]}"
    if own not in asked.stdout:
        pytest.skip("the installed Blender has another Python than this one")
    return program


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    """A virtual screen of its own."""
    server = shutil.which("Xvfb")
    if server is None:
        pytest.skip("no Xvfb for a window (Debian: apt install xvfb)")
    reading, writing = os.pipe()
    process = subprocess.Popen(
        [server, "-displayfd", str(writing), "-screen", "0", "1400x900x24", "-nolisten", "tcp"],
        pass_fds=[writing],
        stderr=subprocess.DEVNULL,
    )
    os.close(writing)
    try:
        with os.fdopen(reading) as pipe:
            number = pipe.readline().strip()
        if not number:
            pytest.skip("Xvfb does not start here")
        yield f":{number}"
    finally:
        process.terminate()
        process.wait()


def run(blender: str, display: str, home: Path, arguments: list[str], **more: str):
    """Blender with a profile of its own, software OpenGL and our Python path."""
    environment = os.environ | {
        "DISPLAY": display,
        "HOME": str(home),
        "BLENDER_USER_CONFIG": str(home / "config"),
        "BLENDER_USER_SCRIPTS": str(home / "scripts"),
        "LIBGL_ALWAYS_SOFTWARE": "1",
        "PYTHONPATH": os.pathsep.join([str(ROOT), sysconfig.get_paths()["purelib"]]),
        **more,
    }
    environment.pop("WAYLAND_DISPLAY", None)
    return subprocess.run(
        [blender, "--factory-startup", "--python-use-system-env", "--enable-event-simulate",
         "--window-geometry", "0", "0", "1400", "900", "--python-exit-code", "1", *arguments],
        env=environment, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip


@pytest.mark.slow
def test_sketch_becomes_a_face_in_a_real_window(blender, display, tmp_path):
    addons = tmp_path / "scripts" / "addons"
    addons.mkdir(parents=True)
    (addons / "sketch_to_face").symlink_to(ROOT / "addon" / "blender")
    sketch = Path(os.environ.get(SKETCH, ROOT / "addon" / "sketches" / "smiling_woman.png"))
    arguments = ["-P", str(DRIVE), "--", "--sketch", str(sketch), "--out", str(tmp_path)]
    if os.environ.get(PICTURE):
        arguments += ["--picture", str(Path(os.environ[PICTURE]).resolve())]
    done = run(blender, display, tmp_path, arguments)
    assert done.returncode == 0, done.stdout + done.stderr
    result = json.loads((tmp_path / "result.json").read_text())
    print(json.dumps(result))
    assert len(result["keys"]) == 1 + 47 + 1
    assert result["values"]["Fitted"] == 1.0
    assert result["slider_moves_m"] > 0.003
    for picture in ("1_tab", "2_face", "3_slider", "4_undone"):
        assert (tmp_path / f"{picture}.png").stat().st_size > 20_000
