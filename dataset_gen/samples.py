"""One sample of the data set: a picture and everything that made it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facs_rig import CONTROL_NAMES, LANDMARKS, Camera, FaceParameters, FaceRig, load_rig
from facs_rig.common.errors import InputError

from .conventions import Artist, draw_by_convention, face_outline, sample_artist, zoomed
from .conventions.mouth import Mouth
from .conventions.sitter import sit
from .hair_area import Area, area_of, fill
from .hair_lines import hair_lines
from .hair_worn import Worn, wear
from .hairdo import HAIR as HAIRED
from .hairdo import Hairdo, sample_hairdo
from .linework.hidden import Cover
from .linework.lines import KINDS, draw_strokes
from .linework.marks import stroke_lists
from .linework.paper import through
from .linework.strokes import Stroke
from .linework.style import Style
from .page import Page, draw_page
from .sampling import (
    DEFAULT,
    OF_ALL_KINDS,
    SCHEMES,
    Sample,
    sample_face,
    sample_rng,
    second_rng,
)
from .styles import HAIR

SIZE = 256
ENGINES = ("contours", "conventions", "freestyle")
STROKE_STEP = 3.0  # pixels between the stored points of a stroke
MARGIN, WHOLE = 0.02, 0.85  # of the page kept free of hair; share of drawings that hold all of it
OUTLINE_STEP = 2  # of the points of a region's outline, every so many are stored


@dataclass(frozen=True)
class Recipe:
    """What all samples of a data set have in common.

    strokes : whether each sample keeps the lines that were drawn, as coordinates
    meshes : whether each sample holds the posed mesh, KEY.ply
    hair : share of faces that wear a head of hair, as `haired` has it
    """

    seed: int = 0
    scheme: str = DEFAULT
    engine: str = "contours"
    strokes: bool = False
    meshes: bool = False
    hair: float = HAIRED

    def __post_init__(self) -> None:
        object.__setattr__(self, "hair", haired(self.hair, self.scheme, self.engine))

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
    """What an engine makes of a face: its lines in pixels of the camera, and what it tells.

    hair : where a head of hair lies over the face
    """

    lines: list[Stroke]
    camera: Camera
    style: Style
    kinds: tuple[str, ...]
    told: dict
    hair: Area | None = None


def haired(share: float, scheme: str, engine: str) -> float:
    """The share of faces that wear a head of hair where `share` was asked for.

    Conventions have hair of their own, and the older schemes draw as they always did, so that what
    is measured on them compares. InputError for what is no share.
    """
    if not 0 <= share <= 1:
        raise InputError(f"--hair must be from 0 to 1, got {share:g}")
    return share if scheme in OF_ALL_KINDS and engine != "conventions" else 0.0


def make_sample(
    seed: int,
    index: int,
    size: int = SIZE,
    scheme: str = DEFAULT,
    engine: str = "contours",
    strokes: bool = False,
    identity: Mapping[str, float] | None = None,
    aus: Mapping[str, float] | None = None,
    hair: float = HAIRED,
    worn: float = 1.0,
    grins: float | None = None,
    finish: str | None = None,
) -> tuple[NDArray[np.uint8], dict]:
    """Picture (size, size) uint8 and the dictionary of everything that made sample `index`.

    Landmarks are pixels of the picture. `camera` is that of the drawing; a photograph of it may
    be taken at a slant, and `page` (3 x 3) takes the camera's pixels to the picture's.
    identity, aus : who is drawn and what it does, else by lot
    hair : share of faces that wear a head of hair (of `people` and `felt`, not by conventions);
    with 0 some have one of the four old heads of hair
    worn : by conventions, times as often as usual somebody has a beard or a hat rather than none
    grins : share of artists who draw open mouths as comics do, else as is usual in their manner
    finish : by conventions, in which all hair is drawn ("curls", "locks", …), else by lot
    """
    rig = load_rig()
    rng = sample_rng(seed, index)
    artists = partial(sample_artist, worn=worn, grins=grins, finish=finish)
    draw, drawable = _engine(engine, haired(hair, scheme, engine), artists)
    sample = sample_face(rig, rng, size, scheme, drawable, identity, aus)
    vertices = rig.pose(sample.parameters)
    drawn = draw(rig, vertices, sample, second_rng(seed, index))
    camera, style = drawn.camera, drawn.style
    page = draw_page(drawn.lines, rig, vertices, camera, style, rng, drawn.hair)
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


def clenched(record: Mapping[str, Any]) -> bool:
    """Whether the mouth of a sample by conventions is drawn open with teeth that meet."""
    rig, artist, view = load_rig(), Artist.from_json(record["artist"]), record["camera"]
    face = FaceParameters.from_json(record)
    camera = Camera(view["width"], view["height"], view["scale"], view["centre"],
                    view["distance"] or math.inf)  # fmt: skip
    return Mouth(sit(rig, rig.pose(face), camera, face, artist), artist).clenched


def _named(page: Page, places: NDArray) -> dict[str, list[float]]:
    """Landmark -> pixel of the picture, of pixels (m, 2) of the camera."""
    return {
        name: [round(float(u), 2), round(float(v), 2)]
        for name, (u, v) in zip(LANDMARKS, through(page.matrix, places), strict=True)
    }


Draw = Callable[[FaceRig, NDArray, Sample, np.random.Generator], Drawn]


def _engine(
    name: str, hair: float = 0.0, artists: Callable[..., Artist] = sample_artist
) -> tuple[Draw, tuple[str, ...]]:
    """What draws a sample, and the kinds of lines it knows; InputError if it cannot draw here.

    hair : share of faces that wear a head of hair      artists : who draws by conventions
    """
    if name == "conventions":
        return partial(_by_convention, artists), KINDS  # the same faces as by contours
    if name == "freestyle":
        from . import freestyle

        strokes_of: Callable = freestyle.freestyle_strokes
        kinds: tuple[str, ...] = freestyle.DRAWN
        told = {"blender": freestyle.version()}
    else:
        strokes_of, told, kinds = draw_strokes, {}, KINDS
    if hair:
        return partial(_with_hair, hair, strokes_of, told), kinds
    return partial(_by_lines, strokes_of, told), kinds


def _by_lines(
    strokes_of: Callable, told: dict, rig: FaceRig, vertices: NDArray, sample: Sample,
    rng: np.random.Generator,
) -> Drawn:  # fmt: skip
    """By the lines of the face's shape."""
    style = sample.style
    lines = strokes_of(rig, vertices, sample.camera, sample.detail, style.layers, sample.kinds)
    if not any(layer in HAIR for layer in style.layers):
        face = face_outline(rig, vertices, sample.camera)
        told = {**told, "regions": {"face": [face[::OUTLINE_STEP]]}}
    return Drawn(lines, sample.camera, style, sample.kinds, told)


def _with_hair(
    share: float, strokes_of: Callable, told: dict, rig: FaceRig, vertices: NDArray,
    sample: Sample, rng: np.random.Generator,
) -> Drawn:  # fmt: skip
    """By the lines of the face's shape and of a head of hair, which so many of them wear."""
    layers = tuple(layer for layer in sample.style.layers if layer not in HAIR)
    style = replace(sample.style, layers=layers)
    told = {**told, "haired": share, "hair": None}
    hairdo = hairdo_of(sample, share, rng)
    if hairdo is None:
        return _by_lines(strokes_of, told, rig, vertices, replace(sample, style=style), rng)
    worn = wear(rig, vertices, sample.parameters, hairdo)
    camera = _roomy(sample.camera, worn, rng)
    lines = hair_lines(worn, camera, style.width, rng)
    cover = Cover(worn.points, worn.shell.triangles, lines)
    area = area_of(worn, rig, vertices, camera)
    strokes = fill(area, camera, style.width, rng)
    strokes += strokes_of(rig, vertices, camera, sample.detail, style.layers, sample.kinds, cover)
    face = face_outline(rig, vertices, camera)
    told |= {
        "hair": hairdo.to_json(),
        "regions": {"face": [face[::OUTLINE_STEP]], "hair": area.outlines()},
    }
    return Drawn(strokes, camera, style, sample.kinds, told, area)


def hairdo_of(sample: Sample, share: float, rng: np.random.Generator) -> Hairdo | None:
    """What a sample wears, which so many of them do, by lot. rng : the sample's second one"""
    if rng.random() >= share:
        return None
    return sample_hairdo(rng, sample.parameters.identity, sample.style.look)


def _roomy(camera: Camera, worn: Worn, rng: np.random.Generator) -> Camera:
    """The camera with as much more of the page as hair needs, but for what hangs below the head.

    Now and then the page's edge cuts it.
    """
    pixels = camera.project(worn.points)
    w, h = camera.width, camera.height
    left, top = np.maximum(MARGIN * w - pixels.min(axis=0), 0)
    right = max(float(pixels[:, 0].max()) - (1 - MARGIN) * w, 0.0)
    room = max(left + right, top) * rng.uniform(*((1, 1.15) if rng.random() < WHOLE else (0, 1)))
    aside = 0.5 * (room + left - right)
    above = min(room, top + 0.3 * (room - min(room, top)))
    return camera.cropped(-aside, -above, w + room - aside, h + room - above, w, h)


def _by_convention(
    artists: Callable[..., Artist], rig: FaceRig, vertices: NDArray, sample: Sample,
    rng: np.random.Generator,
) -> Drawn:  # fmt: skip
    """By an artist, drawn by lot from an rng of its own."""
    artist = artists(rng, sample.parameters.identity)
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
