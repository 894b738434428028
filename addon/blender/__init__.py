"""The Blender shell: a sidebar tab, a button, sliders. Everything it knows comes from the core.

The same folder works as an extension (Blender 4.2 and newer, the core comes as wheels), as an
add-on of older versions (the core lies in a folder `core` beside this file) and as the module
`addon.blender` (the tests). Hence: relative imports inside, absolute ones for the core.
"""

import gc
import sys
from importlib import invalidate_caches
from importlib.util import find_spec

bl_info = {
    "name": "Sketch to Face",
    "author": "Sketch to Face contributors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "3D View > Sidebar > Sketch to Face",
    "description": "A drawing of a face becomes a posable 3D face",
    "category": "Mesh",
}


def _forget_shell() -> bool:
    """Drop the modules of an installation that this one has just replaced: Blender goes on running.

    An add-on's modules stay when it is removed. True if there were any.
    """
    inside = f"{__name__}."
    old = [name for name in sys.modules if name.startswith(inside)]
    for name in old:
        globals().pop(name.removeprefix(inside), None)  # `from . import part` would take it
        del sys.modules[name]
    invalidate_caches()
    return bool(old)


_replaced = _forget_shell()

import bpy  # noqa: E402

from . import own_core, right_zip  # noqa: E402


def _load_core(replaced: bool) -> None:
    """Load the core that came with this shell; ImportError, one sentence, says what is missing.

    replaced : whether another installation was here when Blender started
    """
    if wrong := right_zip.complaint(bpy.app.version):
        raise ImportError(wrong, name=__name__)
    if find_spec("numpy") is None:
        raise ImportError(
            "Sketch to Face needs numpy, which this Blender does not have: install it for "
            "Blender's Python (Debian and Ubuntu: apt install python3-numpy).",
            name=__name__,
        )
    folder = own_core.home()
    if __name__.partition(".")[0] not in own_core.PACKAGES:  # installed, not in a checkout
        replaced |= own_core.forget(folder)
    if replaced:
        # Now, on Blender's own thread: its classes must not be cleared away by a thread of work.
        gc.collect()
    own_core.load(folder)


_load_core(_replaced)

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
    own_core.add_bundled()
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
    own_core.take_bundled_away()
