"""Sketches inside Blender, for the tests: an image, a Grease Pencil drawing."""

from __future__ import annotations

import bpy
import numpy as np
from PIL import Image

from facs_rig.common.box import Box


def image_of(path, name: str = "Drawn") -> bpy.types.Image:
    """A picture file as an image of this file, painted rather than loaded."""
    values = np.asarray(Image.open(path).convert("RGBA"), dtype=np.float32)[::-1] / 255
    image = bpy.data.images.new(name, values.shape[1], values.shape[0], alpha=True)
    image.pixels.foreach_set(np.ascontiguousarray(values).ravel())
    return image


def lines_of(path) -> list[np.ndarray]:
    """The middles of a drawing's strokes, (k, 2) metres, x right, y up; the picture is 0.3 high."""
    from addon.drawing import load_drawing
    from snakes import centre_lines, polylines

    page = load_drawing(path).image
    height, width = page.shape
    found = polylines(centre_lines(page, Box(0, 0, width, height)), 0.3)
    return [(line * (1, -1) + (-width / 2, height / 2)) * 0.3 / height for line in found]


def pencil_of(lines, name: str = "Pen", radius: float = 0.0008) -> bpy.types.Object:
    """Strokes (k, 2) in metres as a Grease Pencil object that is drawn in the front view."""
    if hasattr(bpy.data, "grease_pencils_v3"):
        data = bpy.data.grease_pencils_v3.new(name)
    else:
        data = bpy.data.grease_pencils.new(name)
    pencil = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(pencil)
    layer = data.layers.new("Lines", set_active=True)
    draw_on(layer.frames.new(1), lines, radius)
    return pencil


def draw_on(frame, lines, radius: float = 0.0008) -> None:
    """Add strokes (k, 2), metres in the front view, to a frame of a Grease Pencil layer."""
    if hasattr(frame, "strokes"):  # before Blender 4.3
        for line in lines:
            stroke = frame.strokes.new()
            stroke.line_width = round(2000 * radius)
            stroke.points.add(len(line))
            stroke.points.foreach_set("co", standing(line).ravel())
            stroke.points.foreach_set("pressure", np.ones(len(line), np.float32))
        return
    if not lines:  # Blender 5.0 crashes when it is asked to add none
        return
    drawing = frame.drawing
    before = len(drawing.strokes)
    drawing.add_strokes([len(line) for line in lines])
    for stroke, line in zip(list(drawing.strokes)[before:], lines, strict=True):
        for point, place in zip(stroke.points, standing(line), strict=True):
            point.position, point.radius = place.tolist(), radius


def standing(line) -> np.ndarray:
    """(k, 2) in the front view as (k, 3) in Blender's axes."""
    line = np.asarray(line, dtype=np.float32)
    return np.stack([line[:, 0], np.zeros(len(line), np.float32), line[:, 1]], axis=1)
