"""A sphere with the attributes of a rig: the simple example of the thesis, with known answers."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw

from facs_rig import LANDMARKS, Camera
from facs_rig.anatomy import PART_NAMES

RADIUS = 0.1  # metres
SIZE = 400  # pixels
SCALE = 1300.0  # pixels per metre: the sphere's radius is 130 pixels

# Of the deformed circle: degrees at which they are, degrees of width, height over the radius.
BUMPS = ((130, 22, 0.1), (62, 16, -0.07), (10, 20, 0.09), (-40, 20, -0.08), (-110, 40, 0.08))


class Ball:
    """A sphere of skin; it has no expression and does not turn.

    grid : (rings - 1, 2 rings) int, the vertices from pole to pole and around
    """

    def __init__(self, rings: int = 70, radius: float = RADIUS) -> None:
        polar = np.linspace(0, np.pi, rings + 1)[1:-1]
        around = np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False)
        t, p = np.meshgrid(polar, around, indexing="ij")
        points = np.stack([np.sin(t) * np.sin(p), np.cos(t), np.sin(t) * np.cos(p)], axis=-1)
        index = np.arange(t.size).reshape(t.shape)
        a, b = index[:-1], index[1:]
        c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
        top, bottom = t.size, t.size + 1
        first, last = index[0], index[-1]
        self.grid = index
        self.vertices = radius * np.concatenate(
            [points.reshape(-1, 3), [[0, 1, 0], [0, -1, 0]]]
        ).astype(np.float32)
        self.triangles = np.concatenate(
            [
                np.stack([a, b, c], axis=-1).reshape(-1, 3),
                np.stack([a, c, d], axis=-1).reshape(-1, 3),
                np.stack([np.full_like(first, top), first, np.roll(first, -1)], axis=-1),
                np.stack([np.full_like(last, bottom), np.roll(last, -1), last], axis=-1),
            ]
        ).astype(np.int32)
        across = index[:, -np.arange(2 * rings) % (2 * rings)]
        self.mirror = np.concatenate([across.ravel(), [top, bottom]]).astype(np.int32)
        self.n_vertices = len(self.vertices)
        nothing = np.zeros(self.n_vertices, dtype=bool)
        self.parts = {"skin": ~nothing}
        self.parts |= {name: nothing for name in PART_NAMES[1:]}
        # All landmarks at the top: a ball is face all over, no skull lies above its brows.
        self.landmarks = np.full(len(LANDMARKS), top, dtype=np.int32)
        self.strokes: dict = {}

    def neutral(self, identity=None):
        return self.vertices

    def shape(self, parameters, offsets=None):
        return self.vertices if offsets is None else self.vertices + offsets

    def pose(self, parameters, offsets=None):
        return self.shape(parameters, offsets)

    def unturn_vectors(self, vectors, parameters):
        return vectors


def camera(radius: float = RADIUS) -> Camera:
    """In front of a ball, which covers the same pixels whatever its radius in metres."""
    scale = SCALE * RADIUS / radius
    return Camera(SIZE, SIZE, (scale, scale), (SIZE / 2, SIZE / 2))


def ellipse(a: float, b: float, width: int = 2, size: int = SIZE) -> np.ndarray:
    """A drawing (size, size) of an ellipse with half axes a and b in pixels around the middle."""
    four = 4
    image = Image.new("L", (size * four, size * four), 255)
    outer, inner = (np.array([a, b]) + width / 2) * four, (np.array([a, b]) - width / 2) * four
    middle = size * four / 2
    draw = ImageDraw.Draw(image)
    for half, value in ((outer, 0), (inner, 255)):
        draw.ellipse([*(middle - half), *(middle + half - 1)], fill=value)
    return np.asarray(image.reduce(four), dtype=np.float32) / 255


def deformed_circle(points: int = 720) -> np.ndarray:
    """The thesis' drawing: the outline (points, 2) of a ball with bumps and dents, in pixels."""
    angle = np.linspace(0, 2 * np.pi, points, endpoint=False)
    radius = np.ones(points)
    for at, width, height in BUMPS:
        away = np.angle(np.exp(1j * (angle - np.radians(at))))
        radius += height * np.exp(-((away / np.radians(width)) ** 2))
    around = np.stack([np.cos(angle), -np.sin(angle)], axis=1)
    return SIZE / 2 + RADIUS * SCALE * radius[:, None] * around


def drawn(outline: np.ndarray, width: int = 3) -> np.ndarray:
    """A drawing (SIZE, SIZE), 1 is paper, of a closed line through points (k, 2) in pixels."""
    four = 4
    image = Image.new("L", (SIZE * four, SIZE * four), 255)
    closed = [tuple(point * four) for point in np.concatenate([outline, outline[:1]])]
    ImageDraw.Draw(image).line(closed, fill=0, width=width * four, joint="curve")
    return np.asarray(image.reduce(four), dtype=np.float32) / 255
