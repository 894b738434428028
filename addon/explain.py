"""Which strokes an answer of the detector rests on, as a picture.

Occlusion (M. Zeiler and R. Fergus, Visualizing and Understanding Convolutional Networks, 2014):
part after part of the drawing is erased and read again; strokes whose absence lowers the
probability of a control speak for it, strokes whose absence raises it speak against it.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont
from scipy import ndimage

from addon.drawing import Floats
from classifiers import Detection, Detector

CELLS = 9  # erased squares along the longer side of the drawn area
PANELS = 6  # at most so many controls are explained
PANEL = 360  # px, longer side of a panel
CAPTION = 26  # px
FOR = np.array([214, 40, 40], np.float32)
AGAINST = np.array([38, 92, 196], np.float32)
NEITHER = np.array([176, 176, 176], np.float32)


def evidence(
    drawing: Floats,
    detector: Detector,
    names: list[str],
    progress: Callable[[int, int], None] | None = None,
) -> NDArray[np.float32]:
    """How much each place of a drawing speaks for each control.

    drawing : (h, w) float32, 1 = paper, 0 = ink. names : k controls.
    Returns (k, h, w) float32: by how much the log-odds of the control fall when the surroundings
    of a pixel are erased; negative where they rise.
    """
    ink = np.argwhere(drawing < 0.5)
    (top, left), (bottom, right) = ink.min(axis=0), ink.max(axis=0) + 1
    side = max(2, math.ceil(max(bottom - top, right - left) / CELLS))
    whole = _log_odds(detector.detect(drawing), names)
    total = np.zeros((len(names), *drawing.shape), np.float32)
    cells = [(v, u) for v in range(top, bottom, side) for u in range(left, right, side)]
    for done, (v, u) in enumerate(cells, 1):
        # Half a cell of overlap on all sides, so that no feature falls between two cells.
        part = (
            slice(max(0, v - side // 2), v + side + side // 2),
            slice(max(0, u - side // 2), u + side + side // 2),
        )
        if (drawing[part] < 0.5).any():
            erased = drawing.copy()
            erased[part] = 1
            if (erased < 0.5).any():
                change = whole - _log_odds(detector.detect(erased), names)
                total[:, v : v + side, u : u + side] = change[:, None, None]
        if progress:
            progress(done, len(cells))
    return ndimage.gaussian_filter(total, (0, side / 2, side / 2))


def explain(
    drawing: Floats,
    detector: Detector,
    progress: Callable[[int, int], None] | None = None,
) -> Image.Image:
    """A panel for each control that is active (or for the likeliest ones): red speaks for it."""
    detection = detector.detect(drawing)
    likely = sorted(detection.probabilities, key=detection.probabilities.__getitem__, reverse=True)
    names = [name for name in likely if detection.active[name]][:PANELS] or likely[:2]
    heats = evidence(drawing, detector, names, progress)
    height, width = drawing.shape
    scale = PANEL / max(height, width)
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    sheet = Image.new("RGB", (columns * size[0], rows * (size[1] + CAPTION)), "white")
    pen = ImageDraw.Draw(sheet)
    font = ImageFont.load_default(15)
    for index, (name, heat) in enumerate(zip(names, heats, strict=True)):
        u = index % columns * size[0]
        v = index // columns * (size[1] + CAPTION)
        sheet.paste(_panel(drawing, heat).resize(size, Image.Resampling.BOX), (u, v + CAPTION))
        label = f"{name} {detection.probabilities[name]:.2f}"
        pen.text((u + 8, v + 4), label, fill="black", font=font)
    return sheet


def _panel(drawing: Floats, heat: NDArray[np.float32]) -> Image.Image:
    """The drawing with its ink coloured by the evidence."""
    strength = (heat / max(float(np.abs(heat).max()), 1e-6))[..., None]
    ink = np.where(
        strength > 0,
        NEITHER + strength * (FOR - NEITHER),
        NEITHER - strength * (AGAINST - NEITHER),
    )
    paper = drawing[..., None]
    return Image.fromarray((255 * paper + ink * (1 - paper)).round().astype(np.uint8))


def _log_odds(detection: Detection, names: list[str]) -> NDArray[np.float64]:
    probability = np.array([detection.probabilities[name] for name in names])
    probability = np.clip(probability, 1e-4, 1 - 1e-4)
    return np.log(probability / (1 - probability))
