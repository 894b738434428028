"""Runs in a clean Blender: installs a zip where packages of the same names as ours are in the way.

python strangers.py extension|legacy ZIP found|loaded|unpacked SKETCH FOLDER

found : others come first on Python's path; the add-on works with its own
loaded : another add-on has loaded a `snakes` of its own; ours says so, and leaves nothing behind
unpacked : another extension has written over ours since it was installed; ours says so
"""

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import press_everything as usual  # noqa: E402

del sys.path[0]

NAMES = ("addon", "snakes", "classifiers")


def strangers(folder: Path) -> Path:
    """Packages that nobody should import, in `folder`."""
    for name in NAMES:
        (folder / name).mkdir(parents=True)
        (folder / name / "__init__.py").write_text("STRANGER = True\n")
    return folder


def found(archive: str, folder: Path) -> None:
    sys.path.insert(0, str(strangers(folder / "others")))
    usual.install(archive)
    usual.first_fit()
    for name in usual.CORE:
        assert not hasattr(sys.modules[name], "STRANGER"), name
    for _ in range(2):  # switched off, on, and loaded anew, as Reload Scripts does
        bpy.ops.preferences.addon_disable(module=usual.MODULE)
        del sys.modules[usual.MODULE]
        bpy.ops.preferences.addon_enable(module=usual.MODULE)
        assert usual.MODULE in bpy.context.preferences.addons
    usual.first_fit()
    from addon.pipeline import fit

    assert Path(fit.__code__.co_filename).parent == Path(sys.modules["addon"].__file__).parent


def loaded(archive: str, folder: Path) -> None:
    sys.path.insert(0, str(strangers(folder / "others")))
    import snakes

    before = usual.hung()
    try:
        usual.install(archive)
    except (RuntimeError, AssertionError) as error:  # Blender says why, and how depends on it
        print(error)
    assert usual.MODULE not in bpy.context.preferences.addons
    assert usual.hung() == before
    assert sys.modules["snakes"] is snakes and "facs_rig" not in sys.modules


def unpacked(archive: str, folder: Path) -> None:
    import addon_utils  # from here on Blender's own modules are found

    before = usual.hung()
    usual.install(archive)
    sys.modules[usual.MODULE].unregister()
    file = Path(sys.modules["snakes"].__file__)
    for name in [n for n in sys.modules if n.partition(".")[0] in usual.CORE or usual.MODULE in n]:
        del sys.modules[name]  # as if Blender had been started again
    file.write_text("STRANGER = True\n")
    assert addon_utils.enable(usual.MODULE) is None
    left = {kind: v for kind, v in usual.hung().items() if v != before[kind]}
    assert left.keys() <= {"path"}, left  # Blender's own for wheels


bpy.ops.wm.read_factory_settings(use_empty=True)
case = {"found": found, "loaded": loaded, "unpacked": unpacked}[usual.older]
usual.guarded(lambda: case(usual.archive, usual.FOLDER))
