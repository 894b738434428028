"""Short sessions of somebody who presses anything: no traceback, nothing half made.

Seeded, so that a failure comes again: the message names the seed and what was pressed. What a
fit computes is kept from press to press, for other tests press harder on that (tests/snakes).
"""

from __future__ import annotations

import random
import shutil
import traceback
import warnings
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from facs_rig import CONTROL_NAMES, IDENTITY, LANDMARKS, FaceParameters  # noqa: E402
from facs_rig.blender.pose import armature_of, check_face, is_face  # noqa: E402
from facs_rig.expressions import dumps  # noqa: E402
from facs_rig.stylised import PRESET_NAMES  # noqa: E402
from tests.nightly import at_night  # noqa: E402

from .conftest import ROOT, SKETCH  # noqa: E402
from .sheets import draw_on, image_of, lines_of, pencil_of  # noqa: E402

OFTEN, SESSIONS, LONGEST = 100, 1000, 8  # sessions in every run, in all; presses in one
SKETCHES = sorted((ROOT / "addon" / "sketches").glob("*.png"))
ops = bpy.ops.sketch_to_face
CUT = "cut"  # property of a face from which the artist has taken something by hand


@pytest.fixture
def kept_fits(monkeypatch):
    """`pipeline.fit` and `read_expression` that read the same drawing only once.

    Which pins and locks there are counts, not where and how strong: a thousand hands differ there.
    """
    from addon import pipeline

    fit, read, known = pipeline.fit, pipeline.read_expression, {}

    def kept_fit(drawing, options=None, progress=None, detector=None, shaped=None):
        key = (drawing.image.tobytes(), options.method, options.strokes, options.align,
               options.tweakables, bool(options.pins), bool(options.expression))  # fmt: skip
        if key not in known:
            known[key] = fit(drawing, options, None, detector)
        if shaped:
            shaped(known[key].parameters, known[key].offsets, known[key].keys)
        return known[key]

    def kept_read(drawing, align=None, detector=None):
        page = drawing if isinstance(drawing, Path) else drawing.image.tobytes()
        if (page, align) not in known:
            known[page, align] = read(drawing, align, detector)
        return known[page, align]

    monkeypatch.setattr(pipeline, "fit", kept_fit)
    monkeypatch.setattr(pipeline, "read_expression", kept_read)


@lru_cache(maxsize=1)
def strokes():
    return tuple(lines_of(SKETCH))


# --- what may be pressed --------------------------------------------------------------------------


def folder() -> Path:
    """The folder of the test's files: that of the log, which `shell` has put aside."""
    from addon.blender.messages import reporting

    return reporting.log_path().parent


def faces_of(scene) -> list:
    return [thing for thing in scene.objects if is_face(thing)]


def choose(rng):
    """Another sketch: a good file, a bad one, an image, a drawing."""
    settings = bpy.context.scene.sketch_to_face
    kind = rng.choice(["good", "good", "bad", "none", "image", "pencil"])
    settings.sketch_kind = {"image": "IMAGE", "pencil": "PENCIL"}.get(kind, "FILE")
    if kind in ("good", "bad", "none"):
        bad = rng.choice(["//nowhere.png", str(ROOT / "README.md"), str(ROOT), "a" * 300])
        settings.sketch = {"good": str(rng.choice(SKETCHES)), "bad": bad}.get(kind, "")
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
    """Any object, a face more often than others, or none."""
    bpy.ops.object.select_all(action="DESELECT")
    layer = bpy.context.view_layer.objects
    choice = rng.choice([None, *layer, *filter(is_face, layer)])
    if rng.random() < 0.2:
        bpy.ops.object.select_all(action="SELECT")
    bpy.context.view_layer.objects.active = choice
    if choice is not None:
        choice.select_set(True)


def slide(rng):
    """A slider, by hand."""
    for face in faces_of(bpy.context.scene):
        face[rng.choice(CONTROL_NAMES)] = rng.uniform(0, 10)
        face.update_tag()


def person(rng):
    """A slider of the person, where there are any."""
    for face in faces_of(bpy.context.scene):
        feature = rng.choice(IDENTITY)
        value = rng.uniform(feature.minimum, feature.maximum)
        setattr(face.sketch_to_face.identity, feature.name, value)


def listed(rng):
    """A line of the list of what was read."""
    for face in faces_of(bpy.context.scene):
        for item in list(face.sketch_to_face.detections)[:: rng.randint(5, 20)]:
            item.intensity = rng.uniform(0, 5)
            item.locked = rng.random() < 0.5


def rename(rng):
    for face in own_faces():
        face.name = rng.choice(["Ännä", "a" * 60, "Face", "x.001"])


def delete(rng):
    """Everything that is selected, and what only it used."""
    bpy.ops.object.delete()
    bpy.ops.outliner.orphans_purge(do_recursive=True)


def live(rng):
    """Some faces are watched from now on, others no more; some are drawn on; the timer looks."""
    from addon.blender.background import live as watching

    for face in own_faces():
        face.sketch_to_face.live = rng.random() < 0.7
        if rng.random() < 0.3:  # as if another sketch had been saved under its name
            face.sketch_to_face.sketch = rng.choice([*map(str, SKETCHES), "//nowhere.png"])
    if rng.random() < 0.5:
        repaint(rng)
    bpy.ops.ed.undo_push(message="drawn")  # what the timer does comes after it
    watching.watch()
    watching.wait()


def glance(rng):
    """The timer looks; what it begins may go on while other things are pressed."""
    from addon.blender.background import live as watching

    for _ in range(rng.randint(1, 3)):
        watching.watch()


def repaint(rng):
    """Something is drawn on the sketches that are in this file."""
    for image in bpy.data.images:
        if len(image.pixels):
            image.pixels[rng.randrange(len(image.pixels))] = rng.random()
    for pencil in pencils():
        for layer in pencil.data.layers:
            for frame in layer.frames:
                draw_on(frame, strokes() if rng.random() < 0.7 else strokes()[:3])


def lose(rng):
    """The image or the drawing that a face is of is deleted."""
    for thing in [*bpy.data.images, *pencils()]:
        if rng.random() < 0.5:
            (bpy.data.images if thing.id_type == "IMAGE" else bpy.data.objects).remove(thing)
    bpy.ops.outliner.orphans_purge(do_recursive=True)


def rename_sketch(rng):
    for thing in [*bpy.data.images, *pencils()]:
        thing.name = rng.choice(["Blättchen", "b" * 60, "Pen", "Drawn", "x.001"])


def pencils() -> list:
    from addon.blender.state import sources

    return [thing for thing in bpy.data.objects if thing.type in sources.PENCILS]


def scenes(rng):
    """Another scene, empty or with the same faces or with copies of them; or one less."""
    kind = rng.choice(["NEW", "LINK_COPY", "FULL_COPY", "", "", "NEXT"])
    if kind == "NEXT":
        bpy.context.window.scene = rng.choice(list(bpy.data.scenes))
    elif kind:
        bpy.ops.scene.new(type=kind)
    elif len(bpy.data.scenes) > 1:
        bpy.ops.scene.delete()
        bpy.ops.outliner.orphans_purge(do_recursive=True)


def collections(rng):
    """Another collection is the active one: a new one, a hidden one, one of another file."""
    scene, layers = bpy.context.scene, bpy.context.view_layer
    kind = rng.choice(["new", "inside", "top", "linked"])
    if kind == "top":
        layers.active_layer_collection = layers.layer_collection
        return
    if kind == "linked":
        with bpy.data.libraries.load(str(folder() / "cast.blend"), link=True) as (_, taken):
            taken.collections = ["Cast"]
        (made,) = taken.collections
    else:
        made = bpy.data.collections.new("Some")
    if made.name not in scene.collection.children:
        scene.collection.children.link(made)
    place = next(c for c in layers.layer_collection.children if c.collection == made)
    layers.active_layer_collection = place
    if kind == "inside":  # a parent that is left out takes its children with it
        below = bpy.data.collections.new("Below")
        made.children.link(below)
        layers.active_layer_collection = place.children[0]
    hide = rng.choice(["", "eye", "screen", "excluded", "select"])
    place.hide_viewport = hide == "eye"
    place.exclude = hide == "excluded"
    if kind != "linked":
        made.hide_viewport, made.hide_select = hide == "screen", hide == "select"


def disarm(rng):
    """The bones are deleted under a face."""
    for face in own_faces():
        armature = armature_of(face)
        if armature is not None and rng.random() < 0.5:
            face[CUT] = True
            bpy.data.objects.remove(armature)
            bpy.ops.outliner.orphans_purge(do_recursive=True)


def cut_keys(rng):
    """Shape keys are removed by hand: one, or all.

    By the button of Blender's list: Object.shape_key_remove leaves the dependency graph with the
    driver that it frees, and Blender 5.0 crashes when that is evaluated next.
    """
    for face in own_faces():
        if face.mode != "OBJECT" or face.data.shape_keys is None:
            continue
        for user in faces_of(bpy.data):
            if user.data == face.data:
                user[CUT] = True
        last = len(face.data.shape_keys.key_blocks) - 1
        face.active_shape_key_index = rng.choice([0, last, rng.randint(0, last)])
        with bpy.context.temp_override(object=face, active_object=face):
            if bpy.ops.object.shape_key_remove.poll():
                bpy.ops.object.shape_key_remove(all=rng.random() < 0.2)


def modify(rng):
    """A modifier is added to the faces, or one is taken away."""
    for face in own_faces():
        kind = rng.choice(["SUBSURF", "DECIMATE", "MIRROR", "SOLIDIFY", ""])
        if kind:
            face.modifiers.new("Mine", kind)
        elif face.modifiers:
            face[CUT] = True
            face.modifiers.remove(rng.choice(list(face.modifiers)))


def spoil(rng):
    """A slider is deleted, or made text, in the list of custom properties."""
    for face in own_faces():
        face[CUT] = True
        name = rng.choice(CONTROL_NAMES)
        face.pop(name, None)  # as the list does to change a type
        if rng.random() < 0.5:
            face[name] = "much"


def a_text(rng) -> str:
    """An expression, or something like it."""
    good = dumps(FaceParameters({"smile": 3.25}, gaze=(0.1, 0.0)))
    broken = [good[:40], good.replace("smile", "grin"), good.replace("3.25", "1e999"), "", "[]"]
    return rng.choice([good, good, good, *broken])


def own_faces() -> list:
    """The faces of this file, without those that are linked into it."""
    return [face for face in faces_of(bpy.data) if face.library is None]


def undo_off(rng):
    bpy.context.preferences.edit.use_global_undo = rng.random() < 0.5


def to_and_fro(rng):
    """Undo and redo."""
    steps = rng.randint(1, 3)
    for step in [bpy.ops.ed.undo] * steps + [bpy.ops.ed.redo] * steps:
        if step.poll():
            step()


def draw_a_sheet(rng):
    """The blank sheet, drawn on, fitted.

    Each with a step of undo of its own, as buttons and pens make them: an undo over a new object
    that no step knows of crashes Blender.
    """
    ops.new_drawing("EXEC_DEFAULT", True)
    pencil = bpy.context.scene.sketch_to_face.sketch_pencil
    draw_on(pencil.data.layers[0].frames[0], strokes() if rng.random() < 0.8 else [])
    bpy.ops.ed.undo_push(message="pen")
    ops.fit()


def story(rng):
    """A folder of sketches, one that is not there, none."""
    settings = bpy.context.scene.sketch_to_face
    settings.storyboard = rng.choice([str(folder() / "drawn")] * 3 + ["//nowhere", ""])
    ops.storyboard(head=rng.random() < 0.5)


def export(rng):
    name = rng.choice(["face", "Ännä", "nowhere/face"])
    suffix = rng.choice([".glb", ".fbx", ".obj", ".ply", ".blend", ""])
    ops.export(
        filepath=str(folder() / f"{name}{suffix}"),
        names=rng.choice(["ours", "arkit"]),
        animation=rng.random() < 0.05,  # Blender's exporter takes half a minute
    )


def save_and_load(rng):
    """An expression goes to a file and comes back; or a file that is broken, or none."""
    good, bad = folder() / "kept.json", folder() / "bad.json"
    bad.write_text(a_text(rng))
    ops.save_expression(filepath=str(good), person=rng.random() < 0.5)
    path = rng.choice([good, good, bad, folder() / "nowhere.json", folder()])
    ops.load_expression(filepath=str(path), person=rng.random() < 0.5)


def reload(rng):
    """Save and open again."""
    path = str(folder() / "random_use.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, compress=False)
    bpy.ops.wm.open_mainfile(filepath=path)


def mode(rng):
    if bpy.context.active_object is not None and bpy.ops.object.mode_set.poll():
        bpy.ops.object.mode_set(mode=rng.choice(["OBJECT", "OBJECT", "EDIT"]))


def names(rng) -> str:
    return rng.choice([*CONTROL_NAMES, "nobody"])


def place(rng) -> tuple[float, float]:
    return (rng.uniform(-100, 900), rng.uniform(-100, 900))


# what, and how often
PRESSES = {
    "choose": (5, choose), "tweak": (3, tweak), "select": (6, select), "slide": (3, slide),
    "person": (2, person), "listed": (2, listed), "rename": (2, rename), "delete": (2, delete),
    "live": (2, live), "glance": (2, glance), "repaint": (1, repaint), "lose": (1, lose),
    "rename sketch": (1, rename_sketch), "mode": (2, mode), "reload": (1, reload),
    "scenes": (2, scenes), "collections": (2, collections), "disarm": (1, disarm),
    "cut keys": (1, cut_keys), "modify": (1, modify), "spoil": (1, spoil),
    "undo off": (1, undo_off), "sheet": (0.5, draw_a_sheet), "story": (1, story),
    "export": (0.5, export), "save and load": (2, save_and_load),
    "fit": (2, lambda rng: ops.fit()),
    "fit again": (3, lambda rng: ops.fit_again()),
    "adopt": (2, lambda rng: ops.adopt_sketch()),
    "new drawing": (1, lambda rng: ops.new_drawing()),
    "defaults": (1, lambda rng: ops.default_tweakables()),
    "decide": (3, lambda rng: ops.decide(
        name=names(rng), decision=rng.choice(["ACCEPT", "REJECT", "LOCK", "FREE"]))),
    "unlock": (1, lambda rng: ops.unlock_all()),
    "pin": (2, lambda rng: ops.pin(name=rng.choice(LANDMARKS), place=place(rng))),
    "unpin": (1, lambda rng: ops.unpin(name=rng.choice(["", *LANDMARKS]))),
    "add face": (1, lambda rng: bpy.ops.mesh.add_facs_face(
        identity_keys=rng.random() < 0.5, random_identity=rng.random() < 0.5,
        arkit=rng.random() < 0.2, seed=rng.randint(0, 99))),
    "random person": (1, lambda rng: ops.random_person(seed=rng.randint(0, 99))),
    "stylised person": (1, lambda rng: ops.stylised_person(
        style=rng.choice(PRESET_NAMES).upper())),
    "plain person": (1, lambda rng: ops.plain_person()),
    "reset": (2, lambda rng: ops.reset_sliders(to=rng.choice(["NEUTRAL", "SKETCH"]))),
    "random expression": (2, lambda rng: ops.random_expression(seed=rng.randint(0, 99))),
    "mirror": (1, lambda rng: ops.mirror_expression()),
    "key": (1, lambda rng: ops.key_expression()),
    "copy": (1, lambda rng: ops.copy_expression()),
    "paste": (1, lambda rng: ops.paste_expression(text=a_text(rng))),
    "apply": (1, lambda rng: ops.apply_expression(source=rng.choice(["FACE", "SKETCH"]))),
    "undo": (8, lambda rng: bpy.ops.ed.undo()), "to and fro": (3, to_and_fro),
    "duplicate": (1, lambda rng: bpy.ops.object.duplicate()),
}  # fmt: skip
UNRECORDED = {"undo", "to and fro", "glance", "live"}  # these make no step of undo themselves


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
    found, drawings = [], pencils()
    for thing in bpy.data.objects:
        if thing.library is not None:
            continue
        # Blender keeps a deleted object for whoever points to it: a face to its drawing
        if not thing.users_scene and thing not in drawings:
            found.append(f"object {thing.name} is in no scene")
        if is_face(thing) and CUT not in thing:
            check_face(thing)
            keys = thing.data.shape_keys.key_blocks
            if thing.sketch_to_face.mark and "Fitted" not in keys:
                found.append(f"{thing.name} has lost its fitted key")
            corner = np.array(keys[-1].data[0].co)
            if not np.isfinite(corner).all():
                found.append(f"{thing.name} lies nowhere")
            if thing.parent is not None and armature_of(thing) is None:
                found.append(f"{thing.name} has no armature")
    for kind in ("meshes", "armatures", "shape_keys", "grease_pencils", "grease_pencils_v3"):
        for data in getattr(bpy.data, kind, ()):
            if not data.users and data.library is None:
                found.append(f"{kind} {data.name} is nobody's")
    return found


def unrest(logged: list[str]) -> list[str]:
    """What is wrong with the watch over live faces once all it had begun is over."""
    from addon.blender.background import live as watching
    from addon.blender.state.session import session

    watching.wait()
    watching.watch()
    watching.wait()
    found = [said for said in session.troubles.values() if not said or "\n" in said]
    names = {face.name for face in own_faces() if face.sketch_to_face.live}
    found += [f"trouble with {name}, which is not live" for name in session.troubles
              if name not in names]  # fmt: skip
    if session.refit is not None or session.doing is not None:
        found.append("something is still at work")
    if not bpy.app.timers.is_registered(watching.watch):
        found.append("nobody watches any more")
    return found + logged


def start(seed: int, furnished: str) -> random.Random:
    """A seeded hand, and an empty file or one in which somebody has begun already."""
    rng = random.Random(seed)
    bpy.context.preferences.edit.use_global_undo = True
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
    """A file with a fitted face, and a mesh of somebody else's with two of ARKit's keys.

    Beside it: the same face in a collection, for linking, and a folder of sketches.
    """
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
    bpy.ops.wm.save_as_mainfile(filepath=path, compress=False)
    cast = bpy.data.collections.new("Cast")
    for thing in (face, face.parent):
        cast.objects.link(thing)
    bpy.data.libraries.write(str(tmp_path / "cast.blend"), {cast})
    (tmp_path / "drawn").mkdir()
    shutil.copy(SKETCHES[0], tmp_path / "drawn")
    (tmp_path / "drawn" / "broken.png").write_bytes(b"not a picture")
    return path


@pytest.fixture
def logged(shell, monkeypatch) -> list[str]:
    """What the watch over live faces has written to the log, where a button would have raised."""
    found: list[str] = []

    def log(title):
        if title == "Live":
            found.append(traceback.format_exc())
        return shell.messages.reporting.log_path()

    monkeypatch.setattr(shell.messages.reporting, "log", log)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("seeds", [range(OFTEN), at_night(range(OFTEN, SESSIONS))], ids=len)
def test_random_sessions_leave_nothing_broken(furnished, logged, seeds):
    weights = [weight for weight, _ in PRESSES.values()]
    made = refused = 0
    never = set(PRESSES)
    for seed in seeds:
        rng = start(seed, furnished)
        done = []
        for name in rng.choices(list(PRESSES), weights, k=rng.randint(2, LONGEST)):
            done.append(name)
            never.discard(name)
            try:
                said = press(PRESSES[name][1], rng)
            except Exception as error:
                error.add_note(f"session {seed}: {done}")
                raise
            refused += bool(said)
            if name not in UNRECORDED and not said:
                bpy.ops.ed.undo_push(message=name)
            broken = faults() + logged
            assert not broken, (seed, done, broken)
        broken = unrest(logged)
        assert not broken, (seed, done, broken)
        made += len(faces_of(bpy.data))
    print(f"{len(seeds)} sessions, {made} faces at their ends, {refused} presses were refused")
    assert made > len(seeds) / 5 and refused > len(seeds) / 5
    assert not never
