"""From a detected face to the drawn one, where hair is drawn beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image, ImageDraw

from dataset_gen import Style, draw_strokes
from dataset_gen.linework import ink
from facs_rig import LANDMARKS, Camera, FaceParameters, load_rig
from snakes import Observations, fit_lines

SIZE = 400
BEGIN = FaceParameters({"smile": 3.0})


@pytest.fixture(scope="module")
def scene():
    """(rig, camera, what is observed, a drawing, one with locks over its cheeks, where)."""
    rig = load_rig()
    posed = rig.pose(FaceParameters({"smile": 3.0}, {"gender": 0.1, "jaw_width": -0.6}))
    camera = Camera.framing(posed, SIZE, SIZE)
    marks = dict(zip(LANDMARKS, camera.project(posed[rig.landmarks]).tolist(), strict=True))
    drawing = ink(draw_strokes(rig, posed, camera), SIZE, SIZE, Style()).astype(np.float32) / 255
    image = Image.fromarray((255 * drawing).astype(np.uint8))
    pen = ImageDraw.Draw(image)
    # From under the ears down; where the jaw is, is not known otherwise.
    top, chin = marks["nose_base"][1], marks["chin"][1]
    edges = [marks[f"jawline_4_{side}"][0] for side in ("left", "right")]
    marks = {name: place for name, place in marks.items() if "jaw" not in name}
    for edge, way in zip(edges, (1, -1), strict=True):
        inner, outer = sorted((edge - 14 * way, edge + 30 * way))
        pen.rectangle([inner, top, outer, chin - 4], fill=255)
        for off in (6, 12, 18):
            u = edge + way * off
            pen.line([u, top, u - 2 * way, chin], fill=0, width=2)
    haired = np.asarray(image, np.float32) / 255
    observed = Observations(
        {name: tuple(place) for name, place in marks.items()}, dict.fromkeys(marks, 3.0)
    )

    def hair(points):
        beyond = (points[:, 0] - edges[0] > 4) | (edges[1] - points[:, 0] > 4)
        return beyond & (points[:, 1] > top - 2)

    return rig, camera, observed, drawing, haired, hair


def test_an_outline_does_not_follow_the_hair_beside_it(scene):
    rig, camera, observed, plain, haired, hair = scene
    told = replace(observed, hair=hair)
    front = rig.neutral()[:, 2] > 0.03
    fits = [
        fit_lines(drawing, rig, BEGIN, camera, seen)
        for drawing, seen in ((plain, observed), (haired, told), (haired, observed))
    ]
    faces = [rig.shape(fit.parameters, fit.offsets)[front] for fit in fits]
    with_it, without = (np.linalg.norm(face - faces[0], axis=1).mean() for face in faces[1:])
    assert with_it < 0.6 * without
    assert len(fits[1].drawn.points) == len(fits[2].drawn.points)  # what was drawn is still told


def test_who_is_all_hair_is_found_by_landmarks(scene):
    rig, camera, observed, _, haired, _ = scene
    everywhere = replace(observed, hair=lambda points: np.ones(len(points), bool))
    fit = fit_lines(haired, rig, BEGIN, camera, everywhere)
    assert np.isfinite(fit.offsets).all() and np.linalg.norm(fit.offsets, axis=1).max() < 1e-9
