"""The pictures of docs/dataset.md: what the sampler draws, in bars and in faces."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from tables import degrees, drawn, identities, strengths

from addon.sheet import INK, LAYERS, PAPER, blank, captioned, close_up, font, grid, seen_from
from dataset_gen import Style, draw_strokes
from dataset_gen.conventions import CONVENTIONS, Artist, draw_by_convention, zoomed
from dataset_gen.generate import make_sample
from dataset_gen.linework import ink
from dataset_gen.linework.lines import DETAILS, WAYS
from dataset_gen.sampling import Sample
from facs_rig import Camera, FaceParameters, load_rig
from facs_rig.common.errors import InputError

Picture = NDArray[np.uint8]  # (h, w, 3)
Samples = Sequence[Sample]


def grey(picture: NDArray) -> Picture:
    """A grey picture (h, w) as (h, w, 3), no lighter than the paper."""
    return np.repeat(np.minimum(picture, PAPER)[:, :, None], 3, axis=2)


def page_of_drawings(engine: str = "contours") -> Picture:
    """The first samples of the data set with seed 0."""
    pictures = [make_sample(0, k, engine=engine)[0] for k in range(18)]
    return grid([np.repeat(p[:, :, None], 3, axis=2) for p in pictures], 6, gap=6)


# --- conventions ----------------------------------------------------------------------------------

# Feature -> what the face does, and the window around it in shares of the page: left, top, size.
SCHEMES = ("people", "thesis")
CLOSE = {
    "eye": ({}, (0.40, 0.22, 0.28)),
    "brow": ({"frontalis": 2.0}, (0.40, 0.18, 0.28)),
    "nose": ({}, (0.43, 0.34, 0.28)),
    "mouth": ({"smile": 2.0}, (0.42, 0.46, 0.28)),
    "open": ({"jaw_open": 1.6, "smile": 3.0}, (0.42, 0.46, 0.28)),
    "finish": ({"smile": 2.0}, (0.2, 0.04, 0.72)),
}
DRAWN_PAGE, DRAWN_CELL = 900, 150


def drawn_features() -> Picture:
    """Each feature of one face by some of its conventions, named."""
    rig, columns = load_rig(), 6
    rows = []
    for feature, (aus, window) in CLOSE.items():
        person = {"gender": 0.5, "age": 0.2, "eye_size": 0.3}
        face = FaceParameters(dict(aus), person, (np.radians(12), 0.0, 0.0))
        vertices = rig.pose(face)
        camera = Camera.framing(rig.extent(face), DRAWN_PAGE, DRAWN_PAGE, 0.1)
        ways = [way for way in CONVENTIONS[feature] if way != "none"]
        row = []
        for way in ways[:columns]:
            artist = replace(Artist(clothes="none", room=1.0, cut="swept"), **{feature: way})
            strokes, *_ = draw_by_convention(
                rig, vertices, zoomed(camera, 1.25 if feature == "finish" else 1.0), face, artist,
                4.0, np.random.default_rng(1),
            )  # fmt: skip
            picture = ink(strokes, DRAWN_PAGE, DRAWN_PAGE, Style(width=4.0, taper=0.5))
            left, top, size = (int(share * DRAWN_PAGE) for share in window)
            part = Image.fromarray(picture[top : top + size, left : left + size])
            part = part.resize((DRAWN_CELL, DRAWN_CELL), Image.Resampling.LANCZOS)
            row.append(captioned(grey(np.asarray(part)), f"{feature}: {way}", 15))
        row += [blank(DRAWN_CELL, row[0].shape[0])] * (columns - len(row))
        rows.append(np.concatenate(row, axis=1))
    return np.concatenate(rows)


# --- ways to draw ---------------------------------------------------------------------------------

OLD = {"gender": 0.9, "age": 1.0, "african": 0.0, "asian": 0.0, "caucasian": 1.0, "weight": 0.2,
       "wrinkles": 0.7}  # fmt: skip
YOUNG = {"gender": 0.15, "age": 0.1, "african": 0.7, "asian": 0.1, "caucasian": 0.2}
MAN = {"gender": 0.85, "age": 0.35, "african": 0.0, "asian": 0.8, "caucasian": 0.2}
FACES = {  # the face, and how far it is turned to its own left, in degrees
    "an old man smiles": (FaceParameters({"smile": 4.5, "outer_squint": 3.0}, OLD), 0.0),
    "brows raised": (FaceParameters({"frontalis": 5.0, "lid_raise": 2.0}, YOUNG), 35.0),
    "a wince": (FaceParameters({"wince": 5.0, "brow_furrow": 3.0, "squint": 3.0}, MAN), 0.0),
}


def ways() -> Picture:
    """Three faces by the thesis' three levels, and by the other ways at the middle level."""
    rig, size = load_rig(), 300
    columns = [("levels", detail) for detail in range(len(DETAILS))]
    columns += [(way, 1) for way in WAYS if way != "levels"]
    rows = []
    for face, yaw in FACES.values():
        camera = close_up(rig, yaw, size, dict(face.identity))
        vertices = seen_from(rig.pose(face), yaw)
        row = []
        for way, detail in columns:
            strokes = draw_strokes(rig, vertices, camera, detail, LAYERS, WAYS[way][detail])
            row.append(grey(ink(strokes, camera.width, camera.height, Style(width=1.5))))
        rows.append(row)
    width = max(row[0].shape[1] for row in rows) + 4
    padded = [np.concatenate([_wide(p, width) for p in row], axis=1) for row in rows]
    names = []
    for way, detail in columns:
        name = captioned(blank(width, 1), f"{way}, {DETAILS[detail]}", 19)
        names.append(captioned(name, ", ".join(WAYS[way][detail]), 15))
    return np.concatenate([np.concatenate(names, axis=1), *padded])


def _wide(picture: Picture, width: int) -> Picture:
    """The picture in the middle of a wider one."""
    left = (width - picture.shape[1]) // 2
    sides = ((0, 0), (left, width - picture.shape[1] - left), (0, 0))
    return np.pad(picture, sides, constant_values=PAPER)


# --- histograms -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Chart:
    """A number of the samples, its bars from `low` to `high`, and where its axis is labelled."""

    title: str
    values: Callable[[Samples], NDArray]
    low: float
    high: float
    step: float
    ticks: tuple[float, ...]


def angles(part: str, axis: int) -> Callable[[Samples], NDArray]:
    return lambda samples: degrees(samples, part)[:, axis]


def looking(samples: Samples) -> NDArray:
    """Yaw of the eyes that look aside."""
    gaze = degrees(samples, "gaze")
    return gaze[gaze.any(axis=1), 0]


def person(name: str) -> Callable[[Samples], NDArray]:
    return lambda samples: identities(samples, name)


def strength(samples: Samples) -> NDArray:
    values = strengths(samples)
    return values[values > 0]


def widths(samples: Samples) -> NDArray:
    return np.array([sample.style.width for sample in samples])


CHARTS = (
    Chart("head: yaw, degrees", angles("head", 0), -55, 55, 5, (-50, -25, 0, 25, 50)),
    Chart("head: pitch, degrees", angles("head", 1), -32.5, 32.5, 2.5, (-25, 0, 25)),
    Chart("head: roll, degrees", angles("head", 2), -32.5, 32.5, 2.5, (-25, 0, 25)),
    Chart("eyes that look aside: yaw, degrees", looking, -52.5, 52.5, 5, (-50, -25, 0, 25, 50)),
    Chart("actions in a drawing, of 47", lambda s: (strengths(s) > 0).sum(axis=1), -0.5, 47.5, 1,
          (0, 10, 20, 30, 40)),
    Chart("strength of an action, of 10", strength, 0.25, 6.25, 0.5, (1, 2, 3, 4, 5, 6)),
    Chart("gender: female 0, male 1", person("gender"), 0, 1, 0.1, (0, 0.5, 1)),
    Chart("age: six -1, 25 years 0, 90 years 1", person("age"), -1, 1, 0.1, (-1, 0, 1)),
    Chart("weight, of -1 to 1", person("weight"), -1, 1, 0.1, (-1, 0, 1)),
    Chart("asian share, the others alike", person("asian"), 0, 1, 0.1, (0, 0.5, 1)),
    Chart("creases, of -1 to 1", person("wrinkles"), -1, 1, 0.1, (-1, 0, 1)),
    Chart("width of a full line, pixels", widths, 0.8, 3.6, 0.2, (1, 2, 3)),
)  # fmt: skip
FILLED, LINE, RULE = "#a9bfd6", "#b03020", "#d8d8d8"
ZOOM = 3  # drawn so much larger, then made smaller: smooth letters and lines
CELL = (300, 190)


def histograms() -> Picture:
    """What is drawn by lot: bars of the scheme people, a line of the thesis'."""
    cells = [histogram(chart) for chart in CHARTS]
    return np.concatenate([legend(4 * CELL[0]), grid(cells, 4)])


def shares(chart: Chart, scheme: str) -> NDArray:
    """Percent of the values in each bar; nothing lies outside."""
    count = round((chart.high - chart.low) / chart.step)
    values = np.asarray(chart.values(drawn(scheme)), float)
    if not chart.low <= values.min() <= values.max() <= chart.high:
        raise InputError(f"'{chart.title}' has values from {values.min()} to {values.max()}")
    bars, _ = np.histogram(values, np.linspace(chart.low, chart.high, count + 1))
    return 100 * bars / len(values)


def histogram(chart: Chart) -> Picture:
    """One chart, (h, w, 3) of CELL."""
    width, height = (ZOOM * side for side in CELL)
    page = Image.new("RGB", (width, height), (PAPER,) * 3)
    draw = ImageDraw.Draw(page)
    people, thesis = (shares(chart, scheme) for scheme in SCHEMES)
    left, right, top, bottom = 40 * ZOOM, width - 14 * ZOOM, 34 * ZOOM, height - 32 * ZOOM
    most = max(people.max(), thesis.max())
    mark = max(m for m in (2, 5, 10, 20, 50) if m <= most)
    letters, title = font(13 * ZOOM), font(14 * ZOOM)

    def u(value: float) -> float:
        return left + (value - chart.low) / (chart.high - chart.low) * (right - left)

    def v(share: float) -> float:
        return bottom - share / most * (bottom - top)

    edges = chart.low + chart.step * np.arange(len(people) + 1)
    draw.text((left, 14 * ZOOM), chart.title, fill=INK, font=title, anchor="lm")
    draw.line([(left, v(mark)), (right, v(mark))], fill=RULE, width=ZOOM)
    draw.text((left - 5 * ZOOM, v(mark)), f"{mark} %", fill=INK, font=letters, anchor="rm")
    for k, share in enumerate(people):
        if share:
            draw.rectangle([u(edges[k]) + ZOOM, v(share), u(edges[k + 1]) - 1, bottom], fill=FILLED)
    steps = [(u(edges[0]), bottom)]
    for k, share in enumerate(thesis):
        steps += [(u(edges[k]), v(share)), (u(edges[k + 1]), v(share))]
    draw.line([*steps, (u(edges[-1]), bottom)], fill=LINE, width=round(1.5 * ZOOM))
    draw.line([(left, bottom), (right, bottom)], fill=INK, width=ZOOM)
    for tick in chart.ticks:
        draw.line([(u(tick), bottom), (u(tick), bottom + 4 * ZOOM)], fill=INK, width=ZOOM)
        place = (u(tick), bottom + 14 * ZOOM)
        draw.text(place, f"{tick:g}", fill=INK, font=letters, anchor="mm")
    return np.asarray(page.resize(CELL, Image.Resampling.LANCZOS))


def legend(width: int) -> Picture:
    """(h, w, 3) which colour is which scheme."""
    height = 40
    page = Image.new("RGB", (ZOOM * width, ZOOM * height), (PAPER,) * 3)
    draw, letters, middle = ImageDraw.Draw(page), font(15 * ZOOM), ZOOM * height / 2
    at = 40 * ZOOM
    box = [at, middle - 7 * ZOOM, at + 22 * ZOOM, middle + 7 * ZOOM]
    draw.rectangle(box, fill=FILLED)
    at += 30 * ZOOM
    draw.text((at, middle), SCHEMES[0], fill=INK, font=letters, anchor="lm")
    at += draw.textlength(SCHEMES[0], font=letters) + 30 * ZOOM
    draw.line([(at, middle), (at + 22 * ZOOM, middle)], fill=LINE, width=2 * ZOOM)
    at += 30 * ZOOM
    text = f"{SCHEMES[1]}        height: percent of drawings; of actions, for their strength"
    draw.text((at, middle), text, fill=INK, font=letters, anchor="lm")
    return np.asarray(page.resize((width, height), Image.Resampling.LANCZOS))
