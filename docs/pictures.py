"""Make every picture of the documentation anew, but the photograph of Blender's window.

    make pictures
    python docs/pictures.py controls drawings      # some of them

The window's photograph comes from `tests/blender/window` (see docs/development.md).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from addon import pipeline
from addon.preview import paint
from dataset_gen import Style, draw_strokes, ink
from dataset_gen.generate import make_sample
from facs_rig import CONTROLS, DETECTED, Camera, FaceParameters, load_rig
from snakes import head_box

IMAGES = Path(__file__).parent / "images"
SKETCHES = Path(pipeline.__file__).parent / "sketches"
CAPTION = 18  # pixels


def captioned(picture: NDArray, text: str) -> NDArray:
    """A picture (h, w) or (h, w, 3) with a line of text under it, as (h, w, 3)."""
    if picture.ndim == 2:
        picture = np.repeat(picture[:, :, None], 3, axis=2)
    page = Image.new("RGB", (picture.shape[1], picture.shape[0] + CAPTION), "white")
    page.paste(Image.fromarray(picture), (0, 0))
    draw = ImageDraw.Draw(page)
    font = ImageFont.load_default(12)
    width = draw.textlength(text, font=font)
    place = ((page.width - width) / 2, picture.shape[0])
    draw.text(place, text, fill="black", font=font)
    return np.asarray(page)


def sheet(pictures: list[NDArray], columns: int) -> NDArray:
    """Pictures of one size in rows of `columns`."""
    blank = np.full_like(pictures[0], 255)
    pictures = pictures + [blank] * (-len(pictures) % columns)
    rows = [np.concatenate(pictures[k : k + columns], 1) for k in range(0, len(pictures), columns)]
    return np.concatenate(rows)


def save(name: str, picture: NDArray) -> None:
    IMAGES.mkdir(exist_ok=True)
    Image.fromarray(picture).save(IMAGES / name, optimize=True)
    print(f"docs/images/{name}  {picture.shape[1]}x{picture.shape[0]}")


def portrait(size: int) -> Camera:
    """A camera that fills a square with the default head."""
    neutral = load_rig().neutral()
    return Camera.framing(neutral[neutral[:, 1] > -0.1], size, size, 0.02)


def controls() -> None:
    """All 47 controls at full natural activation, and at rest."""
    rig, camera = load_rig(), portrait(180)
    pictures = [captioned(paint(rig, rig.pose(FaceParameters()), camera), "at rest")]
    for control in CONTROLS:
        posed = rig.pose(FaceParameters({control.name: 5.0}))
        text = f"{control.name} ({'+'.join(control.aus)})"
        pictures.append(captioned(paint(rig, posed, camera), text))
    save("controls.png", sheet(pictures, 8))


def creases() -> None:
    """The twelve detected controls as line drawings: it is by their creases that they show."""
    rig, camera = load_rig(), portrait(256)
    pictures = []
    for name in ("", *DETECTED):
        posed = rig.pose(FaceParameters({name: 5.0} if name else {}))
        picture = ink(draw_strokes(rig, posed, camera, 1), 256, 256)
        pictures.append(captioned(picture, name or "at rest"))
    posed = rig.pose(FaceParameters({"smile": 5.0, "squint": 3.0}, {"age": 0.9}, (0.6, 0.1, 0.0)))
    pictures.append(captioned(ink(draw_strokes(rig, posed, camera, 1), 256, 256), "old, turned"))
    save("creases.png", sheet(pictures, 7))


def identities() -> None:
    """The same smile on different people."""
    rig = load_rig()
    people = {
        "young woman": {"gender": 0.0, "asian": 1.0, "african": 0.0, "caucasian": 0.0},
        "young man": {"gender": 1.0, "african": 1.0, "asian": 0.0, "caucasian": 0.0},
        "old woman": {"gender": 0.0, "age": 1.0, "caucasian": 1.0, "african": 0.0, "asian": 0.0},
        "old man": {"gender": 1.0, "age": 1.0, "weight": 0.5},
        "features": {"nose_hump": 0.9, "jaw_width": 0.9, "eye_spacing": -0.7, "head_shape": 0.5},
    }
    faces = np.concatenate([rig.neutral(who) for who in people.values()])
    camera = Camera.framing(faces[faces[:, 1] > -0.12], 256, 256, 0.02)
    pictures = [
        captioned(paint(rig, rig.pose(FaceParameters({"smile": 4.0}, who)), camera, who), name)
        for name, who in people.items()
    ]
    save("identities.png", sheet(pictures, 5))


def drawings() -> None:
    """A page of the data set."""
    save("drawings.png", sheet([make_sample(0, k)[0] for k in range(18)], 6))


def examples() -> None:
    """What the program makes of the sketches that ship with it."""
    pictures = []
    for path in sorted(SKETCHES.glob("*.png"), reverse=True):
        pictures.append(pipeline.preview(pipeline.fit(path)))
    width = max(p.shape[1] for p in pictures)
    pad = [np.pad(p, ((0, 8), (0, width - p.shape[1]), (0, 0)), constant_values=255)
           for p in pictures]  # fmt: skip
    save("examples.png", np.concatenate(pad))


def stages() -> None:
    """The way of one sketch: contours, where the snakes pull them, the fitted lines."""
    from snakes import fit_offsets

    face = pipeline.fit(SKETCHES / "angry_man.png")
    result = fit_offsets(face.drawing.image, face.rig, face.parameters, face.camera)
    left, top, right, bottom = head_box(face.rig.pose(face.parameters), face.camera)
    height = 420
    width = round(height * (right - left) / (bottom - top))
    camera = face.camera.cropped(left, top, right, bottom, width, height)

    def lines(colours: list[tuple[list[NDArray], str]], ground: NDArray) -> NDArray:
        page = Image.fromarray(ground).resize((width * 2, height * 2)).convert("RGB")
        draw = ImageDraw.Draw(page)
        zoom = 2 * np.array([width / (right - left), height / (bottom - top)])
        for paths, colour in colours:
            for path in paths:
                points = (path - [left, top]) * zoom
                draw.line([tuple(p) for p in points], fill=colour, width=3)
        return np.asarray(page.resize((width, height), Image.Resampling.LANCZOS))

    render = (255 * np.clip(result.render, 0, 1)).astype(np.uint8)
    paper = np.full((height, width), 255, np.uint8)
    fitted = ink(draw_strokes(face.rig, face.vertices, camera, 1), width, height, Style(width=1.8))
    save(
        "stages.png",
        sheet(
            [
                captioned(lines([(result.contours, "black")], paper), "contours of the sketch"),
                captioned(lines([(result.contours, "#2060c0")], render), "on the expression"),
                captioned(lines([(result.snakes, "#c02020")], render), "snakes at rest"),
                captioned(fitted, "the fitted face, drawn"),
            ],
            4,
        ),
    )


PICTURES = {f.__name__: f for f in (controls, creases, identities, drawings, examples, stages)}


def main() -> None:
    chosen = sys.argv[1:] or list(PICTURES)
    unknown = set(chosen) - set(PICTURES)
    if unknown:
        sys.exit(f"There is no picture '{unknown.pop()}'; choose from: {', '.join(PICTURES)}.")
    for name in chosen:
        PICTURES[name]()


if __name__ == "__main__":
    main()
