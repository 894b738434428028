"""The thesis' simple example: a sphere, which has no face, takes the outline of a drawing.

The sphere is the one of the tests (tests/snakes/ball.py).
"""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from skimage.measure import find_contours

from addon.preview import AMBIENT, LAMPS, PAPER
from addon.sheet import INK, captioned, font, grid
from facs_rig import Camera, FaceParameters, rasterise
from facs_rig.mesh import vertex_normals
from facs_rig.paint import srgb
from facs_rig.raster import barycentric
from snakes import WORKING_SIZE, Fit, Tweakables, fit_offsets

BALL = Path(__file__).parents[1] / "tests" / "snakes" / "ball.py"
DISTANCES = (0.6, 0.8, 1.0)  # cm; the sphere's radius is one centimetre
RADIUS = 0.01  # metres
PANEL = 300  # pixels
FINER = 4
CLAY = (0.62, 0.46, 0.34)
DRAWN, SETTLED = "#1858c8", "#c81818"
COLOURS = ("#e08000", "#109050", "#a020a0")
MESH_LINE = 5  # every fifth line of the mesh is shown
WHOLE = (46, 46, 354, 354)  # pixels of the drawing that a panel shows: left, top, right, bottom
PART = (216, 56, 356, 196)  # and those that are shown enlarged: a dent and a bump

Lines = list[tuple[list[NDArray], str, float]]  # paths (k, 2) in pixels, colour, width


def sphere_example() -> NDArray[np.uint8]:
    """Drawing, model, snakes, deltas; below them what three soft select distances make of it."""
    ball = _ball()
    model, camera = ball.Ball(radius=RADIUS), ball.camera(RADIUS)
    outline = ball.deformed_circle()
    fits = [
        fit_offsets(
            ball.drawn(outline), model, FaceParameters(), camera,
            Tweakables(soft_select_distance=distance),
        )
        for distance in DISTANCES
    ]  # fmt: skip
    near, part = (camera.cropped(*box, PANEL, PANEL) for box in (WHOLE, PART))
    closed = np.concatenate([outline, outline[:1]])
    blank = np.full((PANEL, PANEL, 3), PAPER, np.uint8)
    plain = _clay(model, model.vertices, near)
    settled: Lines = [(fits[0].contours, DRAWN, 1.0), (fits[0].snakes, SETTLED, 1.5)]
    outputs = [model.pose(FaceParameters(), fit.offsets) for fit in fits]
    panels = [
        captioned(_lined(blank, [([closed], INK, 2.2)], WHOLE), "drawing"),
        captioned(_meshed(plain, model, model.vertices, near), "model"),
        captioned(_lined(plain, settled, WHOLE), "snakes: as drawn (blue), at rest (red)"),
        captioned(
            _lined(_faint(_clay(model, model.vertices, part)), _arrows(fits[0]), PART),
            "pixel deltas, enlarged",
        ),
    ]
    for distance, vertices in zip(DISTANCES, outputs, strict=True):
        shown = _meshed(_clay(model, vertices, near), model, vertices, near)
        shown = _lined(shown, [([closed], DRAWN, 1.4)], WHOLE)
        panels.append(captioned(shown, f"output, soft select distance {distance:.1f}"))
    panels.append(captioned(_outlines(model, outputs, part, closed), "the outlines, enlarged"))
    return grid(panels, 4, gap=8)


def _ball():
    spec = importlib.util.spec_from_file_location("ball", BALL)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _clay(model, vertices: NDArray, camera: Camera) -> NDArray[np.uint8]:
    """(h, w, 3) the mesh as if of clay, lit by the lamps of the previews."""
    width, height = camera.width, camera.height
    fine = camera.cropped(0, 0, width, height, width * FINER, height * FINER)
    buffers = rasterise(vertices, model.triangles, fine)
    v, u = np.nonzero(buffers.triangle >= 0)
    owner = buffers.triangle[v, u]
    weights = barycentric(vertices, model.triangles, fine, owner, u + 0.5, v + 0.5)
    corners = vertex_normals(vertices, model.triangles)[model.triangles[owner]]
    normals = np.einsum("kc,kcd->kd", weights, corners)
    light = np.full(len(normals), AMBIENT)
    for direction, strength in LAMPS:
        light += strength * np.clip(normals @ direction / np.linalg.norm(direction), 0, 1)
    picture = np.full((fine.height, fine.width, 3), PAPER, dtype=np.float64)
    picture[v, u] = 255 * srgb(np.array(CLAY) * light[:, None])
    blocks = picture.reshape(height, FINER, width, FINER, 3).mean(axis=(1, 3))
    return np.clip(blocks, 0, 255).astype(np.uint8)


def _faint(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return (0.4 * picture + 0.6 * PAPER).astype(np.uint8)


def _lined(
    ground: NDArray[np.uint8], lines: Lines, box: tuple[float, ...] = (0, 0, PANEL, PANEL)
) -> NDArray[np.uint8]:
    """A picture of `box` with lines over it, which are in the pixels of that box."""
    fine = PANEL * FINER
    page = Image.fromarray(ground).resize((fine, fine))
    draw = ImageDraw.Draw(page)
    zoom = fine / (box[2] - box[0])
    for paths, colour, width in lines:
        for path in paths:
            points = [tuple((point - box[:2]) * zoom) for point in path]
            draw.line(points, fill=colour, width=round(width * FINER), joint="curve")
    return np.asarray(page.resize((PANEL, PANEL), Image.Resampling.BOX))


def _meshed(ground: NDArray, model, vertices: NDArray, camera: Camera) -> NDArray[np.uint8]:
    """The picture with some lines of the mesh that face the viewer, faintly."""
    pixels, facing = camera.project(vertices), vertex_normals(vertices, model.triangles)[:, 2] > 0
    around = np.concatenate([model.grid, model.grid[:, :1]], axis=1)
    paths = [*around[MESH_LINE - 1 :: MESH_LINE], *model.grid.T[::MESH_LINE]]
    pieces = [
        pixels[[a, b]]
        for path in paths
        for a, b in zip(path[:-1], path[1:], strict=True)
        if facing[a] and facing[b]
    ]
    lined = _lined(ground, [(pieces, "#402818", 0.8)])
    return (0.6 * ground + 0.4 * lined).astype(np.uint8)


def _arrows(fit: Fit) -> Lines:
    """The deltas, in pixels of the drawing, as lines that start with a dot on the model."""
    left, top, right, bottom = fit.box
    cell = np.array([right - left, bottom - top]) / WORKING_SIZE
    start = (fit.deltas.pixels + 0.5) * cell + [left, top]
    end = start + fit.deltas.deltas * cell
    dots = [point + np.array([[-0.7, 0], [0.7, 0]]) for point in start]
    shafts = [np.stack(pair) for pair in zip(start, end, strict=True)]
    return [(shafts, SETTLED, 1.2), (dots, INK, 3.0)]


def _outlines(model, outputs: list[NDArray], camera: Camera, closed: NDArray) -> NDArray[np.uint8]:
    """The outlines of drawing, model and outputs in PART, in their colours, with a legend."""
    fine = camera.cropped(0, 0, PANEL, PANEL, PANEL * FINER, PANEL * FINER)

    def silhouette(vertices: NDArray) -> list[NDArray]:
        inside = np.isfinite(rasterise(vertices, model.triangles, fine).depth)
        found = find_contours(inside.astype(float), 0.5)
        return [(path[:, ::-1] + 0.5) / FINER for path in found]

    blank = np.full((PANEL, PANEL, 3), PAPER, np.uint8)
    drawn: Lines = [([closed], "#a8c4f0", 7.0)]
    ours: Lines = [(silhouette(model.vertices), "#909090", 1.4)]
    ours += [
        (silhouette(vertices), colour, 1.8)
        for vertices, colour in zip(outputs, COLOURS, strict=True)
    ]
    page = Image.fromarray(_lined(_lined(blank, drawn, PART), ours))
    draw = ImageDraw.Draw(page)
    names = ["drawing", "model", *(f"{distance:.1f}" for distance in DISTANCES)]
    for row, (name, (_, colour, _)) in enumerate(zip(names, drawn + ours, strict=True)):
        y = PANEL - 92 + 18 * row
        draw.line([(14, y), (40, y)], fill=colour, width=3)
        draw.text((48, y), name, fill=INK, font=font(13), anchor="lm")
    return np.asarray(page)
