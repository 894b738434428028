"""The picture of strokes that have no place on the face: ignored, engraved and embossed."""

from __future__ import annotations

import numpy as np
from PIL import Image

from addon import pipeline
from addon.preview import paint
from addon.sheet import PAPER, Picture, captioned, close_up, grid, seen_from
from dataset_gen import Style, draw_strokes
from dataset_gen.linework import ink
from dataset_gen.linework.strokes import Stroke
from facs_rig import Camera, FaceParameters, load_rig
from facs_rig.anatomy import smooth_curve

# What a drawing of a man gets besides: a scar across the cheek and one from the forehead over the
# brow, in cm from the head's joint, x to his own left, y up.
SCARS = (
    ((1.7, 0.6), (2.7, -0.4), (3.6, -1.8), (4.3, -3.6)),
    ((-1.6, 8.0), (-2.1, 6.8), (-2.5, 5.4), (-2.8, 4.2), (-3.4, 3.2)),
)


def scarred(size: int = 700) -> Picture:
    """A drawing (size, size) of a man with strokes that no face has."""
    rig = load_rig()
    posed = rig.pose(FaceParameters({}, {"gender": 0.8, "jaw_width": 0.3}))
    camera = Camera.framing(posed[posed[:, 1] > -0.11], size, size, 0.06)
    layers = ("brow_hair", "iris", "pupil", "lash", "lip_line", "hair_short")
    strokes = draw_strokes(rig, posed, camera, 1, layers)
    for points in SCARS:
        places = np.column_stack([0.01 * smooth_curve(np.array(points), 60), np.zeros(60)])
        strokes.append(Stroke(camera.project(places), np.ones(60), "scar"))
    return ink(strokes, size, size, Style(width=2.4))


def carved_faces() -> Picture:
    """A sketch with such strokes, and what comes of them: ignored, engraved and embossed."""
    sketch, size = scarred(), 360
    fits = {
        text: pipeline.fit(
            sketch,
            pipeline.FitOptions(strokes=strokes, stroke_depth=1.8, stroke_profile="scar"),
        )
        for text, strokes in (
            ("ignored", "ignore"),
            ("engraved", "engrave"),
            ("embossed", "emboss"),
        )
    }
    first = fits["ignored"]
    panels = np.split(pipeline.preview(first), 4, axis=1)
    rig, who = first.rig, dict(first.parameters.identity)
    pictures = [captioned(fitting(panels[0], size), "the sketch")]
    for view, yaw in (("from the front", 0.0), ("in three quarters", -30.0)):
        camera = close_up(rig, yaw, size, who)
        for text, face in fits.items():
            shown = paint(rig, seen_from(face.vertices, yaw), camera, who)
            pictures.append(captioned(shown, f"{text}, {view}"))
        if yaw == 0:
            pictures.append(captioned(fitting(panels[3], size), "blue: what has no place"))
    return grid(pictures, 4)


def fitting(picture: Picture, size: int) -> Picture:
    """A picture without its blank border, in the middle of a tile like those of `close_up`."""
    width = close_up(load_rig(), size=size).width
    (top, left), (bottom, right) = (
        edge(np.argwhere(picture.min(axis=2) < PAPER), axis=0) for edge in (np.min, np.max)
    )
    picture = picture[top : bottom + 1, left : right + 1]
    scale = 0.96 * min(width / picture.shape[1], size / picture.shape[0])
    wide, high = round(scale * picture.shape[1]), round(scale * picture.shape[0])
    page = Image.fromarray(np.full((size, width, 3), PAPER, np.uint8))
    small = Image.fromarray(np.minimum(picture, PAPER)).resize((wide, high))
    page.paste(small, ((width - wide) // 2, (size - high) // 2))
    return np.asarray(page)
