"""A thousand short sessions of somebody who presses anything: no traceback, nothing half made.

Seeded, so that a failure comes again: the message names the seed and what was pressed. What a
fit computes is kept from press to press, for other tests press harder on that (tests/snakes).
"""

from __future__ import annotations

import random
import tempfile
import warnings
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from facs_rig import CONTROL_NAMES, IDENTITY, LANDMARKS  # noqa: E402
from facs_rig.blender_pose import armature_of, check_face, is_face  # noqa: E402

from .conftest import ROOT, SKETCH  # noqa: E402
from .sheets import image_of, lines_of, pencil_of  # noqa: E402

SESSIONS, LONGEST = 40, 8
SKETCHES = sorted((ROOT / "addon" / "sketches").glob("*.png"))
ops = bpy.ops.sketch_to_face


@pytest.fixture
def kept_fits(monkeypatch):
    """`pipeline.fit` that answers the same question only once."""
    from addon import pipeline

    fit, known = pipeline.fit, {}

    def kept(drawing, options=None, progress=None, detector=None):
        key = (drawing.image.tobytes(), repr(options))
        if key not in known:
            known[key] = fit(drawing, options, None, detector)
        return known[key]

    monkeypatch.setattr(pipeline, "fit", kept)


@lru_cache(maxsize=1)
def strokes():
    return tuple(lines_of(SKETCH))


# --- what may be pressed --------------------------------------------------------------------------


def choose(rng):
    """Another sketch: a good file, a bad one, an image, a drawing."""
    settings = bpy.context.scene.sketch_to_face
    kind = rng.choice(["good", "good", "bad", "none", "image", "pencil"])
    settings.sketch_kind = {"image": "IMAGE", "pencil": "PENCIL"}.get(kind, "FILE")
    if kind in ("good", "bad", "none"):
        settings.sketch = {"good": str(rng.choice(SKETCHES)), "bad": "//nowhere.png"}.get(kind, "")
    elif kind == "image":
        settings.sketch_image = rng.choice([None, bpy.data.images.get("Drawn") or image_of(SKETCH)])
    else:
        pen = bpy.data.objects.get("Pen") or pencil_of(strokes())
        settings.sketch_pencil = rng.choice([None, pen])


def tweak(rng):
    settings = bpy.context.scene.sketch_to_face
    settings.method = rng.choice(["lines", "lines", "shape"])
    settings.strokes = rng.choice(["ignore", "engrave", "emboss"])
    settings.tweakables.mirror = rng.random() < 0.3
    settings.place_head = rng.random() < 0.1
    settings.overlay = rng.random() < 0.5


def select(rng):
    """Any object, or none."""
    bpy.ops.object.select_all(action="DESELECT")
    choice = rng.choice([None, *bpy.context.view_layer.objects])
    bpy.context.view_layer.objects.active = choice
    if choice is not None:
        choice.select_set(True)


def slide(rng):
    """A slider, by hand."""
    for face in filter(is_face, bpy.context.scene.objects):
        face[rng.choice(CONTROL_NAMES)] = rng.uniform(0, 10)
        face.update_tag()


def person(rng):
    """A slider of the person, where there are any."""
    for face in filter(is_face, bpy.context.scene.objects):
        feature = rng.choice(IDENTITY)
        value = rng.uniform(feature.minimum, feature.maximum)
        setattr(face.sketch_to_face.identity, feature.name, value)


def listed(rng):
    """A line of the list of what was read."""
    for face in filter(is_face, bpy.context.scene.objects):
        for item in list(face.sketch_to_face.detections)[:: rng.randint(5, 20)]:
            item.intensity = rng.uniform(0, 5)
            item.locked = rng.random() < 0.5


def rename(rng):
    for face in filter(is_face, list(bpy.data.objects)):
        face.name = rng.choice(["Ännä", "a" * 60, "Face", "x.001"])


def delete(rng):
    """Everything that is selected, and what only it used."""
    bpy.ops.object.delete()
    bpy.ops.outliner.orphans_purge(do_recursive=True)


def live(rng):
    from addon.blender import live as watching

    for face in filter(is_face, list(bpy.data.objects)):
        face.sketch_to_face.live = rng.random() < 0.5
    watching.watch()
    watching.wait()


def reload(rng):
    """Save and open again."""
    path = str(Path(tempfile.gettempdir()) / "random_use.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)


def mode(rng):
    if bpy.context.active_object is not None and bpy.ops.object.mode_set.poll():
        bpy.ops.object.mode_set(mode=rng.choice(["OBJECT", "OBJECT", "EDIT"]))


def names(rng) -> str:
    return rng.choice([*CONTROL_NAMES, "nobody"])


def place(rng) -> tuple[float, float]:
    return (rng.uniform(-100, 900), rng.uniform(-100, 900))


# how often, and what
PRESSES = [
    (5, choose), (3, tweak), (6, select), (3, slide), (2, person), (2, listed), (2, rename),
    (2, delete), (2, live), (2, mode), (1, reload),
    (4, lambda rng: ops.fit()),
    (5, lambda rng: ops.fit_again()),
    (2, lambda rng: ops.adopt_sketch()),
    (1, lambda rng: ops.new_drawing()),
    (1, lambda rng: ops.default_tweakables()),
    (3, lambda rng: ops.decide(name=names(rng),
                               decision=rng.choice(["ACCEPT", "REJECT", "LOCK", "FREE"]))),
    (1, lambda rng: ops.unlock_all()),
    (2, lambda rng: ops.pin(name=rng.choice(LANDMARKS), place=place(rng))),
    (1, lambda rng: ops.unpin(name=rng.choice(["", *LANDMARKS]))),
    (1, lambda rng: bpy.ops.mesh.add_facs_face(
        identity_keys=rng.random() < 0.5, random_identity=rng.random() < 0.5,
        arkit=rng.random() < 0.2, seed=rng.randint(0, 99))),
    (1, lambda rng: ops.random_person(seed=rng.randint(0, 99))),
    (1, lambda rng: ops.plain_person()),
    (2, lambda rng: ops.reset_sliders(to=rng.choice(["NEUTRAL", "SKETCH"]))),
    (2, lambda rng: ops.random_expression(seed=rng.randint(0, 99))),
    (1, lambda rng: ops.mirror_expression()),
    (1, lambda rng: ops.key_expression()),
    (1, lambda rng: ops.paste_expression(
        text=rng.choice(['{"aus": {"smile": 3}}', "no expression", '{"aus": 1}']))),
    (1, lambda rng: ops.apply_expression(source=rng.choice(["FACE", "SKETCH"]))),
    (8, lambda rng: bpy.ops.ed.undo()),
    (4, lambda rng: bpy.ops.ed.redo()),
    (1, lambda rng: bpy.ops.object.duplicate()),
]  # fmt: skip


def press(what, rng) -> str:
    """Press, as a button does; the sentence if it was refused. Anything unexpected is raised."""
    try:
        what(rng)
    except RuntimeError as error:
        said = str(error).strip()
        assert "Traceback" not in said, said
        assert "poll()" in said or said.startswith("Error: "), said
        assert "\n" not in said, said
        return said
    return ""


def faults() -> list[str]:
    """What is half made in this file."""
    found = []
    for thing in bpy.data.objects:
        if not thing.users_scene:
            found.append(f"object {thing.name} is in no scene")
        if is_face(thing):
            check_face(thing)
            keys = thing.data.shape_keys.key_blocks
            if thing.sketch_to_face.number and "Fitted" not in keys:
                found.append(f"{thing.name} has lost its fitted key")
            corner = np.array(keys[-1].data[0].co)
            if not np.isfinite(corner).all():
                found.append(f"{thing.name} lies nowhere")
            if thing.parent is not None and armature_of(thing) is None:
                found.append(f"{thing.name} has no armature")
    for kind in ("meshes", "armatures", "shape_keys"):
        found += [f"{kind} {d.name} is nobody's" for d in getattr(bpy.data, kind) if not d.users]
    return found


def start(seed: int, furnished: str) -> random.Random:
    """A seeded hand, and an empty file or one in which somebody has begun already."""
    rng = random.Random(seed)
    if rng.random() < 0.6:
        bpy.ops.wm.open_mainfile(filepath=furnished)
    else:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.context.scene.sketch_to_face.sketch = str(rng.choice(SKETCHES))
    bpy.ops.ed.undo_push(message="start")
    return rng


@pytest.fixture
def furnished(shell, kept_fits, tmp_path) -> str:
    """A file with a fitted face, and a mesh of somebody else's with two of ARKit's keys."""
    bpy.context.scene.sketch_to_face.sketch = str(SKETCH)
    ops.fit()
    face = bpy.context.active_object
    data = bpy.data.meshes.new("Other")
    data.from_pydata([(0, 0, 0), (1, 0, 0), (0, 0, 1)], [], [(0, 1, 2)])
    other = bpy.data.objects.new("Other", data)
    bpy.context.scene.collection.objects.link(other)
    for key in ("Basis", "mouthSmileLeft", "jawOpen"):
        other.shape_key_add(name=key, from_mix=False)
    bpy.context.view_layer.objects.active = face
    path = str(tmp_path / "furnished.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    return path


@pytest.mark.slow
def test_a_thousand_random_sessions_leave_nothing_broken(furnished):
    weights = [weight for weight, _ in PRESSES]
    made = refused = 0
    for seed in range(SESSIONS):
        rng = start(seed, furnished)
        done = []
        for number in rng.choices(range(len(PRESSES)), weights, k=rng.randint(2, LONGEST)):
            done.append(number)
            said = press(PRESSES[number][1], rng)
            refused += bool(said)
            if PRESSES[number][0] < 8 and not said:
                bpy.ops.ed.undo_push(message=f"press {number}")
            broken = faults()
            assert not broken, (seed, done, broken)
        made += sum(map(is_face, bpy.data.objects))
    print(f"{SESSIONS} sessions, {made} faces at their ends, {refused} presses were refused")
    assert made > SESSIONS / 5 and refused > SESSIONS / 5
