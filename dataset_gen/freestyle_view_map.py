"""Freestyle's view map of a face: the one place of the data set that talks to Blender.

A scene of its own holds the posed face and a camera that sees what `facs_rig.Camera` sees. A render
engine that renders nothing makes Blender build Freestyle's view map, and a script of ours walks
through it: every edge of it knows its kind, how many surfaces hide it and the places in space of
its points. No stroke of Freestyle's is ever made: its stroke operators keep memory from one
picture to the next, reading the view map keeps none.

bpy is imported inside functions alone. Works in Blender 3.4 and later, in a window, with
`blender -b`, or with Blender as a Python module.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import IntFlag
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facs_rig import Camera
from facs_rig.common.errors import InputError

OLDEST = (3, 4, 0)
UNITS = 10.0  # Blender units a metre: Freestyle's own tolerances are made for models of that size
FAR = 4.0  # metres from the origin to the orthographic camera
NAME = "Sketch to Face Freestyle"


class Nature(IntFlag):
    """What an edge of a view map is, as Freestyle says it."""

    SILHOUETTE, BORDER, CREASE, RIDGE, VALLEY, SUGGESTIVE = (1 << k for k in range(6))


@dataclass(frozen=True)
class ViewMap:
    """The edges of a view map, cut into straight pieces.

    start, end : (e, 3) metres, in the axes of the face        nature : (e,) int, bits of Nature
    hidden : (e,) int, how many surfaces lie between the eye and the piece (-1 : not known)
    """

    start: NDArray
    end: NDArray
    nature: NDArray[np.int64]
    hidden: NDArray[np.int64]


def blender() -> ModuleType:
    """The module bpy; InputError if it is missing, too old or built without Freestyle."""
    if "bpy" not in sys.modules:
        # A worker process is given its parent's sys.path, at the head of which Blender has put
        # the Python half of bpy.
        sys.path[:] = [p for p in sys.path if not Path(p, "bpy", "ops.py").is_file()]
    try:
        import bpy
    except ImportError:
        raise InputError(
            "the engine 'freestyle' needs Blender: pip install 'sketch-to-face[blender]', "
            "or start it as blender -b -P dataset_gen/blender_batch.py"
        ) from None
    if bpy.app.version < OLDEST:
        raise InputError(
            f"the engine 'freestyle' needs Blender 3.4 or later, this is {bpy.app.version_string}"
        )
    if not bpy.app.build_options.freestyle:
        raise InputError(
            "this Blender was built without Freestyle; take another one or the engine 'contours'"
        )
    return bpy


def version() -> str:
    """Which Blender draws, e.g. "5.0.1": the same bytes are promised within one version."""
    return ".".join(map(str, blender().app.version))


def view_map(
    vertices: NDArray,
    triangles: NDArray,
    camera: Camera,
    shells: list[tuple[NDArray, NDArray]] | None = None,
    ridges: bool = False,
) -> ViewMap:
    """Freestyle's view map of a mesh: outlines, borders, creases, suggestive contours (and ridges).

    vertices : (n, 3) metres;  triangles : (t, 3) int;  shells : further (points, triangles) that
    hide what is behind them and draw no line
    """
    bpy = blender()
    _register(bpy)
    scene = bpy.data.scenes.new(NAME)
    made: list[Any] = []
    try:
        depth = _place_camera(bpy, scene, camera, made)
        for k, (points, corners) in enumerate([(vertices, triangles), *(shells or [])]):
            _place_mesh(bpy, scene, "shell" if k else "face", points, corners, made)
        script = bpy.data.texts.new(NAME)
        made.append((bpy.data.texts, script))
        script.from_string(f"import sys\nsys.modules[{__name__!r}]._walk()\n")
        _settings(scene, script, ridges)
        pieces = _render(bpy, scene)
    finally:
        bpy.data.scenes.remove(scene)
        for owner, block in reversed(made):
            owner.remove(block)
    if not len(pieces):
        return ViewMap(*np.zeros((2, 0, 3)), *np.zeros((2, 0), dtype=np.int64))
    ends = pieces[:, :6].reshape(-1, 2, 3) / UNITS + [0.0, 0.0, depth]
    kinds = pieces[:, 6:].astype(np.int64)
    return ViewMap(ends[:, 0], ends[:, 1], kinds[:, 0], kinds[:, 1])


# --- what Blender needs ---------------------------------------------------------------------------


def _register(bpy: ModuleType) -> None:
    """Register the render engine that renders nothing, once in a Blender."""
    if bpy.types.RenderEngine.bl_rna_get_subclass_py("SKETCH_TO_FACE_freestyle"):
        return

    class Nothing(bpy.types.RenderEngine):  # type: ignore[name-defined]
        """Renders nothing, so that Freestyle's view map is all the time that a picture takes."""

        bl_idname = "SKETCH_TO_FACE_freestyle"
        bl_label = "Sketch to Face lines"
        bl_use_custom_freestyle = True

        def render(self, depsgraph: Any) -> None:
            size = depsgraph.scene.render
            # without a result Blender falls over
            self.end_result(self.begin_result(0, 0, size.resolution_x, size.resolution_y))

    Nothing.__name__ = "SKETCH_TO_FACE_freestyle"
    bpy.utils.register_class(Nothing)


def _place_mesh(
    bpy: ModuleType, scene: Any, name: str, points: NDArray, triangles: NDArray, made: list
) -> None:
    """An object of the scene with smooth faces; `made` gets what has to be removed again."""
    used, corners = np.unique(triangles, return_inverse=True)
    mesh = bpy.data.meshes.new(name)
    made.append((bpy.data.meshes, mesh))
    mesh.vertices.add(len(used))
    mesh.vertices.foreach_set("co", (points[used] * UNITS).astype(np.float32).ravel())
    mesh.loops.add(3 * len(triangles))
    mesh.loops.foreach_set("vertex_index", corners.astype(np.int32).ravel())
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * len(triangles), 3, dtype=np.int32))
    if bpy.app.version < (4, 1):  # later ones know it from the next polygon's start
        mesh.polygons.foreach_set("loop_total", np.full(len(triangles), 3, dtype=np.int32))
    mesh.polygons.foreach_set("use_smooth", np.ones(len(triangles), dtype=bool))
    mesh.update(calc_edges=True)
    thing = bpy.data.objects.new(name, mesh)
    made.append((bpy.data.objects, thing))
    scene.collection.objects.link(thing)


def _place_camera(bpy: ModuleType, scene: Any, camera: Camera, made: list) -> float:
    """A camera that sees the picture of `camera`; returns its z in metres.

    Blender's camera looks along -z as ours does, so the face keeps its axes. The picture's
    pixels may be oblong; Blender's are square, which only Freestyle itself gets to see.
    """
    width, height = camera.width / camera.scale[0], camera.height / camera.scale[1]  # metres
    right = (camera.width / 2 - camera.centre[0]) / camera.scale[0]
    up = (camera.centre[1] - camera.height / 2) / camera.scale[1]
    data = bpy.data.cameras.new(NAME)
    made.append((bpy.data.cameras, data))
    longer = max(width, height)
    data.sensor_fit = "AUTO"
    data.clip_start, data.clip_end = 0.01 * UNITS, 100.0 * UNITS
    if np.isinf(camera.distance):
        data.type, data.ortho_scale, depth = "ORTHO", longer * UNITS, FAR
    else:
        data.type, depth = "PERSP", camera.distance
        data.lens = data.sensor_width * depth / longer
    data.shift_x, data.shift_y = right / longer, up / longer
    eye = bpy.data.objects.new(NAME, data)
    made.append((bpy.data.objects, eye))
    eye.location = (0.0, 0.0, depth * UNITS)
    scene.collection.objects.link(eye)
    scene.camera = eye
    size = scene.render
    size.resolution_percentage = 100
    size.resolution_x = max(4, round(256 * width / longer))
    size.resolution_y = max(4, round(256 * height / longer))
    return depth


def _settings(scene: Any, script: Any, ridges: bool) -> None:
    scene.render.engine = "SKETCH_TO_FACE_freestyle"
    scene.render.use_freestyle = True
    scene.render.use_compositing = scene.render.use_sequencer = False
    layer = scene.view_layers[0]
    layer.use_freestyle = True
    freestyle = layer.freestyle_settings
    freestyle.mode = "SCRIPT"
    module = freestyle.modules.new()
    module.script, module.use = script, True
    freestyle.use_smoothness = True  # outlines run through the faces, not along mesh edges
    freestyle.use_culling = False
    if hasattr(freestyle, "use_advanced_options"):
        freestyle.use_advanced_options = True
    freestyle.crease_angle = np.radians(120)
    # The nearest triangles alone: four times as quick as 1, and no fold of a finely divided mouth
    # is averaged away with the length of a mean edge.
    freestyle.sphere_radius = 0.0
    freestyle.kr_derivative_epsilon = -1000.0  # all of them: its test cuts lines into dashes
    freestyle.use_suggestive_contours = True
    freestyle.use_ridges_and_valleys = ridges
    freestyle.use_material_boundaries = False


_walked: list[list[float]] = []
_fault: list[BaseException] = []


def _render(bpy: ModuleType, scene: Any) -> NDArray:
    """(e, 8) start, end, nature and hiding surfaces of all pieces, in Blender's camera space."""
    _walked.clear()
    _fault.clear()
    with _silence() as said, _scripts_allowed(bpy):
        bpy.ops.render.render(scene=scene.name)
    if _fault:
        raise InputError(f"Freestyle's view map cannot be read: {_fault[0]!r}") from _fault[0]
    out = np.array(_walked, dtype=np.float64).reshape(-1, 8)
    _walked.clear()
    if "cripts disabled" in said[0]:
        raise InputError("Freestyle did not run: start Blender with --enable-autoexec")
    if not len(out) and "rror" in said[0].replace("Error: strokes set empty", ""):
        raise InputError("Freestyle did not run: " + said[0].strip().splitlines()[-1])
    return out


def _walk() -> None:
    """Read the view map that Freestyle has just built; Blender calls it while rendering."""
    try:
        from freestyle.predicates import TrueUP1D  # type: ignore[import-not-found]
        from freestyle.types import Operators  # type: ignore[import-not-found]

        Operators.select(TrueUP1D())
        for k in range(Operators.get_view_edges_size()):
            edge = Operators.get_viewedge_from_index(k)
            if edge.viewshape.name != "face":
                continue
            what = [float(int(edge.nature)), float(edge.qi)]
            piece, last = edge.first_fedge, edge.last_fedge.id
            end = (last.first, last.second)
            while piece is not None:
                ends = [*piece.first_svertex.point_3d, *piece.second_svertex.point_3d]
                _walked.append(ends + what)
                here = piece.id
                if (here.first, here.second) == end:
                    break
                piece = piece.next_fedge
    except BaseException as error:  # Freestyle would print it and go on
        _fault.append(error)


@contextmanager
def _scripts_allowed(bpy: ModuleType) -> Iterator[None]:
    """Blender 5.2 runs a style module only where scripts may run by themselves; `_walk` is ours."""
    paths = bpy.context.preferences.filepaths
    before = paths.use_scripts_auto_execute
    paths.use_scripts_auto_execute = True
    try:
        yield
    finally:
        paths.use_scripts_auto_execute = before


@contextmanager
def _silence() -> Iterator[list[str]]:
    """Keep back what Blender itself prints, a line for each picture; yields where it is put."""
    said = [""]
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            stream.flush()
    kept = [os.dup(1), os.dup(2)]
    with tempfile.TemporaryFile() as file:
        try:
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
            yield said
        finally:
            for stream in (sys.stdout, sys.stderr):
                if stream is not None:
                    stream.flush()
            for number, descriptor in enumerate(kept, start=1):
                os.dup2(descriptor, number)
                os.close(descriptor)
            file.seek(0)
            said[0] = file.read().decode(errors="replace")
