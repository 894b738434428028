"""The Blender shell: a sidebar tab, a button, sliders. Everything it knows comes from the core.

The same folder works as an extension (Blender 4.2 and newer, the core comes as wheels), as an
add-on of older versions (the core lies in a folder `core` beside this file) and as the module
`addon.blender` (the tests). Hence: relative imports inside, absolute ones for the core.
"""

import gc
import sys
from importlib import invalidate_caches
from importlib.util import find_spec
from pathlib import Path

bl_info = {
    "name": "Sketch to Face",
    "author": "Sketch to Face contributors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "3D View > Sidebar > Sketch to Face",
    "description": "A drawing of a face becomes a posable 3D face",
    "category": "Mesh",
}

_BUNDLED_CORE = Path(__file__).parent / "core"
_CORE = ("addon", "classifiers", "dataset_gen", "facs_rig", "snakes")  # packages of ours


def _forget() -> None:
    """Drop the modules of an installation that this one has just replaced: Blender goes on running.

    Blender itself forgets an extension's own modules, but not its wheels, and an add-on's neither.
    """
    inside = f"{__name__}."
    old = [n for n in sys.modules if n.partition(".")[0] in _CORE or n.startswith(inside)]
    for name in old:
        # `from . import part` would take it from here
        globals().pop(name.removeprefix(inside), None)
        del sys.modules[name]
    if old:
        # Now, on Blender's own thread: its classes must not be cleared away by a thread of work.
        gc.collect()
    invalidate_caches()


def _find_core() -> bool:
    """Make the core importable, or say in one sentence what is missing.

    Blender puts an extension's wheels on the path by itself. Before 4.2 nobody does, so the
    add-on for those versions brings the core in a folder of its own. It goes to the end of the
    path: what Blender or the artist has installed wins. Returns whether that folder is used.
    """
    if wrong := right_zip.complaint(bpy.app.version):
        raise ImportError(wrong, name=__name__)
    if find_spec("numpy") is None:
        raise ImportError(
            "Sketch to Face needs numpy, which this Blender does not have: install it for "
            "Blender's Python (Debian and Ubuntu: apt install python3-numpy).",
            name=__name__,
        )
    if find_spec("snakes") is not None:
        return False
    if not _BUNDLED_CORE.is_dir():
        raise ImportError(
            "Sketch to Face cannot find its own core: install the zip file that `make addon` "
            "builds instead of this folder.",
            name=__name__,
        )
    sys.path.append(str(_BUNDLED_CORE))
    return True


if __name__.partition(".")[0] not in _CORE:  # installed, not in a checkout
    _forget()

import bpy  # noqa: E402

from . import right_zip  # noqa: E402

_bundled = _find_core()

from . import operators, panels  # noqa: E402  (the core must be found first)
from .background import live, tasks  # noqa: E402
from .messages import reporting, translation  # noqa: E402
from .state import memory, preferences, properties  # noqa: E402
from .state.session import session  # noqa: E402
from .viewport import overlay  # noqa: E402

_MODULES = (
    reporting,
    translation,
    preferences,
    memory,
    properties,
    *operators.MODULES,
    *panels.MODULES,
    overlay,
    live,
    tasks,
)

glTF2_pre_export_callback = operators.export.before_gltf  # noqa: N816  (Blender's name for it)


def register() -> None:
    """Add the tab and its operators to Blender: each module's classes, then what else it needs."""
    if _bundled and str(_BUNDLED_CORE) not in sys.path:  # enabled again after unregister
        sys.path.append(str(_BUNDLED_CORE))
    for module in _MODULES:
        for cls in getattr(module, "CLASSES", ()):
            bpy.utils.register_class(cls)
        if hasattr(module, "attach"):
            module.attach()


def unregister() -> None:
    """Take everything away again, in reverse."""
    for module in reversed(_MODULES):
        if hasattr(module, "detach"):
            module.detach()
        for cls in reversed(getattr(module, "CLASSES", ())):
            bpy.utils.unregister_class(cls)
    session.clear()
    if _bundled and str(_BUNDLED_CORE) in sys.path:
        sys.path.remove(str(_BUNDLED_CORE))
