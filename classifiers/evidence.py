"""Which lines of a drawing an answer of the detector rests on, in numpy and ONNX Runtime alone.

Occlusion (M. Zeiler and R. Fergus, Visualizing and Understanding Convolutional Networks, 2014):
patch after patch of the face is erased and read again. Lines whose absence lowers the log-odds of a
control speak for it, lines whose absence raises them speak against it. All controls are answered
from the same erasures.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from facs_rig.common.box import Box
from facs_rig.common.images import area_resample

from .detection import Detection
from .detector import Detector
from .labels import mirror_order
from .plausible import turned, upright
from .preprocess import Floats, as_page, even_ink

GRIDS = (5, 10)  # patches along a side, once for long creases and once for where exactly
SOFTNESS = 0.6  # a patch's standard deviation, in the distance of two patches
BATCH = 16
LEAST_INK = 0.002  # of the crop's: a patch that would erase less is not worth a look

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Evidence:
    """What a detection rests on.

    shape : (h, w) of the drawing, turned as `detection.turn` says; all pixels are those of it
    box : the part of it that was read, turned as the face is
    maps : every control -> (s, s) float32 over the box: by how much the control's log-odds fall
    when the surroundings are erased, negative where they rise
    """

    detection: Detection
    shape: tuple[int, int]
    box: Box
    maps: dict[str, Floats]

    def on_page(self, name: str) -> Floats:
        """The map of a control in the drawing's pixels: (h, w) float32, 0 outside the face."""
        height, width = self.shape
        return self.within(name, Box.at(0, 0, width, height), self.shape)

    def within(self, name: str, view: Box, shape: tuple[int, int]) -> Floats:
        """The map of a control as a picture (h, w) float32 of a rectangle of the drawing."""
        height, width = shape
        heat = self.maps[name]
        if view.turn != self.box.turn:
            return _sampled(heat, self.box, view, shape)
        ends = view.to_units(self.box.to_pixels(np.array([(0.0, 0.0), (1.0, 1.0)])))
        (left, top), (right, bottom) = ends.tolist()
        rows = _spread(len(heat), height, top * height, (bottom - top) * height)
        columns = _spread(len(heat), width, left * width, (right - left) * width)
        return (rows @ heat @ columns.T).astype(np.float32)


def evidence(
    drawing: NDArray,
    detector: Detector,
    progress: Progress | None = None,
    head: Box | None = None,
) -> Evidence:
    """Read a drawing (h, w) float, 1 = paper and 0 = ink, and find out what the answers rest on.

    `progress(done, total)` counts erasures. head : where to look, as for `Detector.detect`, which
    also raises the same ValueErrors.
    """
    page = as_page(drawing)
    turn, reading = upright(detector, page, head)
    page = turned(page, turn)
    ink = even_ink(area_resample(page, reading.box, detector.size))
    heat = occlusion(ink, detector, progress)
    height, width = page.shape
    maps = dict(zip(detector.aus, heat, strict=True))
    found = detector.interpret(reading, turn, placed=head is not None)
    return Evidence(found, (height, width), reading.box, maps)


def occlusion(ink: Floats, detector: Detector, progress: Progress | None = None) -> Floats:
    """(k, s, s) float32 evidence for every control in a crop (s, s) of ink, at each of its cells.

    The mean over the grids; within one, what a patch changed belongs to the cells it erased. Read
    both ways, as the detector's last look is: a mirrored crop has the mirrored evidence.
    """
    patches = [_patches(len(ink), count) for count in GRIDS]
    worth = [np.einsum("nij,ij->n", soft, ink) > LEAST_INK * ink.sum() for soft in patches]
    todo = np.concatenate([soft[some] for soft, some in zip(patches, worth, strict=True)])
    whole = _log_odds(ink[None], detector)
    change = np.zeros((len(todo), whole.shape[1]))
    for start in range(0, len(todo), BATCH):
        part = slice(start, start + BATCH)
        change[part] = whole - _log_odds(ink * (1 - todo[part]), detector)
        if progress:
            progress(min(start + BATCH, len(todo)), len(todo))
    heat = np.zeros((whole.shape[1], *ink.shape), np.float32)
    for soft, some in zip(patches, worth, strict=True):
        mine, change = change[: some.sum()], change[some.sum() :]
        share = (soft / soft.sum(axis=0))[some].reshape(len(mine), ink.size)
        heat += (mine.T @ share).reshape(heat.shape).astype(np.float32) / len(GRIDS)
    return heat


def _log_odds(ink: Floats, detector: Detector) -> NDArray[np.float64]:
    """(b, k) calibrated, for crops (b, s, s) of ink, each read both ways."""
    both = detector.run(np.concatenate([ink, ink[:, :, ::-1]])).logits
    there, back = both[: len(ink)], both[len(ink) :, mirror_order(detector.aus)]
    return detector.log_odds((there + back) / 2)


def _patches(size: int, count: int) -> Floats:
    """(count², size, size) float32 soft round patches, 1 in their middles, on an even grid."""
    cell = (np.arange(size) + 0.5) / size * count
    middle = np.arange(count) + 0.5
    along = np.exp(-np.square((cell - middle[:, None]) / SOFTNESS) / 2)
    return np.einsum("ai,bj->abij", along, along).reshape(-1, size, size).astype(np.float32)


def _spread(cells: int, pixels: int, start: float, length: float) -> NDArray[np.float64]:
    """(pixels, cells) weights of linear interpolation; rows of zeros outside start … + length."""
    place = (np.arange(pixels) + 0.5 - start) / length * cells - 0.5
    nearest = np.clip(place, 0, cells - 1)
    weights = np.maximum(1 - np.abs(nearest[:, None] - np.arange(cells)), 0)
    return weights * ((place >= -0.5) & (place <= cells - 0.5))[:, None]


def _sampled(heat: Floats, box: Box, view: Box, shape: tuple[int, int]) -> Floats:
    """A map (s, s) over a box as a picture (h, w) of a view that is turned otherwise."""
    height, width = shape
    v, u = (np.indices(shape) + 0.5).reshape(2, -1)
    place = box.to_units(view.to_pixels(np.stack([u / width, v / height], axis=1)))
    seen = ((place >= 0) & (place <= 1)).all(axis=1)
    near = np.clip(place * len(heat) - 0.5, 0, len(heat) - 1)
    first = np.minimum(near.astype(int), len(heat) - 2)
    (a, b), (j, i) = (near - first).T, first.T
    above = (1 - a) * heat[i, j] + a * heat[i, j + 1]
    below = (1 - a) * heat[i + 1, j] + a * heat[i + 1, j + 1]
    return (seen * ((1 - b) * above + b * below)).reshape(shape).astype(np.float32)
