"""Blender as a Python module, reset to an empty file before each test."""

from __future__ import annotations

import os
import pickle
import warnings
from hashlib import sha256

import pytest

# Unexpected errors are raised in tests instead of going to the log file.
os.environ.setdefault("SKETCH_TO_FACE_RAISE", "1")

with warnings.catch_warnings():
    # bpy's own start-up scripts are not ours to mend.
    warnings.simplefilter("ignore")
    bpy = pytest.importorskip("bpy", reason="Blender as a module is missing: pip install bpy")

from pathlib import Path  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
SKETCH = ROOT / "addon" / "sketches" / "smiling_woman.png"


@pytest.fixture(autouse=True)
def empty_blender():
    """An empty file, no add-on, and an undo history that starts here."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.ed.undo_push(message="start")


@pytest.fixture
def shell(empty_blender, tmp_path, monkeypatch):
    """The add-on, registered for one test; its log goes to `tmp_path`."""
    import addon.blender as module

    monkeypatch.setattr(module.messages.reporting, "log_path", lambda: tmp_path / "log.txt")
    module.register()
    yield module
    module.unregister()


@pytest.fixture(scope="session")
def kept(tmp_path_factory):
    """Function: opens a file of this name that `make()` has filled: once, for a fit takes long.

    The undo history starts there; the active object comes back.
    """
    folder = tmp_path_factory.mktemp("kept")

    def opened(name, make):
        path = folder / f"{name}.blend"
        if not path.exists():
            make()
            bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=False, copy=True)
        bpy.ops.wm.open_mainfile(filepath=str(path))
        bpy.ops.ed.undo_push(message="start")
        return bpy.context.active_object

    return opened


_FITTED: dict[bytes, object] = {}
MOST_FITTED = 24  # that are kept: each holds some megabytes


@pytest.fixture
def kept_fits(monkeypatch):
    """`pipeline.fit` that fits a loaded drawing with the same options once, for all tests that ask
    for this: they are about what becomes of a fit.

    A fit depends on drawing, options and the shipped weights alone. Those of test_shell,
    test_sources, test_iterate and test_traces are made each time, and so is what is fitted from a
    file. A test of how a fit goes on asks for `fitted_anew`.
    """
    from addon import pipeline
    from addon.drawing import Drawing

    fit = pipeline.fit

    def kept_fit(sketch, options=None, progress=None, detector=None, shaped=None):
        if not isinstance(sketch, Drawing):
            return fit(sketch, options, progress, detector, shaped)
        key = sha256(pickle.dumps((sketch, options))).digest()
        found = _FITTED.pop(key, None)
        if found is None:
            found = fit(sketch, options, progress, detector, shaped)
        elif shaped:
            shaped(found.parameters, found.offsets, found.keys)
        _FITTED[key] = found  # as the last to go
        if len(_FITTED) > MOST_FITTED:
            del _FITTED[next(iter(_FITTED))]
        return found

    monkeypatch.setattr(pipeline, "fit", kept_fit)


@pytest.fixture
def fitted_anew(kept_fits, monkeypatch):
    """No fit is known yet."""
    monkeypatch.setitem(globals(), "_FITTED", {})


@pytest.fixture
def reports(capfd):
    """Function: what operators have reported since it was asked last, as Blender prints it."""

    def read() -> str:
        return capfd.readouterr().out

    read()
    return read


@pytest.fixture(scope="session")
def rig():
    """The rig that ships."""
    from facs_rig import load_rig

    return load_rig()


@pytest.fixture(scope="session")
def sketch() -> Path:
    """A drawing that ships in the repository."""
    return SKETCH


@pytest.fixture
def evaluated():
    """Function: the vertices of an object after keys, modifiers and transforms, core axes."""
    import numpy as np

    def vertices(face):
        bpy.context.view_layer.update()
        graph = bpy.context.evaluated_depsgraph_get()
        graph.update()
        final = face.evaluated_get(graph)
        mesh = final.to_mesh()
        flat = np.empty(3 * len(mesh.vertices), dtype=np.float32)
        mesh.vertices.foreach_get("co", flat)
        final.to_mesh_clear()
        world = np.array(final.matrix_world)
        points = flat.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3]
        return np.stack([points[:, 0], points[:, 2], -points[:, 1]], axis=1)

    return vertices
