"""Pictures of fits: what is made of sketches, step by step, and that it stays alive."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from addon import pipeline
from addon.drawing import Drawing
from addon.preview import paint
from addon.sheet import captioned, grid
from dataset_gen import Style, draw_strokes
from dataset_gen.generate import make_sample
from dataset_gen.linework import ink
from facs_rig import Camera
from snakes import face_lines, fit_offsets, head_box

SKETCHES = Path(pipeline.__file__).parent / "sketches"
HEIGHT = 420
SEED = 70_001  # of generated faces, as in tests/benchmarks/bench_fit.py
Picture = NDArray[np.uint8]


def rows_of(pictures: list[Picture]) -> Picture:
    """Pictures of one height, one below the other, with paper beside the narrower ones."""
    width = max(p.shape[1] for p in pictures)
    return np.concatenate(
        [np.pad(p, ((0, 8), (0, width - p.shape[1]), (0, 0)), constant_values=255)
         for p in pictures]
    )  # fmt: skip


def shipped_examples() -> Picture:
    """What is made of the sketches that ship with the program."""
    paths = sorted(SKETCHES.glob("*.png"), reverse=True)
    return rows_of([pipeline.preview(pipeline.fit(path)) for path in paths])


def generated_examples() -> Picture:
    """The same of generated drawings, of people and expressions that nobody trained on."""
    chosen = (2, 5, 9, 10, 14)
    drawings = [make_sample(SEED, index, size=400, scheme="sparse")[0] for index in chosen]
    return rows_of([pipeline.preview(pipeline.fit(Drawing.of(d))) for d in drawings])


def living_faces() -> Picture:
    """Fitted faces as drawn, at rest, smiling, with an open mouth, and seen from the side."""
    tiles = []
    for path in sorted(SKETCHES.glob("*.png"), reverse=True):
        face = pipeline.fit(path)
        page = Image.fromarray((255 * face.drawing.image).astype(np.uint8))
        scale = HEIGHT / page.height
        page = page.resize((round(page.width * scale), HEIGHT), Image.Resampling.LANCZOS)
        tiles.append(captioned(_square(np.asarray(page.convert("RGB"))), path.stem))
        ahead = replace(face.parameters, head=(0.0, 0.0, 0.0))
        for words, changed in (
            ("as drawn", face.parameters),
            ("at rest", replace(ahead, aus={})),
            ("smile 5", replace(ahead, aus={"smile": 5.0})),
            ("jaw_open 6", replace(ahead, aus={"jaw_open": 6.0})),
            ("at rest, turned", replace(ahead, aus={}, head=(0.9, 0.0, 0.0))),
        ):
            posed = face.posed(changed)
            camera = Camera.framing(posed, HEIGHT, HEIGHT)
            painted = paint(face.rig, posed, camera, dict(face.parameters.identity))
            tiles.append(captioned(painted, words))
    return grid(tiles, 6)


def _square(picture: Picture) -> Picture:
    """The middle of a picture of HEIGHT rows, as wide as high, on paper."""
    wide = picture.shape[1]
    if wide >= HEIGHT:
        left = (wide - HEIGHT) // 2
        return picture[:, left : left + HEIGHT]
    pad = HEIGHT - wide
    return np.pad(picture, ((0, 0), (pad // 2, pad - pad // 2), (0, 0)), constant_values=255)


def steps_of_both_methods() -> Picture:
    """The way of one sketch, by lines and as in the thesis."""
    path = SKETCHES / "angry_man.png"
    ours = pipeline.fit(path)
    theirs = pipeline.fit(path, pipeline.FitOptions(method="thesis"))
    rig, drawing = ours.rig, ours.drawing.image
    result = fit_offsets(drawing, rig, theirs.parameters, theirs.camera)
    box = head_box(rig.pose(ours.parameters), ours.camera)
    left, top, right, bottom = box
    width = round(HEIGHT * (right - left) / (bottom - top))
    zoom = 2 * np.array([width / (right - left), HEIGHT / (bottom - top)])

    def lines(colours: list[tuple[list[NDArray], str]], ground: NDArray) -> Picture:
        page = Image.fromarray(ground).resize((width * 2, HEIGHT * 2)).convert("RGB")
        draw = ImageDraw.Draw(page)
        for paths, colour in colours:
            for points in paths:
                spots = [tuple(p) for p in (points - [left, top]) * zoom]
                draw.line(spots, fill=colour, width=3)
        return np.asarray(page.resize((width, HEIGHT), Image.Resampling.LANCZOS))

    def of_face(vertices: NDArray, camera: Camera) -> list[NDArray]:
        found = face_lines(rig, vertices, camera, kinds=("contour",))
        return np.split(found.lines.points, found.starts[1:-1])

    ink_of = Image.fromarray((255 * (1 - drawing)).astype(np.uint8))
    sketch = ink_of.crop(tuple(map(round, box)))  # beyond the page there is no ink
    pale = (255 - 0.4 * np.asarray(sketch, float)).astype(np.uint8)
    render = (255 * np.clip(result.render, 0, 1)).astype(np.uint8)
    paper = np.full((HEIGHT, width), 255, np.uint8)
    begin = replace(ours.parameters, aus=ours.detection.expression(), identity={},
                    head=ours.detection.head)  # fmt: skip
    detected = rig.pose(begin)
    close = theirs.camera.cropped(left, top, right, bottom, width, HEIGHT)
    strokes = draw_strokes(rig, theirs.vertices, close, 1)
    fitted = ink(strokes, width, HEIGHT, Style(width=1.8))
    red, blue = "#c02020", "#2060c0"
    tiles = [
        (lines([(of_face(detected, theirs.camera), red)], pale), "lines: the expression as read"),
        (lines([(of_face(rig.pose(ours.parameters), ours.camera), red)], pale),
         "person, head and strength"),
        (lines([(of_face(ours.vertices, ours.camera), red)], pale), "and its skin"),
        (paint(rig, ours.vertices, ours.camera.cropped(*box, width, HEIGHT),
               dict(ours.parameters.identity)), "the fitted face"),
        (lines([(result.contours, "black")], paper), "thesis: contours of the sketch"),
        (lines([(result.contours, blue)], render), "on the expression"),
        (lines([(result.snakes, red)], render), "snakes at rest"),
        (np.repeat(fitted[:, :, None], 3, axis=2), "the fitted face, drawn"),
    ]  # fmt: skip
    return grid([captioned(picture, words) for picture, words in tiles], 4)
