"""Which lines an answer of the detector rests on, as a picture: a tile for each active control."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from addon.terminal import printable
from classifiers import Detection, Detector
from classifiers.evidence import Evidence, Progress, evidence
from classifiers.finding import widened
from classifiers.plausible import turned
from classifiers.preprocess import Floats, as_page
from facs_rig.common.images import area_resample

COLUMNS = 4
TILE = 300  # px, side of a tile's picture
GAP, HEADING, CAPTION, LEGEND = 14, 34, 42, 30  # px
VIEW = 1.2  # of the face's box that was read, so that the whole face is seen
LIKELIEST = 2  # controls that are explained where none is active
FAINTEST = 0.15  # log-odds: where a control rests on less than that, colours stay pale
FOR = np.array([206, 30, 30], np.float32)
AGAINST = np.array([24, 92, 200], np.float32)
NEITHER = np.array([188, 188, 188], np.float32)
TEXT, PALE = (32, 32, 32), (112, 112, 112)


def explain(
    sketches: Mapping[str, Floats], detector: Detector, progress: Progress | None = None
) -> Image.Image:
    """A sheet of all sketches: for each a heading and a tile for each control that is active.

    sketches : title -> drawing (h, w) float, 1 = paper, 0 = ink
    progress : called with the sketches done and their number

    Red lines speak for the control, blue ones against it. Where no control is active, the likeliest
    are shown, and said to be not active.
    """
    sections = []
    for done, (title, drawing) in enumerate(sketches.items(), 1):
        sections.append(section(printable(title), drawing, evidence(drawing, detector)))
        if progress:
            progress(done, len(sketches))
    width = max(part.width for part in sections)
    height = sum(part.height for part in sections) + LEGEND
    sheet = Image.new("RGB", (width, height), "white")
    top = 0
    for part in sections:
        sheet.paste(part, (0, top))
        top += part.height
    _legend(ImageDraw.Draw(sheet), top)
    return sheet


def section(title: str, drawing: Floats, found: Evidence) -> Image.Image:
    """One sketch: its title, then the tiles, the surest first.

    drawing : (h, w) float, as `found` was made of; shown upright
    """
    order = _worth_showing(found.detection)
    columns = min(COLUMNS, max(len(order), 2))
    rows = -(-len(order) // columns)
    step = TILE + GAP
    picture = Image.new("RGB", (GAP + columns * step, HEADING + rows * (CAPTION + step)), "white")
    pen = ImageDraw.Draw(picture)
    head = "  ".join(f"{k} {round(v):+d}°" for k, v in found.detection.to_json()["head"].items())
    about = f"face {found.detection.face_probability:.0%}   {head}"
    _text(pen, (GAP, 8), title, 17, TEXT, picture.width - 2 * GAP)
    room = picture.width - 3 * GAP - pen.textlength(title, ImageFont.load_default(17))
    _text(pen, (picture.width - GAP, 11), about, 14, PALE, room, "ra")
    view = widened(found.box, VIEW)
    ink = area_resample(as_page(turned(drawing, found.detection.turn)), view, TILE)
    for k, name in enumerate(order):
        u, v = GAP + k % columns * step, HEADING + k // columns * (CAPTION + step)
        _text(pen, (u, v + 2), name, 16, TEXT, TILE)
        _text(pen, (u, v + 21), _said(found.detection, name), 13, PALE, TILE)
        picture.paste(coloured(ink, found.within(name, view, (TILE, TILE))), (u, v + CAPTION))
        pen.rectangle((u, v + CAPTION, u + TILE - 1, v + CAPTION + TILE - 1), outline="#dddddd")
    return picture


def coloured(ink: Floats, heat: Floats) -> Image.Image:
    """Ink (s, s), 0 = paper and 1 = black, coloured by the evidence (s, s) in log-odds."""
    darkest = float(np.quantile(ink[ink > 0.05], 0.9)) if (ink > 0.05).any() else 1.0
    alpha = np.clip(ink / darkest, 0, 1)[..., None]
    strongest = max(float((np.abs(heat) * ink).max()) / darkest, FAINTEST)
    strength = np.clip(heat / strongest, -1, 1)[..., None]
    towards = np.where(strength > 0, FOR, AGAINST)
    # The weaker half of the evidence would hardly be seen on thin lines.
    line = NEITHER + np.abs(strength) ** 0.75 * (towards - NEITHER)
    return Image.fromarray((255 * (1 - alpha) + line * alpha).round().astype(np.uint8))


def _worth_showing(detection: Detection) -> list[str]:
    likely = sorted(detection.probabilities, key=detection.probabilities.__getitem__, reverse=True)
    return [name for name in likely if detection.active[name]] or likely[:LIKELIEST]


def _said(detection: Detection, name: str) -> str:
    probability = f"{detection.probabilities[name]:.0%} likely"
    if detection.active[name]:
        return f"{probability}, intensity {detection.intensities[name]:.1f} of 5"
    return f"{probability}, not active"


def _legend(pen: ImageDraw.ImageDraw, top: float) -> None:
    font = ImageFont.load_default(14)
    left = float(GAP)
    for colour, text in ((FOR, "speaks for it"), (AGAINST, "speaks against it")):
        shade = tuple(int(c) for c in colour)
        pen.line((left, top + 13, left + 26, top + 13), fill=shade, width=3)
        pen.text((left + 34, top + 13), text, fill=PALE, font=font, anchor="lm")
        left += 34 + pen.textlength(text, font) + 24


def _text(
    pen: ImageDraw.ImageDraw,
    place: tuple[float, float],
    text: str,
    size: int,
    colour: tuple[int, int, int],
    room: float,
    anchor: str = "la",
) -> None:
    """A line of text, cut at its beginning with an ellipsis to fit, as paths end in what matters;
    none where there is no room."""
    font = ImageFont.load_default(size)
    while text and pen.textlength(text, font) > room:
        text = "…" + text[2:] if len(text) > 2 else ""
    pen.text(place, text, fill=colour, font=font, anchor=anchor)
