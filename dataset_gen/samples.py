"""One sample of the data set: a picture and everything that made it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from facs_rig import CONTROL_NAMES, LANDMARKS, Camera, FaceRig, load_rig
from facs_rig.common.errors import InputError

from .conventions import draw_by_convention, face_outline, sample_artist, zoomed
from .linework.lines import KINDS, draw_strokes
from .linework.marks import stroke_lists
from .linework.paper import through
from .linework.strokes import Stroke
from .linework.style import Style
from .page import Page, draw_page
from .sampling import DEFAULT, SCHEMES, Sample, sample_face, sample_rng
from .styles import HAIR

SIZE = 256
ENGINES = ("contours", "conventions", "freestyle")
STROKE_STEP = 3.0  # pixels between the stored points of a stroke
OUTLINE_STEP = 2  # of the points of a region's outline, every so many are stored


@dataclass(frozen=True)
class Recipe:
    """What all samples of a data set have in common.

    strokes : whether each sample keeps the lines that were drawn, as coordinates
    meshes : whether each sample holds the posed mesh, KEY.ply
    """

    seed: int = 0
    scheme: str = DEFAULT
    engine: str = "contours"
    strokes: bool = False
    meshes: bool = False

    def check(self) -> None:
        """InputError for a negative seed, an unknown scheme or engine, or one that cannot draw."""
        if self.seed < 0:
            raise InputError(f"--seed must be at least 0, got {self.seed}")
        if self.engine not in ENGINES:
            raise InputError(
                f"there is no engine '{self.engine}'; choose from: {', '.join(ENGINES)}"
            )
        if self.scheme not in SCHEMES:
            raise InputError(
                f"there is no scheme '{self.scheme}'; choose from: {', '.join(SCHEMES)}"
            )
        _engine(self.engine)


@dataclass(frozen=True)
class Drawn:
    """What an engine makes of a face: its lines in pixels of the camera, and what it tells."""

    lines: list[Stroke]
    camera: Camera
    style: Style
    kinds: tuple[str, ...]
    told: dict


def make_sample(
    seed: int,
    index: int,
    size: int = SIZE,
    scheme: str = DEFAULT,
    engine: str = "contours",
    strokes: bool = False,
    identity: Mapping[str, float] | None = None,
    aus: Mapping[str, float] | None = None,
) -> tuple[NDArray[np.uint8], dict]:
    """Picture (size, size) uint8 and the dictionary of everything that made sample `index`.

    Landmarks are pixels of the picture. `camera` is that of the drawing; a photograph of it may
    be taken at a slant, and `page` (3 x 3) takes the camera's pixels to the picture's.
    identity, aus : who is drawn and what it does, else by lot
    """
    rig = load_rig()
    rng = sample_rng(seed, index)
    draw, drawable = _engine(engine)
    sample = sample_face(rig, rng, size, scheme, drawable, identity, aus)
    vertices = rig.pose(sample.parameters)
    drawn = draw(rig, vertices, sample, np.random.default_rng([seed, index, 1]))
    camera, style = drawn.camera, drawn.style
    page = draw_page(drawn.lines, rig, vertices, camera, style, rng)
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
        "engine": engine,
        **drawn.told,
        "scheme": scheme,
        "detail": sample.detail,
        "kinds": list(drawn.kinds),
        "style": style.to_json(),
        "landmarks": _named(page, camera.project(vertices[rig.landmarks])),
    }
    if "drawn_landmarks" in meta:
        meta["drawn_landmarks"] = _named(page, meta["drawn_landmarks"])
    if "regions" in meta:
        meta["regions"] = {
            name: [through(page.matrix, outline).round(1).tolist() for outline in outlines]
            for name, outlines in meta["regions"].items()
        }
    if strokes:
        meta["strokes"] = stroke_lists(page.strokes, step=STROKE_STEP)
    return page.picture, meta


def _named(page: Page, places: NDArray) -> dict[str, list[float]]:
    """Landmark -> pixel of the picture, of pixels (m, 2) of the camera."""
    return {
        name: [round(float(u), 2), round(float(v), 2)]
        for name, (u, v) in zip(LANDMARKS, through(page.matrix, places), strict=True)
    }


Draw = Callable[[FaceRig, NDArray, Sample, np.random.Generator], Drawn]


def _engine(name: str) -> tuple[Draw, tuple[str, ...]]:
    """What draws a sample, and the kinds of lines it knows; InputError if it cannot draw here."""
    if name == "conventions":
        return _by_convention, KINDS  # the same faces as by contours
    if name == "freestyle":
        from . import freestyle

        told = {"blender": freestyle.version()}
        return partial(_by_lines, freestyle.freestyle_strokes, told), freestyle.DRAWN
    return partial(_by_lines, draw_strokes, {}), KINDS


def _by_lines(
    strokes_of: Callable, told: dict, rig: FaceRig, vertices: NDArray, sample: Sample,
    rng: np.random.Generator,
) -> Drawn:  # fmt: skip
    """By the lines of the face's shape."""
    style = sample.style
    lines = strokes_of(rig, vertices, sample.camera, sample.detail, style.layers, sample.kinds)
    if not any(layer in HAIR for layer in style.layers):
        face = face_outline(rig, vertices, sample.camera, sample.parameters)
        told = {**told, "regions": {"face": [face[::OUTLINE_STEP]]}}
    return Drawn(lines, sample.camera, style, sample.kinds, told)


def _by_convention(
    rig: FaceRig, vertices: NDArray, sample: Sample, rng: np.random.Generator
) -> Drawn:
    """By an artist, drawn by lot from an rng of its own."""
    artist = sample_artist(rng, sample.parameters.identity)
    camera, style = zoomed(sample.camera, artist.room), artist.styled(sample.style)
    lines, places, regions = draw_by_convention(
        rig, vertices, camera, sample.parameters, artist, style.width, rng
    )
    told = {
        "artist": artist.to_json(),
        "hidden": list(artist.hidden),
        "drawn_landmarks": places,
        "regions": {
            name: [outline[::OUTLINE_STEP] for outline in outlines]
            for name, outlines in regions.items()
        },
    }
    return Drawn(lines, camera, style, tuple(sorted({line.kind for line in lines})), told)
