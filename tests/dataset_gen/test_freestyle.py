"""Blender's Freestyle as an engine: the same lines in the same places, and what hides them."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from facs_rig.common.errors import InputError

with warnings.catch_warnings():
    # bpy's own start-up scripts are not ours to mend.
    warnings.simplefilter("ignore")
    bpy = pytest.importorskip("bpy", reason="Blender as a module is missing: pip install bpy")

from dataset_gen import generate as generate_module  # noqa: E402
from dataset_gen.freestyle import DRAWN, KINDS, freestyle_strokes  # noqa: E402
from dataset_gen.freestyle_view_map import Nature, blender, view_map  # noqa: E402
from dataset_gen.generate import generate, make_sample, read_shards  # noqa: E402
from dataset_gen.linework.lines import draw_strokes  # noqa: E402
from facs_rig import Camera, FaceParameters, load_rig  # noqa: E402
from tests.nightly import at_night  # noqa: E402

BATCH = Path(generate_module.__file__).with_name("blender_batch.py")
POSES = {
    "rest": FaceParameters(),
    "smile": FaceParameters({"smile": 5.0}),
    "frontalis": FaceParameters({"frontalis": 5.0}),
    "three-quarter": FaceParameters({"frontalis": 4.0}, head=(0.6, 0.1, -0.1)),
    "old man": FaceParameters(
        {"brow_furrow": 4.0}, {"age": 1.0, "gender": 1.0, "wrinkles": 0.8}, head=(-0.3, 0.15, 0.0)
    ),
}
CAMERAS = {
    "orthographic": lambda points: Camera.framing(points, 256, 256, 0.06),
    "perspective": lambda points: Camera.framing(points, 256, 256, 0.06, distance=0.9),
    "oblong": lambda points: Camera.framing(points, 256, 256, 0.06).cropped(
        20, 10, 230, 250, 182, 400
    ),
}


@pytest.fixture(scope="module")
def rig():
    return load_rig()


def dense(strokes, kind, step=0.25):
    """(k, 2) places along all strokes of a kind, at most `step` pixels apart."""
    found = [np.zeros((0, 2))]
    for stroke in strokes:
        if stroke.kind == kind:
            along = np.append(0, np.cumsum(np.hypot(*np.diff(stroke.points, axis=0).T)))
            places = np.linspace(0, along[-1], max(2, int(along[-1] / step)))
            found.append(
                np.stack([np.interp(places, along, stroke.points[:, k]) for k in (0, 1)], axis=1)
            )
    return np.concatenate(found)


def sphere(radius=0.1, rows=48, columns=96):
    """A closed sphere about the origin: vertices (n, 3) and triangles (t, 3), outside out."""
    polar = np.linspace(0, np.pi, rows + 1)[1:-1]
    around = np.arange(columns) * 2 * np.pi / columns
    ring = np.stack([np.cos(around), np.zeros(columns), -np.sin(around)], axis=1)
    points = np.sin(polar)[:, None, None] * ring + np.cos(polar)[:, None, None] * [0, 1, 0]
    points = np.concatenate([[[0, 1, 0]], points.reshape(-1, 3), [[0, -1, 0]]]) * radius
    corners = []
    for row in range(rows):
        for k in range(columns):
            a, b = k, (k + 1) % columns
            above, below = 1 + (row - 1) * columns, 1 + row * columns
            if row == 0:
                corners.append((0, below + a, below + b))
            elif row == rows - 1:
                corners.append((above + a, len(points) - 1, above + b))
            else:
                corners += [(above + a, below + a, below + b), (above + a, below + b, above + b)]
    return points, np.array(corners)


def plate(z, half=0.15):
    """A square that faces the camera at depth z, of two triangles."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
    return np.column_stack([corners, np.full(4, z)]), np.array([[0, 1, 2], [0, 2, 3]])


# --- the view map ---------------------------------------------------------------------------------


@pytest.mark.parametrize("distance", [np.inf, 0.4])
def test_outline_of_a_sphere_is_the_circle_that_geometry_says(distance):
    points, triangles = sphere()
    camera = Camera(256, 256, (800.0, 800.0), (120.0, 130.0), distance)
    found = view_map(points, triangles, camera)
    outline = found.start[found.nature & Nature.SILHOUETTE > 0]
    assert len(outline) > 60
    # the tangent cone from the eye touches the sphere in a circle nearer to the eye
    height = 0.0 if np.isinf(distance) else 0.1**2 / distance
    np.testing.assert_allclose(outline[:, 2], height, atol=0.002)
    off = np.hypot(outline[:, 0], outline[:, 1]) - np.sqrt(0.1**2 - height**2)
    assert np.abs(off).max() < 0.0005
    radius = np.hypot(*(camera.project(outline) - camera.centre).T)
    sine = 0.0 if np.isinf(distance) else 0.1 / distance
    np.testing.assert_allclose(radius, 80 / np.sqrt(1 - sine**2), atol=0.5)
    assert (found.hidden[found.nature & Nature.SILHOUETTE > 0] == 0).mean() > 0.95


@pytest.mark.parametrize(("z", "hidden"), [(0.2, True), (-0.2, False)])
def test_what_stands_before_a_sphere_hides_it(z, hidden):
    points, triangles = sphere()
    front, corners = plate(z)
    camera = Camera(256, 256, (800.0, 800.0), (128.0, 128.0))
    both = np.concatenate([points, front]), np.concatenate([triangles, corners + len(points)])
    for found in (
        view_map(*both, camera),
        view_map(points, triangles, camera, shells=[(front, corners)]),
    ):
        outline = found.nature & Nature.SILHOUETTE > 0
        assert ((found.hidden[outline] > 0) == hidden).mean() > 0.95


def test_a_shell_draws_no_lines_and_a_plate_has_its_rim():
    camera = Camera(256, 256, (800.0, 800.0), (128.0, 128.0))
    rim = view_map(*plate(0.0), camera)
    assert (rim.nature & Nature.BORDER > 0).all()
    assert len(rim.start) >= 4
    np.testing.assert_allclose(np.abs(rim.start[:, :2]).max(axis=1), 0.15, atol=1e-5)
    points, triangles = sphere()
    found = view_map(points, triangles, camera, shells=[plate(-0.2)])
    assert not (found.nature & Nature.BORDER).any()


# --- the face -------------------------------------------------------------------------------------


# Every pose and every camera in each run, every pair of them at night.
VIEWS = [
    (pose, view) if k % len(CAMERAS) == m else at_night(pose, view)
    for k, pose in enumerate(POSES)
    for m, view in enumerate(CAMERAS)
]


@pytest.mark.slow
@pytest.mark.parametrize(("pose", "view"), VIEWS)
def test_both_engines_put_the_outlines_in_the_same_place(rig, pose, view):
    vertices = rig.pose(POSES[pose])
    camera = CAMERAS[view](vertices)
    mine = dense(draw_strokes(rig, vertices, camera, 1, ()), "contour")
    theirs = dense(freestyle_strokes(rig, vertices, camera, 1, ()), "contour")
    there = cKDTree(mine).query(theirs)[0]
    back = cKDTree(theirs).query(mine)[0]
    print(pose, view, there.mean(), back.mean(), np.percentile([*there, *back], 95))
    # the pixels of a 256 x 256 picture; places along the lines are a quarter of one apart
    assert there.mean() < 0.2
    assert back.mean() < 0.2
    assert np.percentile([*there, *back], 99) < 3


def test_strokes_are_those_that_the_other_engine_gives(rig):
    vertices = rig.pose(POSES["three-quarter"])
    camera = CAMERAS["perspective"](vertices)
    layers = ("brow", "iris", "lip", "hair_bob")
    theirs = freestyle_strokes(rig, vertices, camera, 2, layers)
    mine = draw_strokes(rig, vertices, camera, 2, layers)
    for layer in layers:
        one, two = ([s for s in strokes if s.kind == layer] for strokes in (mine, theirs))
        assert len(one) == len(two)
        for a, b in zip(one, two, strict=True):
            np.testing.assert_array_equal(a.points, b.points)
    assert {s.kind for s in theirs} == {"contour", "suggestive", *layers}
    for stroke in theirs:
        k = len(stroke.points)
        assert k >= 2
        assert stroke.points.shape == (k, 2)
        assert stroke.strength.shape == (k,)
        assert ((stroke.strength >= 0) & (stroke.strength <= 1)).all()
        assert ((stroke.points >= 0) & (stroke.points <= 256)).all()


def test_the_surface_under_a_stroke_is_where_it_is_drawn(rig):
    vertices = rig.pose(POSES["smile"])
    camera = CAMERAS["orthographic"](vertices)
    for stroke in freestyle_strokes(rig, vertices, camera, 1, ()):
        triangle, weight = stroke.surface
        np.testing.assert_allclose(weight.sum(axis=1), 1, atol=1e-9)
        place = np.einsum("kc,kcd->kd", weight, vertices[rig.triangles[triangle]])
        off = np.hypot(*(camera.project(place) - stroke.points).T)
        # quads that are cut the other way, and points that were averaged
        assert np.median(off) < 0.1
        assert off.max() < 0.7


def test_more_detail_draws_more(rig):
    vertices = rig.pose(POSES["smile"])
    camera = CAMERAS["orthographic"](vertices)
    length = [
        len(dense(freestyle_strokes(rig, vertices, camera, detail, ()), "suggestive"))
        for detail in (0, 1, 2)
    ]
    assert length[0] < length[1] < length[2]


@pytest.mark.slow
@pytest.mark.parametrize("pose", POSES)
def test_suggestive_contours_lie_near_those_of_the_other_engine(rig, pose):
    vertices = rig.pose(POSES[pose])
    camera = CAMERAS["orthographic"](vertices)
    mine = dense(draw_strokes(rig, vertices, camera, 1, ()), "suggestive")
    theirs = dense(freestyle_strokes(rig, vertices, camera, 1, ()), "suggestive")
    # a pixel is more than a millimetre here; without the longer diagonals 0.80 of a forehead
    share = (cKDTree(mine).query(theirs)[0] < 1).mean(), (cKDTree(theirs).query(mine)[0] < 1).mean()
    print(pose, share)
    assert min(share) > 0.85


def test_hair_hides_the_outline_behind_it(rig):
    vertices = rig.pose(POSES["rest"])
    camera = CAMERAS["orthographic"](vertices)
    bald, haired = (
        len(dense(freestyle_strokes(rig, vertices, camera, 0, layers), "contour"))
        for layers in ((), ("hair_long",))
    )
    assert haired < 0.7 * bald


def test_valleys_and_the_rim_are_drawn_when_they_are_asked_for(rig):
    vertices = rig.pose(POSES["old man"])
    camera = CAMERAS["orthographic"](vertices)
    strokes = freestyle_strokes(rig, vertices, camera, 2, (), KINDS)
    assert {s.kind for s in strokes} >= {"contour", "suggestive", "valley", "boundary"}
    neck = [s for s in strokes if s.kind == "boundary"]
    assert all((s.points[:, 1] > 128).all() for s in neck)


def test_the_same_face_gives_the_same_strokes_and_leaves_nothing_behind(rig):
    vertices = rig.pose(POSES["smile"])
    camera = CAMERAS["orthographic"](vertices)
    kinds = ("scenes", "objects", "meshes", "cameras", "texts", "linestyles", "materials")
    before = {kind: sorted(b.name for b in getattr(bpy.data, kind)) for kind in kinds}
    engine = bpy.context.scene.render.engine
    one = freestyle_strokes(rig, vertices, camera)
    two = freestyle_strokes(rig, vertices, camera)
    assert len(one) == len(two)
    for a, b in zip(one, two, strict=True):
        assert a.kind == b.kind
        np.testing.assert_array_equal(a.points, b.points)
        np.testing.assert_array_equal(a.strength, b.strength)
    assert before == {kind: sorted(b.name for b in getattr(bpy.data, kind)) for kind in kinds}
    assert bpy.context.scene.render.engine == engine


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="asks Linux for its memory")
def test_memory_does_not_grow_with_the_pictures(rig):
    vertices = rig.pose(POSES["smile"])
    camera = CAMERAS["orthographic"](vertices)

    def megabytes():
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGESIZE") / 1e6

    used = []
    for _ in range(10):
        freestyle_strokes(rig, vertices, camera)
        used.append(megabytes())
    print(used)
    assert used[-1] - used[3] < 20


def test_what_freestyle_has_not_is_refused(rig):
    vertices = rig.neutral()
    camera = CAMERAS["orthographic"](vertices)
    with pytest.raises(ValueError, match="Freestyle draws no 'apparent'; it has: contour"):
        freestyle_strokes(rig, vertices, camera, kinds=("apparent",))
    with pytest.raises(ValueError, match="no layer 'beard'"):
        freestyle_strokes(rig, vertices, camera, layers=("beard",))


def test_without_blender_one_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "bpy", None)
    with pytest.raises(InputError, match=r"pip install 'sketch-to-face\[blender\]'"):
        blender()


# --- data sets ------------------------------------------------------------------------------------


def test_a_sample_tells_which_blender_drew_it():
    picture, meta = make_sample(4, 0, engine="freestyle")
    assert picture.shape == (256, 256)
    assert (meta["engine"], meta["blender"]) == ("freestyle", bpy.app.version_string.split()[0])
    ours, other = make_sample(4, 0)
    assert ours.shape == picture.shape
    assert set(meta["kinds"]) <= set(DRAWN)
    same = set(other) - {"engine", "kinds"}  # the same face, camera and style
    assert {k: meta[k] for k in same} == {k: other[k] for k in same}


@pytest.mark.slow
def test_same_bytes_with_one_process_and_with_two(tmp_path, monkeypatch):
    monkeypatch.setattr(generate_module, "SHARD", 1)
    one = generate(2, tmp_path / "one", seed=3, engine="freestyle")
    two = generate(2, tmp_path / "two", seed=3, engine="freestyle", jobs=2)
    assert [p.read_bytes() for p in one] == [p.read_bytes() for p in two]
    with pytest.raises(ValueError, match="engine freestyle.*resume with the same"):
        generate(2, tmp_path / "one", seed=3, resume=True)


def run(program: list[str], *arguments: str, **more: str) -> subprocess.CompletedProcess[str]:
    kept = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
    return subprocess.run(
        [*program, str(BATCH), "--", *arguments],
        env=kept | more, capture_output=True, text=True, check=False,
    )  # fmt: skip


@pytest.mark.slow
def test_python_runs_the_batch_as_blender_does(tmp_path):
    done = run([sys.executable], "--count", "2", "--out", str(tmp_path), "--seed", "5")
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"2 samples in 1 shards in {tmp_path}\n"
    assert done.stderr == ""
    picture, meta = make_sample(5, 1, engine="freestyle")
    again, told = list(read_shards(tmp_path))[1]
    np.testing.assert_array_equal(picture, again)
    assert meta == told


@pytest.fixture(scope="module")
def program() -> list[str]:
    """An installed Blender with this Python's version, and how it runs a script."""
    found = shutil.which("blender")
    if found is None:
        pytest.skip("no installed Blender (Debian: apt install blender)")
    asked = subprocess.run(
        [found, "-b", "--factory-startup", "--python-expr",
         f"import sys; print('IS', sys.version_info[:2] == {sys.version_info[:2]})"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if "IS True" not in asked.stdout:
        pytest.skip("the installed Blender has another Python")
    return [found, "-b", "--factory-startup", "-P"]


@pytest.mark.slow
def test_installed_blender_runs_the_batch(program, tmp_path):
    packages = str(ENVIRONMENT)
    out = tmp_path / "out"
    order = ["--count", "2", "--out", str(out), "--seed", "5"]
    done = run(program, *order, PYTHONPATH=packages)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"2 samples in 1 shards in {out}" in done.stdout
    told = [meta for _, meta in read_shards(out)]
    assert [(m["engine"], m["index"]) for m in told] == [("freestyle", 0), ("freestyle", 1)]
    assert told[0]["landmarks"] == make_sample(5, 0)[1]["landmarks"]
    bytes_before = (out / "shard-000000.tar").read_bytes()

    again = run(program, *order, PYTHONPATH=packages)
    assert again.returncode == 2
    assert "already holds shards" in again.stderr
    resumed = run(program, *order, "--resume", PYTHONPATH=packages)
    assert resumed.returncode == 0
    assert (out / "shard-000000.tar").read_bytes() == bytes_before


@pytest.mark.nightly  # those of a batch that is stopped are Blenders, too
@pytest.mark.slow
def test_workers_of_an_installed_blender_are_blenders(program, tmp_path):
    packages = str(ENVIRONMENT)
    done = run(program, "--count", "251", "--out", str(tmp_path), "--engine", "contours",
               "--jobs", "2", PYTHONPATH=packages)  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert len(list(tmp_path.glob("shard-*.tar"))) == 2


@pytest.fixture
def bare_copy(tmp_path) -> Path:
    """The batch entry in a copy of this repository, beside which no environment lies."""
    copy = tmp_path / "a copy"
    for package in ("dataset_gen", "facs_rig"):
        shutil.copytree(
            BATCH.parents[1] / package, copy / package, ignore=shutil.ignore_patterns("__pycache__")
        )
    return copy / "dataset_gen" / BATCH.name


@pytest.mark.slow
def test_installed_blender_says_which_packages_are_missing(program, bare_copy, tmp_path):
    """However it was installed: with numpy and more, with numpy alone, without any."""
    kept = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
    kept |= {"PATH": "/usr/bin:/bin", "PWD": str(tmp_path)}  # Blender goes by PWD

    def blender(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [*program[:-1], *arguments], env=kept, cwd=tmp_path,
            capture_output=True, text=True, check=False,
        )  # fmt: skip

    asks = (
        "import importlib.util as u; print('HAS', *filter(u.find_spec, ('numpy', 'scipy', 'PIL')))"
    )
    said = blender("--python-expr", asks).stdout
    (line,) = [line for line in said.splitlines() if line.startswith("HAS")]
    wanted = {"numpy": "numpy", "scipy": "scipy", "PIL": "pillow"}
    lacks = [package for module, package in wanted.items() if module not in line.split()]

    script = os.path.relpath(bare_copy, tmp_path)
    done = blender("-P", script, "--", "--count", "1", "--out", "out", "--seed", "5")
    if not lacks:
        assert done.returncode == 0, done.stdout + done.stderr
        assert len(list(read_shards(tmp_path / "out"))) == 1
        return
    assert done.returncode == 2
    assert f"does not find {', '.join(lacks)};" in done.stderr
    assert "PYTHONPATH=DIR" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()


def packages_there(folder: Path, **modules: str) -> Path:
    """A folder of packages, each with this text, as somebody may have installed them."""
    for name, text in modules.items():
        place = folder.joinpath(*name.split("_of_")[::-1])
        place.mkdir(parents=True)
        (place / "__init__.py").write_text(text)
    return folder


OLD_NUMPY = "__version__ = '1.24.2'"  # without numpy.exceptions, which scipy of today asks for
ENVIRONMENT = Path(np.__file__).parents[1]  # what these tests run with, which goes together


@pytest.mark.slow
def test_blenders_own_numpy_may_be_too_old_for_the_environments_scipy(program, tmp_path):
    """As Debian's is: then numpy comes from the environment, too."""
    own = packages_there(tmp_path / "own", numpy=OLD_NUMPY)
    done = run(program, "--count", "1", "--out", str(tmp_path / "out"), "--seed", "5",
               PYTHONPATH=str(own), VIRTUAL_ENV=str(ENVIRONMENT.parents[2]))  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert len(list(read_shards(tmp_path / "out"))) == 1


def find_packages(own: Path, **environment: str) -> list[str]:
    """What a Python with only `own` says, and the numpy that it has then."""
    code = (
        f"import runpy, sys; sys.path.insert(0, {str(own)!r})\n"
        f"print(runpy.run_path({str(BATCH)!r})['find_packages']())\n"
        "print(getattr(sys.modules.get('numpy'), '__file__', None))"
    )
    kept = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-c", code], capture_output=True, text=True, check=True,
        env=kept | {"PATH": "/usr/bin:/bin"} | environment,
    )  # fmt: skip
    return done.stdout.splitlines()


def test_packages_that_go_together_come_before_a_lone_numpy(tmp_path):
    own = packages_there(tmp_path / "own", numpy=OLD_NUMPY)
    said, numpy = find_packages(own, PYTHONPATH=str(ENVIRONMENT))
    assert said == "None"
    assert Path(numpy).is_relative_to(ENVIRONMENT)


def test_packages_of_another_python_are_passed_over(tmp_path):
    foreign = packages_there(
        tmp_path / "foreign", numpy="raise ImportError('of another Python')", scipy="", PIL=""
    )
    (foreign / "numpy" / "core").mkdir()
    (foreign / "numpy" / "core" / "_multiarray_umath.cpython-36m-x86_64-linux-gnu.so").touch()
    environment = str(ENVIRONMENT.parents[2])
    said, numpy = find_packages(tmp_path, PYTHONPATH=str(foreign), VIRTUAL_ENV=environment)
    assert said == "None"
    assert Path(numpy).is_relative_to(ENVIRONMENT)


def test_packages_that_do_not_go_together_are_one_sentence(tmp_path, bare_copy, monkeypatch):
    own = packages_there(
        tmp_path / "own",
        numpy=OLD_NUMPY,
        scipy="",
        sparse_of_scipy="from numpy.exceptions import AxisError",
        PIL="",
        Image_of_PIL="",
        ImageDraw_of_PIL="",
    )
    monkeypatch.setattr(sys.modules[__name__], "BATCH", bare_copy)
    said, _ = find_packages(own)
    assert "cannot use the scipy that it finds (No module named 'numpy.exceptions')" in said
    assert "pip install --target DIR numpy scipy pillow) and set PYTHONPATH=DIR" in said


@pytest.mark.slow
@pytest.mark.parametrize("engine", [at_night("contours"), "freestyle"])
def test_a_stopped_batch_leaves_nothing_half_made(program, tmp_path, engine):
    kept = {k: v for k, v in os.environ.items() if k != "VIRTUAL_ENV"}
    out = tmp_path / "out"
    batch = subprocess.Popen(
        [*program, str(BATCH), "--", "--count", "2000", "--out", str(out), "--engine", engine,
         "--jobs", "2"],
        env=kept | {"PYTHONPATH": str(ENVIRONMENT)}, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    while len(list(out.glob(".sketch2face-*.part/*"))) < 2:
        assert batch.poll() is None
        time.sleep(0.05)
    batch.send_signal(signal.SIGTERM)
    assert "go on with --resume" in batch.communicate(timeout=600)[1]
    assert batch.returncode == 130
    assert not list(out.glob(".*"))


def test_an_older_python_is_one_sentence(capsys, monkeypatch, tmp_path):
    """As blender.org's 3.4 brings it."""
    from dataset_gen import blender_batch

    monkeypatch.setattr(blender_batch, "OLDEST", (9, 1))
    assert blender_batch.main(["--count", "1", "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert "and 9.1 or newer is needed; use Blender 4.1 or newer" in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()
