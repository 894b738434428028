"""One sample of the data set: a picture and everything that made it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from facs_rig import CONTROL_NAMES, LANDMARKS, load_rig

from .linework.lines import KINDS, draw_strokes
from .linework.marks import stroke_lists
from .linework.paper import through
from .page import draw_page
from .sampling import SCHEMES, sample_face, sample_rng

SIZE = 256
ENGINES = ("contours", "freestyle")
STROKE_STEP = 3.0  # pixels between the stored points of a stroke


@dataclass(frozen=True)
class Recipe:
    """What all samples of a data set have in common.

    strokes : whether each sample keeps the lines that were drawn, as coordinates
    meshes : whether each sample holds the posed mesh, KEY.ply
    """

    seed: int = 0
    scheme: str = "sparse"
    engine: str = "contours"
    strokes: bool = False
    meshes: bool = False

    def check(self) -> None:
        """ValueError for a negative seed, an unknown scheme or engine, or one that cannot draw."""
        if self.seed < 0:
            raise ValueError(f"--seed must be at least 0, got {self.seed}")
        if self.engine not in ENGINES:
            raise ValueError(
                f"there is no engine '{self.engine}'; choose from: {', '.join(ENGINES)}"
            )
        if self.scheme not in SCHEMES:
            raise ValueError(
                f"there is no scheme '{self.scheme}'; choose from: {', '.join(SCHEMES)}"
            )
        _engine(self.engine)


def make_sample(
    seed: int,
    index: int,
    size: int = SIZE,
    scheme: str = "sparse",
    engine: str = "contours",
    strokes: bool = False,
) -> tuple[NDArray[np.uint8], dict]:
    """Picture (size, size) uint8 and the dictionary of everything that made sample `index`.

    Landmarks are pixels of the picture. `camera` is that of the drawing; a photograph of it may
    be taken at a slant, and `page` (3 x 3) takes the camera's pixels to the picture's.
    """
    rig = load_rig()
    rng = sample_rng(seed, index)
    draw, drawable, told = _engine(engine)
    sample = sample_face(rig, rng, size, scheme, drawable)
    camera, style = sample.camera, sample.style
    vertices = rig.pose(sample.parameters)
    lines = draw(rig, vertices, camera, sample.detail, style.layers, sample.kinds)
    page = draw_page(lines, rig, vertices, camera, style, rng)
    places = through(page.matrix, camera.project(vertices[rig.landmarks]))
    parameters = sample.parameters.to_json()
    meta = {
        **parameters,
        "aus": {name: round(parameters["aus"].get(name, 0.0), 4) for name in CONTROL_NAMES},
        "camera": {
            "width": camera.width,
            "height": camera.height,
            "scale": list(camera.scale),
            "centre": list(camera.centre),
            "distance": None if math.isinf(camera.distance) else camera.distance,
        },
        "page": page.matrix.round(9).tolist(),
        "seed": seed,
        "index": index,
        **told,
        "scheme": scheme,
        "detail": sample.detail,
        "kinds": list(sample.kinds),
        "style": style.to_json(),
        "landmarks": {
            name: [round(float(u), 2), round(float(v), 2)]
            for name, (u, v) in zip(LANDMARKS, places, strict=True)
        },
    }
    if strokes:
        meta["strokes"] = stroke_lists(page.strokes, step=STROKE_STEP)
    return page.picture, meta


def _engine(name: str) -> tuple[Callable, tuple[str, ...], dict[str, str]]:
    """What draws, the kinds of lines it knows, and what a sample tells of it.

    ValueError if it cannot draw here.
    """
    if name == "freestyle":
        from . import freestyle

        told = {"engine": name, "blender": freestyle.version()}
        return freestyle.freestyle_strokes, freestyle.DRAWN, told
    return draw_strokes, KINDS, {"engine": name}
