"""The layers for drawing that are baked with the head (see facs_rig.curves)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..anatomy import DEEPEST, LIP_LOWER, LIP_UPPER, PART_NAMES
from ..camera import Camera
from ..common.ties import first_least
from ..curves import Curves, head_frame, make_curves
from ..raster import barycentric, rasterise
from .brows import brow_lines
from .hair import CM, STYLES, Head, hair_curves, hairline
from .lashes import lash_lines

EDGE_WIDTH, LASH_WIDTH, HAIR_WIDTH = 1.5, 0.65, 0.6  # shares of a drawing's line width
PIXELS = 10_000.0  # per metre: the line of the lips is found to a tenth of a millimetre
ABOVE_SEAM = 0.0004  # metres: the line between the lips is the upper lip's


def drawing_layers(
    vertices: NDArray,
    triangles: NDArray,
    vertex_part: NDArray,
    eyes_middle: NDArray,
    upright: NDArray,
) -> dict[str, Curves]:
    """Layer -> its curves: brow_hair, lash, lash_lower, lip_line, hairline, and hair_... of styles.

    vertices : (n, 3) of the default face in the source's frame;  triangles : (t, 3) of all parts;
    vertex_part : (n,);  eyes_middle : (3,);  upright : (3, 3), to the rig's frame
    """
    part = {name: vertex_part == k for k, name in enumerate(PART_NAMES)}
    skin = triangles[part["skin"][triangles[:, 0]]]
    frame = head_frame(vertices @ upright, part["skin"])
    edges, uppers, lowers = lash_lines(int(np.argmax(part["lashes"])))
    upper_width = np.array([EDGE_WIDTH] * len(edges) + [LASH_WIDTH] * len(uppers))
    layers = {
        "brow_hair": make_curves(
            frame, brow_lines(int(np.argmax(part["brows"]))), HAIR_WIDTH, taper=True
        ),
        "lash": make_curves(frame, edges + uppers, upper_width, taper=True),
        "lash_lower": make_curves(frame, lowers, LASH_WIDTH, taper=True),
        "lip_line": make_curves(frame, [_lip_line(vertices, skin, eyes_middle)]),
    }
    head = Head(vertices @ upright, skin, eyes_middle @ upright)
    along = head.bind_to_triangles(hairline(head))
    layers["hairline"] = make_curves(frame, [along])
    for name, style in STYLES.items():
        layers[f"hair_{name}"] = hair_curves(style, head, frame)
    return layers


def _lip_line(vertices, triangles, eyes_middle) -> tuple[NDArray, NDArray]:
    """Indices and weights (k, 3) of the line between the lips, on the upper lip.

    Between the lips' borders, seen from the front, it is where the surface lies deepest.
    """
    left, top = (100 * eyes_middle[:2] + [-2.6, -5.0]) * CM
    width, height = round(5.2 * CM * PIXELS), round(3.5 * CM * PIXELS)
    camera = Camera(width, height, (PIXELS, PIXELS), (-left * PIXELS, top * PIXELS))
    seen = rasterise(vertices, triangles, camera)
    column = np.linspace(-2.14, 2.14, 45)
    borders = [np.array(points) for points in (LIP_UPPER, LIP_LOWER)]
    above, below = (np.interp(np.abs(column), line[:, 0], line[:, 1]) for line in borders)
    u = np.round((column + 2.6) * CM * PIXELS, 6).astype(int)
    rows = np.arange(height)[:, None]
    y = -5.0 - (rows + 0.5) / PIXELS / CM
    between = (y < above - 0.1 * (above - below)) & (y > below + 0.15 * (above - below))
    depth = seen.depth[:, u]
    # What is seen through a slit between the lips, or nothing at all, is no lip.
    lip = depth > np.where(between, depth, -np.inf).max(axis=0) - DEEPEST
    seam = first_least(np.where(between & lip, depth, np.inf), axis=0)
    smooth = np.polynomial.Polynomial.fit(column, seam, 8)(column)
    v = np.round(smooth - ABOVE_SEAM * PIXELS).astype(int)
    v = first_least(np.where(lip, np.abs(rows - v), np.inf), axis=0)
    owner = seen.triangle[v, u]
    return triangles[owner], barycentric(vertices, triangles, camera, owner, u + 0.5, v + 0.5)
