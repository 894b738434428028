"""Runs in a clean Blender: installs the zip as an artist would, presses the button, reports.

python install_and_press.py extension|legacy ZIP SKETCH RESULT.json
"""

import json
import sys
import time
from pathlib import Path

import bpy

kind, archive, sketch, result = sys.argv[-4:]
foreign = [m for m in ("scipy", "skimage", "onnxruntime", "PIL", "snakes") if m in sys.modules]
assert not foreign, f"not a clean Blender: {foreign}"

bpy.ops.wm.read_factory_settings(use_empty=True)
if kind == "extension":
    bpy.ops.extensions.package_install_files(
        filepath=archive, repo="user_default", enable_on_install=True
    )
    module = "bl_ext.user_default.sketch_to_face"
else:
    bpy.ops.preferences.addon_install(filepath=archive)
    bpy.ops.preferences.addon_enable(module="sketch_to_face")
    module = "sketch_to_face"
assert module in bpy.context.preferences.addons, f"{module} is not enabled"


def press() -> tuple[float, bpy.types.Object]:
    """Seconds and the new face."""
    bpy.context.scene.sketch_to_face.sketch = sketch
    start = time.perf_counter()
    assert bpy.ops.sketch_to_face.fit() == {"FINISHED"}
    return time.perf_counter() - start, bpy.context.active_object


first, face = press()
told = {
    "blender": bpy.app.version_string,
    "keys": [k.name for k in face.data.shape_keys.key_blocks],
    "files": {
        name: str(Path(sys.modules[name].__file__).resolve())
        for name in ("numpy", "scipy", "skimage", "onnxruntime", "addon", "facs_rig", module)
    },
}
start = time.perf_counter()
assert bpy.ops.mesh.add_facs_face(arkit=True, random_identity=True) == {"FINISHED"}
added = time.perf_counter() - start
told["added"] = [k.name for k in bpy.context.active_object.data.shape_keys.key_blocks]
assert bpy.ops.sketch_to_face.random_expression(seed=1) == {"FINISHED"}
bpy.ops.preferences.addon_disable(module=module)
told["left"] = [n for n in ("Scene", "Object") if hasattr(getattr(bpy.types, n), "sketch_to_face")]
bpy.ops.preferences.addon_enable(module=module)
second, _ = press()
told["seconds"] = {"first press": first, "second press": second, "adding": added}
Path(result).write_text(json.dumps(told))
