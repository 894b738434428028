"""The face and the add-on in an installed Blender, in its real window on a virtual display."""

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
import trimesh
from PIL import Image

from facs_rig import load_rig
from facs_rig.identity import IDENTITY_KEYS

ROOT = Path(__file__).resolve().parents[3]
PARITY = Path(__file__).parents[1] / "parity.py"
# Environment: where screenshots for the documentation go (of the sketch's face, of an added one; a
# folder for those of every step), and of which sketch.
PICTURE, FACE_PICTURE = "SKETCH_TO_FACE_PICTURE", "SKETCH_TO_FACE_ADDED_PICTURE"
FOLDER, SKETCH = "SKETCH_TO_FACE_PICTURES", "SKETCH_TO_FACE_SKETCH"
# Of the window, pixels; and how much smaller it is where no pictures are kept: the processor draws.
WINDOW, SMALL = (1400, 900), 0.65
SMILING = ROOT / "addon" / "sketches" / "smiling_woman.png"


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


def run(blender: str, display: str, home: Path, size: tuple, arguments: list[str]):
    """Blender with a profile of its own, software OpenGL and our Python path."""
    environment = os.environ | {
        "DISPLAY": display,
        "HOME": str(home),
        "BLENDER_USER_CONFIG": str(home / "config"),
        "BLENDER_USER_SCRIPTS": str(home / "scripts"),
        "LIBGL_ALWAYS_SOFTWARE": "1",
        "PYTHONPATH": os.pathsep.join([str(ROOT), sysconfig.get_paths()["purelib"]]),
    }
    environment.pop("WAYLAND_DISPLAY", None)
    return subprocess.run(
        [blender, "--factory-startup", "--python-use-system-env", "--enable-event-simulate",
         "--window-geometry", "0", "0", *map(str, size), "--python-exit-code", "1", *arguments],
        env=environment, capture_output=True, text=True, timeout=420, check=False,
    )  # fmt: skip


@pytest.fixture
def session(blender, display, tmp_path):
    """Function: run a script in the window with the add-on installed; what it wrote."""
    addons = tmp_path / "scripts" / "addons"
    addons.mkdir(parents=True)
    (addons / "sketch_to_face").symlink_to(ROOT / "addon" / "blender")

    def play(script: str, picture: str, *arguments: str) -> dict:
        more = ["--out", str(tmp_path), *arguments]
        scale = 1.0 if any(map(os.environ.get, (picture, FOLDER))) else SMALL
        more += ["--scale", str(scale)]
        if os.environ.get(picture):
            more += ["--picture", str(Path(os.environ[picture]).resolve())]
        size = tuple(round(scale * side) for side in WINDOW)
        script_path = str(Path(__file__).with_name(script))
        done = run(blender, display, tmp_path, size, ["-P", script_path, "--", *more])
        assert done.returncode == 0, done.stdout + done.stderr
        result = json.loads((tmp_path / "result.json").read_text())
        print(json.dumps(result))
        return result

    return play


@pytest.mark.slow
def test_installed_blender_poses_the_face_as_numpy_does(blender, tmp_path):
    result = tmp_path / "result.json"
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join([str(ROOT), sysconfig.get_paths()["purelib"]])
    }
    done = subprocess.run(
        [blender, "-b", "--factory-startup", "--python-use-system-env", "--python-exit-code", "1",
         "-P", str(PARITY), "--", str(result)],
        env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    told = json.loads(result.read_text())
    print(told)
    assert told["python"] == told["invalid"] == []
    assert all(metres < 1e-5 for metres in told["off_m"].values()), told


def pictures(folder: Path, *names: str) -> None:
    """Check the screenshots of a session, and keep them where the documentation wants them."""
    for name in names:
        picture = folder / f"{name}.png"
        assert picture.stat().st_size > 20_000
        if os.environ.get(FOLDER):
            kept = Path(os.environ[FOLDER]) / f"{name.partition('_')[2]}.png"
            # A third of the size. Without k-means a pin of a few pixels loses its green.
            few = (
                Image.open(picture)
                .convert("RGB")
                .quantize(256, Image.Quantize.MEDIANCUT, kmeans=2, dither=Image.Dither.NONE)
            )
            few.save(kept, optimize=True)


@pytest.mark.slow
def test_sketch_becomes_a_face_in_a_real_window(session, tmp_path):
    sketch = Path(os.environ.get(SKETCH, SMILING))
    result = session("drive.py", PICTURE, "--sketch", str(sketch))
    # What goes with the drawn actions, squint and smile, is beside what stays at rest.
    fitted = ["Fitted", "Fitted_upper", "Fitted_lower"]
    assert result["keys"][1:] == [*(key.name for key in load_rig().keys), *fitted]
    assert result["values"]["Fitted"] == 1.0
    assert result["slider_moves_m"] > 0.001
    pictures(tmp_path, "1_tab", "2_sketch", "3_face", "4_slider", "5_undone", "6_reloaded")
    ours = trimesh.load(tmp_path / "ours.glb", process=False)
    vertices = {name: len(mesh.vertices) for name, mesh in ours.geometry.items()}
    assert vertices.pop("hair") > 1000
    assert sum(vertices.values()) == len(load_rig().texture.points)
    assert result["exported"]["blenders.glb"] > 1_000_000


@pytest.mark.slow
def test_what_was_read_is_corrected_pinned_and_live_in_a_real_window(session, tmp_path):
    result = session("drive_iterate.py", "", "--sketch", str(SMILING))
    assert result["pin_off_mm"] < 2 and result["live_moves_m"] > 0.001
    pictures(tmp_path, "1_evidence", "2_rejected", "3_pins", "4_overlay", "5_pencil", "6_live")


@pytest.mark.slow
def test_hair_is_combed_and_swapped_in_a_real_window(session, tmp_path):
    result = session("drive_hair.py", "", "--sketch", str(SMILING))
    assert result["length"] > 1.05 and result["volume"] > 1.05
    pictures(tmp_path, "1_result", "2_length", "3_volume", "4_german", "5_added")


@pytest.mark.slow
def test_face_is_added_from_the_menu_of_a_real_window(session, tmp_path):
    result = session("drive_face.py", FACE_PICTURE)
    assert result["active"] == "FACS Face"
    names = [*(key.name for key in load_rig().keys), *IDENTITY_KEYS]
    assert result["keys"] == ["Basis", *names]
    assert json.loads(result["clipboard"])["aus"] == {
        "frontalis": pytest.approx(result["frontalis"], abs=1e-6)
    }
    for picture in ("1_no_face", "2_face", "3_slider"):
        assert (tmp_path / f"{picture}.png").stat().st_size > 20_000


@pytest.mark.slow
def test_storyboard_runs_and_stops_in_a_real_window(session, tmp_path):
    folder = tmp_path / "drawn"
    folder.mkdir()
    for k in range(6):
        shutil.copy(SMILING, folder / f"{k}.png")
    result = session("drive_storyboard.py", PICTURE, "--sketch", str(folder))
    assert result["frames"] == [1.0 + 10 * k for k in range(6)]
    assert 0 < len(result["stopped"]) < 6
