"""Runs in a clean Blender: installs a zip over an older one, as an artist would, and presses
everything; then takes it away again. What came of it is written to FOLDER/result.json.

python press_everything.py extension|legacy ZIP OLDER_ZIP SKETCH FOLDER
python press_everything.py extension|legacy ZIP only SKETCH FOLDER    installs ZIP, fits, exports
python press_everything.py extension|legacy ZIP smoke SKETCH FOLDER   ... and imports every module
"""

import faulthandler
import importlib
import importlib.util
import json
import os
import shutil
import sys
import time
import traceback
from pathlib import Path

import bpy
import numpy as np

faulthandler.enable()  # a crash of Blender tells where
kind, archive, older, sketch, folder = sys.argv[-5:]
if kind == "legacy":  # what a distribution has installed beside its Blender is not Blender
    sys.path[:] = [p for p in sys.path if "-packages" not in p]
FOLDER, EXPORTS = Path(folder), Path(folder) / "exports"
OTHER = str(Path(sketch).with_name("angry_man.png"))
MODULE = "bl_ext.user_default.sketch_to_face" if kind == "extension" else "sketch_to_face"
CORE = ("addon", "facs_rig", "classifiers", "snakes", "dataset_gen")
# Buttons that are not pressed here, and why.
NOT_PRESSED = {
    "sketch_to_face.drag_pins": "follows the mouse: tests/blender/window drags with it",
}

ops = bpy.ops.sketch_to_face
pressed: set[str] = set()
told: dict = {"blender": bpy.app.version_string, "seconds": {}, "python": sys.version_info[:2]}


# --- installing and removing ----------------------------------------------------------------------


def install(path: str) -> None:
    """The zip, as Blender's preferences do it; enabled."""
    if kind == "extension":
        bpy.ops.extensions.package_install_files(
            filepath=path, repo="user_default", enable_on_install=True
        )
    else:
        bpy.ops.preferences.addon_install(filepath=path, overwrite=True)
        bpy.ops.preferences.addon_enable(module=MODULE)
    assert MODULE in bpy.context.preferences.addons, f"{MODULE} is not enabled"


def remove() -> None:
    """Take the add-on away, as the preferences do it."""
    if kind == "extension":
        repos = bpy.context.preferences.extensions.repos
        index = next(i for i, repo in enumerate(repos) if repo.module == "user_default")
        bpy.ops.extensions.package_uninstall(repo_index=index, pkg_id="sketch_to_face")
    else:
        window = bpy.context.window_manager.windows[0]
        with bpy.context.temp_override(window=window, area=window.screen.areas[0]):
            bpy.ops.preferences.addon_remove(module=MODULE)
    assert MODULE not in bpy.context.preferences.addons


def hung() -> dict[str, list]:
    """What hangs on Blender: handlers, properties, menus, operators, the path."""
    lists = [getattr(bpy.app.handlers, n) for n in dir(bpy.app.handlers)]
    state = {"handlers": [str(f) for v in lists if isinstance(v, list) for f in v
                          if f.__module__.startswith((MODULE, *CORE))]}  # fmt: skip
    kinds = [getattr(bpy.types, n) for n in dir(bpy.types)]
    state["classes"] = [str(k) for k in kinds if MODULE in getattr(k, "__module__", "")]
    state["properties"] = [str(k) for k in kinds if hasattr(k, "sketch_to_face")]
    menus = [f for k in kinds for f in getattr(getattr(k, "draw", None), "_draw_funcs", ())]
    state["menus"] = [str(f) for f in menus if MODULE in f.__module__]
    state["operators"] = dir(bpy.ops.sketch_to_face)
    state["path"] = [p for p in sys.path if "sketch_to_face" in p]
    return state


# --- pressing -------------------------------------------------------------------------------------


def press(name: str, /, **values) -> bpy.types.Object:
    """The button does what it promises; returns the active object."""
    where, operator = name.split(".")
    begin = time.perf_counter()
    assert getattr(getattr(bpy.ops, where), operator)("EXEC_DEFAULT", True, **values) == {
        "FINISHED"
    }, name
    told["seconds"].setdefault(name, []).append(round(time.perf_counter() - begin, 2))
    pressed.add(name)
    return bpy.context.active_object


def settings():
    return bpy.context.scene.sketch_to_face


def keys_of(thing) -> list[str]:
    return [key.name for key in thing.data.shape_keys.key_blocks]


def choices(name: str, prop: str) -> list[str]:
    """What an enumeration of a button offers."""
    where, operator = name.split(".")
    kind = getattr(getattr(bpy.ops, where), operator).get_rna_type()
    return [item.identifier for item in kind.properties[prop].enum_items]


def shown(face) -> np.ndarray:
    """(n, 3) the vertices as they are seen, metres, in the axes of files: y up."""
    bpy.context.view_layer.update()
    graph = bpy.context.evaluated_depsgraph_get()
    mesh = face.evaluated_get(graph).data
    points = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", points)
    world = np.array(face.matrix_world)
    points = points.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3]
    return np.stack([points[:, 0], points[:, 2], -points[:, 1]], axis=1)


def first_fit() -> None:
    settings().sketch = sketch
    face = press("sketch_to_face.fit")
    told["keys"] = keys_of(face)


def exports(way: str = "every") -> None:
    """Every format, with every way to name its keys; the artist has moved a slider before.

    way : "smoke" writes .fbx once, for which Blender's exporter takes seconds
    """
    face = bpy.context.active_object
    face["jaw_open"] = 3.0
    face.update_tag()
    EXPORTS.mkdir(parents=True)
    np.save(FOLDER / "shown.npy", shown(face))
    told["exports"], told["read by Blender"] = 0, {}
    for ending in choices("sketch_to_face.export", "format"):
        every = choices("sketch_to_face.export", "names")
        for names in every[:1] if (way, ending) == ("smoke", ".fbx") else every:
            path = EXPORTS / f"gesicht ä {names}{ending}"
            press("sketch_to_face.export", filepath=str(path), format=ending, names=names)
            told["exports"] += 1
    for path in sorted(EXPORTS.iterdir()):
        before = set(bpy.data.objects)
        if path.suffix == ".blend":
            with bpy.data.libraries.load(str(path)) as (inside, wanted):
                wanted.objects = list(inside.objects)
        elif path.suffix == ".fbx":
            bpy.ops.import_scene.fbx(filepath=str(path))
        else:
            continue
        new = set(bpy.data.objects) - before
        (read,) = (thing for thing in new if thing.type == "MESH" and thing.data.shape_keys)
        told["read by Blender"][path.name] = keys_of(read)
        if path.suffix == ".fbx":
            np.save(FOLDER / f"{path.name}.npy", shown(read))
        bpy.data.batch_remove(new)
    bpy.context.view_layer.objects.active = face
    face.select_set(True)


def faces_without_a_sketch() -> None:
    told["added"] = keys_of(press("mesh.add_facs_face", arkit=True, random_identity=True))
    press("sketch_to_face.random_person", seed=3)
    press("sketch_to_face.stylised_person", style="CHIBI")
    press("sketch_to_face.new_creases", seed=3)
    press("sketch_to_face.plain_creases")
    press("sketch_to_face.plain_person")
    press("sketch_to_face.random_expression", seed=1)
    press("sketch_to_face.mirror_expression")
    press("sketch_to_face.key_expression")
    press("sketch_to_face.copy_expression")
    press("sketch_to_face.paste_expression", text=expression())
    path = str(FOLDER / "expression.json")
    press("sketch_to_face.save_expression", filepath=path)
    press("sketch_to_face.reset_sliders", to="NEUTRAL", head=True)
    press("sketch_to_face.load_expression", filepath=path)
    twin = bpy.context.active_object.copy()  # shares mesh and keys, as Alt-D does
    bpy.context.scene.collection.objects.link(twin)
    bpy.context.view_layer.objects.active = twin
    press("sketch_to_face.stand_alone")
    other = three_corners()
    other.select_set(True)
    press("sketch_to_face.apply_expression")
    assert other.data.shape_keys.key_blocks["jawOpen"].value != 0


def expression() -> str:
    """What *Copy* puts on the clipboard, which Blender without a window does not have."""
    from facs_rig import FaceParameters
    from facs_rig.expressions import dumps

    return dumps(FaceParameters({"pucker": 4.0, "jaw_open": 2.0}))


def three_corners() -> bpy.types.Object:
    """A mesh of the artist's own with keys of ARKit's."""
    data = bpy.data.meshes.new("Other")
    data.from_pydata([(0, 0, 0), (1, 0, 0), (0, 0, 1)], [], [(0, 1, 2)])
    other = bpy.data.objects.new("Other", data)
    bpy.context.scene.collection.objects.link(other)
    for name in ("Basis", "mouthSmileLeft", "jawOpen", "mouthPucker"):
        other.shape_key_add(name=name, from_mix=False)
    other.data.shape_keys.key_blocks["jawOpen"].data[0].co.z = -1.0
    return other


def corrections() -> None:
    """What was read is corrected, pinned, shown, fitted again in every way."""
    settings().sketch = sketch
    face = press("sketch_to_face.fit")
    press("sketch_to_face.hair", kind="surface")
    press("sketch_to_face.beard", kind="GOATEE")
    curves = "curves" if bpy.app.version >= (4, 2) else "locks"
    press("sketch_to_face.hair", kind=curves)
    press("sketch_to_face.hair_preset", preset="bob")
    face.sketch_to_face.hair_length, face.sketch_to_face.hair_volume = 1.4, 0.8
    press("sketch_to_face.hair_preset", preset="drawn")
    press("sketch_to_face.decide", name="smile", decision="REJECT")
    press("sketch_to_face.evidence")
    overlay = sys.modules[MODULE + ".viewport.overlay"]
    overlay.look(bpy.context, face).task.done.wait(60)
    seen = overlay.look(bpy.context, face)
    assert len(seen.lines) > 10
    (chin,) = overlay.on_page(face, overlay.points_of(face, seen)["chin"])
    to_places = sys.modules[MODULE + ".state.memory"].page_of(face)
    place = to_places @ (chin[0], chin[1] + 2.0, 1.0)  # two pixels lower
    press("sketch_to_face.pin", name="chin", place=tuple(place))
    offered = settings().bl_rna.properties
    methods = [item.identifier for item in offered["method"].enum_items]
    strokes = [item.identifier for item in offered["strokes"].enum_items]
    for number in range(max(len(methods), len(strokes))):  # each of both once
        settings().method = methods[number % len(methods)]
        settings().strokes = strokes[-1 - number % len(strokes)]
        press("sketch_to_face.fit_again")
    press("sketch_to_face.unpin", name="")
    press("sketch_to_face.unlock_all")
    press("sketch_to_face.add_preset", name="Mine")
    press("sketch_to_face.add_preset", remove_active=True, name="Mine")
    settings().tweakables.mirror = True
    press("sketch_to_face.default_tweakables")
    settings().sketch = OTHER
    press("sketch_to_face.adopt_sketch")
    chosen = bpy.context.scene.sketch_to_face.sketch
    press("sketch_to_face.try_sample")
    assert Path(bpy.context.scene.sketch_to_face.sketch).is_file(), "the zip has no samples"
    bpy.context.scene.sketch_to_face.sketch = chosen


def sketches_of_every_kind() -> None:
    """A file of every format that is read, an image, a drawing with Grease Pencil, live."""
    from PIL import Image

    sources, live = sys.modules[MODULE + ".state.sources"], sys.modules[MODULE + ".background.live"]
    session = sys.modules[MODULE + ".state.session"].session
    settings().method, settings().strokes = "shape", "ignore"
    settings().sketch_kind = "FILE"
    with Image.open(sketch) as picture:
        page = picture.convert("L")
    for ending in ("png", "jpg", "webp", "tif", "bmp", "gif"):
        settings().sketch = str(FOLDER / f"zeichnung ä.{ending}")
        page.save(settings().sketch)
        drawing, _ = sources.source_of(settings()).load()
        assert drawing.image.shape == (page.height, page.width)
    sheets = helper("sheets")
    settings().sketch_kind, settings().sketch_image = "IMAGE", sheets.image_of(sketch)
    press("sketch_to_face.fit")
    press("sketch_to_face.new_drawing")
    settings().sketch_kind = "PENCIL"
    settings().sketch_pencil = sheets.pencil_of(sheets.lines_of(sketch))
    face = press("sketch_to_face.fit")
    settings().sketch_kind = "FILE"
    face.sketch_to_face.sketch_kind, face.sketch_to_face.sketch = "FILE", OTHER
    face.sketch_to_face.live = True
    before = shown(face)
    live.watch()
    live.wait()
    assert not session.troubles and np.abs(shown(face) - before).max() > 1e-3
    face.sketch_to_face.live = False


def helper(name: str):
    """A module that lies beside this file and needs nothing but Blender and the core."""
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def storyboard() -> None:
    board = FOLDER / "storyboard"
    board.mkdir()
    for number, file in enumerate((sketch, OTHER)):
        shutil.copy(file, board / f"{number}.png")
    settings().storyboard, settings().storyboard_every = str(board), 1
    bpy.data.batch_remove(bpy.data.objects)  # Blender's exporters try every frame on every object
    press("mesh.add_facs_face", identity_keys=False, detail="game")  # fewer keys, fewer vertices
    press("sketch_to_face.storyboard")
    for ending in (".glb", ".fbx"):
        path = FOLDER / f"moving ä{ending}"
        press("sketch_to_face.export", filepath=str(path), format=ending, animation=True)
        assert path.stat().st_size > 1e5


def help_and_log() -> None:
    """Every page, and the log; the test has put a script in the browser's place."""
    for page in choices("sketch_to_face.help", "page"):
        press("sketch_to_face.help", page=page)
    try:
        raise ZeroDivisionError("a test")
    except ZeroDivisionError:
        told["log"] = str(sys.modules[MODULE + ".messages.reporting"].log("A test"))
    press("sketch_to_face.log")


def samples() -> None:
    """Those that the zip brings."""
    for drawing in choices("sketch_to_face.try_sample", "drawing"):
        press("sketch_to_face.try_sample", drawing=drawing)
        assert Path(settings().sketch).is_relative_to(os.environ["BLENDER_USER_RESOURCES"])


def everything_imports() -> None:
    """Each module that is in the core, not only those that a button has asked for."""
    site = Path(sys.modules["facs_rig"].__file__).parents[1]
    files = sorted(f for package in CORE for f in (site / package).rglob("*.py"))
    told["modules"] = []
    for file in files:
        parts = file.relative_to(site).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        importlib.import_module(name)
        told["modules"].append(name)


def loaded() -> dict[str, str]:
    """Where each top-level module was loaded from."""
    return {name: str(Path(module.__file__).resolve()) for name, module in
            list(sys.modules.items()) if getattr(module, "__file__", None)
            and "." not in name}  # fmt: skip


def buttons() -> set[str]:
    """The names of all operators of the add-on, as Blender knows them."""
    kinds = [getattr(bpy.types, n) for n in dir(bpy.types)]
    ours = [k for k in kinds if isinstance(k, type) and issubclass(k, bpy.types.Operator)
            and k.__module__.startswith(MODULE)]  # fmt: skip
    return {k.bl_idname.lower().replace("_ot_", ".", 1) for k in ours}


STEPS = (first_fit, exports, faces_without_a_sketch, corrections, sketches_of_every_kind, samples,
         storyboard, help_and_log, everything_imports)  # fmt: skip


def whole() -> None:
    """Old zip, new zip over it in the same session, everything, off, on, away."""
    before = hung()
    install(older)
    import facs_rig

    assert facs_rig.IS_OLD
    bpy.ops.mesh.add_facs_face()
    install(archive)
    import facs_rig

    assert not hasattr(facs_rig, "IS_OLD"), "the new shell works with the old core"
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module=MODULE)
    for step in STEPS:
        step()
    told["buttons"] = sorted(buttons())
    told["not pressed"] = sorted(buttons() - pressed - NOT_PRESSED.keys())
    told["unknown"] = sorted(NOT_PRESSED.keys() - buttons())
    told["files"] = loaded()
    bpy.ops.preferences.addon_disable(module=MODULE)
    told["hung"] = {k: v for k, v in hung().items() if v != before[k]}
    bpy.ops.preferences.addon_enable(module=MODULE)
    settings().sketch = sketch
    press("sketch_to_face.fit")
    remove()
    told["still hung"] = {k: v for k, v in hung().items() if v != before[k]}


def main() -> None:
    foreign = [m for m in ("scipy", "skimage", "onnxruntime", "PIL", "snakes", "trimesh", "addon")
               if importlib.util.find_spec(m)]  # fmt: skip
    assert not foreign, f"not a clean Blender: {foreign}"
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if older in ("only", "smoke"):
        install(archive)
        first_fit()
        exports(older)
        if older == "smoke":
            everything_imports()
            told["files"] = loaded()
    else:
        whole()
    (FOLDER / "result.json").write_text(json.dumps(told))


def guarded(work) -> None:
    """Whatever Blender makes of errors in scripts, they end it."""
    try:
        work()
    except BaseException:
        traceback.print_exc()
        sys.stdout.flush()
        os._exit(1)


if __name__ == "__main__":
    guarded(main)
