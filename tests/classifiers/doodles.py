"""Pages that people draw and that show no face that can be fitted, each in endless variants."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.random import Generator
from PIL import Image, ImageDraw, ImageFont

from dataset_gen.linework.lines import draw_strokes
from dataset_gen.page import draw_page
from dataset_gen.sampling import sample_face
from facs_rig import Camera, FaceParameters, load_rig

SIZE = 360


class Sheet:
    """A page of a unit of `unit` px around a middle; all places are in units from there, v down."""

    def __init__(self, rng: Generator) -> None:
        self.image = Image.new("L", (SIZE, SIZE), 255)
        self.pen = ImageDraw.Draw(self.image)
        self.rng = rng
        self.unit = float(rng.uniform(95, 160))
        self.middle = SIZE / 2 + rng.normal(0, 6, 2)
        self.width = int(rng.integers(2, 6))
        self.stretch = np.exp(rng.normal(0, 0.05, 2))

    def at(self, points) -> np.ndarray:
        return self.middle + self.unit * np.asarray(points, float).reshape(-1, 2) * self.stretch

    def line(self, *points, width: float = 1.0) -> None:
        """A polyline by an unsteady hand."""
        flat = self.at(points) + self.rng.normal(0, 0.7, (len(points), 2))
        self.pen.line(flat.ravel().tolist(), fill=0, width=max(1, round(width * self.width)))

    def arc(self, u, v, a, b=None, start=0.0, end=360.0, width: float = 1.0) -> None:
        """A piece of an ellipse about (u, v) with these half axes, degrees clockwise from right."""
        t = np.radians(np.linspace(start, end, 40))
        b = a if b is None else b
        self.line(*np.stack([u + a * np.cos(t), v + b * np.sin(t)], 1), width=width)

    def dot(self, u, v, r) -> None:
        (left, top), (right, bottom) = self.at([(u - r, v - r), (u + r, v + r)]).tolist()
        self.pen.ellipse([left, top, right, bottom], fill=0)


def smiley(s: Sheet) -> None:
    """Dots and an arc in a circle, glad or sad."""
    s.arc(0, 0, 1)
    apart, high = s.rng.uniform(0.28, 0.42), s.rng.uniform(0.2, 0.35)
    for side in (-1, 1):
        if s.rng.random() < 0.6:
            s.dot(side * apart, -high, s.rng.uniform(0.06, 0.13))
        elif s.rng.random() < 0.5:
            s.arc(side * apart, -high, 0.08, s.rng.uniform(0.1, 0.2))
        else:
            s.arc(side * apart, -high, 0.14, 0.12, 180, 360)
    if s.rng.random() < 0.75:
        wide, high = s.rng.uniform(0.4, 0.6), s.rng.uniform(0.3, 0.5)
        s.arc(0, s.rng.uniform(0.05, 0.2), wide, high, 20, 160)
    else:
        s.arc(0, 0.75, 0.45, 0.35, 200, 340)


def emoji(s: Sheet) -> None:
    """A smiley with brows, an open mouth, a tongue, tears or hearts for eyes."""
    s.arc(0, 0, 1)
    for side in (-1, 1):
        kind = s.rng.integers(3)
        if kind == 0:
            s.arc(side * 0.37, -0.22, 0.17, 0.24)
            s.dot(side * 0.37 + 0.04, -0.2, 0.08)
        elif kind == 1:
            s.line((side * 0.37 - 0.15, -0.4), (side * 0.37 + 0.15, -0.1))
            s.line((side * 0.37 - 0.15, -0.1), (side * 0.37 + 0.15, -0.4))
        else:
            s.line((side * 0.37, -0.02), (side * 0.37 - 0.18, -0.25), (side * 0.37 - 0.09, -0.37),
                   (side * 0.37, -0.26), (side * 0.37 + 0.09, -0.37), (side * 0.37 + 0.18, -0.25),
                   (side * 0.37, -0.02))  # fmt: skip
        if s.rng.random() < 0.5:
            s.arc(side * 0.37, -0.45, 0.2, 0.1, 200, 340)
    s.line((-0.55, 0.2), (0.55, 0.2))
    s.arc(0, 0.2, 0.55, 0.55, 0, 180)
    if s.rng.random() < 0.5:
        s.arc(0.1, 0.6, 0.2, 0.3, -20, 200)


def cat(s: Sheet) -> None:
    """A cat's or a bear's head."""
    s.arc(0, 0.1, 1, 0.85)
    for side in (-1, 1):
        if s.rng.random() < 0.6:
            s.line((side * 0.9, -0.25), (side * 0.85, -1.05), (side * 0.35, -0.68))
        else:
            s.arc(side * 0.75, -0.7, 0.3)
        s.arc(side * 0.4, -0.1, 0.16, 0.12)
        s.dot(side * 0.4, -0.1, 0.07)
        for k in (-0.1, 0, 0.1):
            s.line((side * 0.3, 0.4 + k), (side * 1.1, 0.35 + 2 * k), width=0.6)
        s.arc(side * 0.12, 0.45, 0.12, 0.12, 0, 180)
    s.line((-0.1, 0.28), (0.1, 0.28), (0, 0.42), (-0.1, 0.28))


def dog(s: Sheet) -> None:
    """A whole animal from the side."""
    s.arc(0.1, 0.1, 0.75, 0.35)
    s.arc(-0.75, -0.3, 0.3, 0.25)
    s.line((-1.0, -0.25), (-1.25, -0.15), (-1.0, -0.05))
    s.line((-0.7, -0.52), (-0.55, -0.85), (-0.5, -0.4))
    s.dot(-0.82, -0.36, 0.04)
    for u in (-0.4, -0.2, 0.5, 0.7):
        s.line((u, 0.38), (u, 0.95), (u - 0.1, 0.97))
    s.line((0.8, -0.05), (1.1, -0.45), (1.2, -0.4))


def house(s: Sheet) -> None:
    """Roof, door and two windows, as children draw it."""
    s.line((-0.8, 1), (-0.8, -0.2), (0.8, -0.2), (0.8, 1), (-0.8, 1))
    s.line((-1, -0.2), (0, -1), (1, -0.2), (-1, -0.2))
    s.line((-0.2, 1), (-0.2, 0.4), (0.2, 0.4), (0.2, 1))
    for side in (-1, 1):
        u = side * 0.5
        s.line((u - 0.18, 0), (u + 0.18, 0), (u + 0.18, 0.32), (u - 0.18, 0.32), (u - 0.18, 0))
        s.line((u, 0), (u, 0.32), width=0.6)
        s.line((u - 0.18, 0.16), (u + 0.18, 0.16), width=0.6)


def eye(s: Sheet) -> None:
    """One eye alone, with lashes and a brow."""
    s.arc(0, 0.25, 1, 0.7, 200, 340)
    s.arc(0, -0.25, 1, 0.6, 20, 160)
    s.arc(0, 0, 0.33)
    s.dot(0, 0, 0.14)
    for k in np.linspace(-0.8, 0.8, int(s.rng.integers(5, 12))):
        s.line((k, -0.42 + 0.25 * k * k), (1.25 * k, -0.65 + 0.25 * k * k), width=0.6)
    s.arc(0, -0.3, 1.1, 0.55, 205, 330, width=2)


def mouth(s: Sheet) -> None:
    """Lips alone."""
    s.line((-1, 0), (-0.4, -0.3), (-0.12, -0.4), (0, -0.32), (0.12, -0.4), (0.4, -0.3), (1, 0))
    s.arc(0, 0, 1, 0.5, 0, 180)
    s.line((-1, 0), (-0.3, 0.04), (0, 0), (0.3, 0.04), (1, 0))


def hand(s: Sheet) -> None:
    """An open hand."""
    s.line((-0.5, 1), (-0.5, 0.1), (-0.55, -0.6), (-0.4, -0.65), (-0.3, -0.05), (-0.25, -0.85),
           (-0.08, -0.88), (-0.02, -0.08), (0.08, -0.95), (0.24, -0.93), (0.22, -0.05),
           (0.38, -0.75), (0.52, -0.7), (0.45, 0.2), (0.85, -0.1), (0.97, 0.02), (0.5, 0.6),
           (0.4, 1))  # fmt: skip
    s.arc(0, 0.35, 0.35, 0.2, 20, 140, width=0.6)


def tree(s: Sheet) -> None:
    """A trunk with a round crown and apples."""
    s.line((-0.15, 1), (-0.12, 0.1))
    s.line((0.15, 1), (0.12, 0.1))
    for u, v in ((-0.4, -0.1), (0.4, -0.1), (-0.25, -0.6), (0.3, -0.55), (0, -0.3)):
        s.arc(u, v, 0.45, 0.4)
        s.dot(u, v, 0.05)


def flower(s: Sheet) -> None:
    """Petals around a middle, on a stalk."""
    s.arc(0, -0.3, 0.2)
    for t in np.arange(0, 2 * np.pi, 2 * np.pi / int(s.rng.integers(5, 9))):
        s.arc(0.45 * np.cos(t), -0.3 + 0.45 * np.sin(t), 0.24)
    s.line((0, 0.3), (0.05, 1))
    s.arc(0.3, 0.75, 0.28, 0.1)


def car(s: Sheet) -> None:
    """A car from the side."""
    s.line((-1.1, 0.4), (-1.1, 0), (-0.7, -0.05), (-0.4, -0.45), (0.4, -0.45), (0.7, 0),
           (1.1, 0.05), (1.1, 0.4), (-1.1, 0.4))  # fmt: skip
    s.line((0, -0.45), (0, 0.4))
    for side in (-1, 1):
        s.arc(side * 0.6, 0.4, 0.22)
        s.arc(side * 0.6, 0.4, 0.1)


def person(s: Sheet) -> None:
    """A stick figure: its head is a dot on the page."""
    s.arc(0, -0.75, 0.22)
    s.line((0, -0.52), (0, 0.3))
    s.line((-0.5, -0.2), (0, -0.35), (0.5, -0.2))
    s.line((-0.4, 1), (0, 0.3), (0.4, 1))


def cup(s: Sheet) -> None:
    """A cup with a handle."""
    s.arc(0, -0.6, 0.7, 0.2)
    s.line((-0.7, -0.6), (-0.5, 0.8))
    s.line((0.7, -0.6), (0.5, 0.8))
    s.arc(0, 0.8, 0.5, 0.12, 0, 180)
    s.arc(0.75, 0, 0.35, 0.4, -110, 120)


def clock(s: Sheet) -> None:
    """A round clock, a wheel."""
    s.arc(0, 0, 1)
    for t in np.linspace(0, 2 * np.pi, 13)[:-1]:
        s.line((0.85 * np.cos(t), 0.85 * np.sin(t)), (0.95 * np.cos(t), 0.95 * np.sin(t)))
    s.line((0, 0), (0.5 * np.cos(s.rng.uniform(0, 6)), -0.3))
    s.line((0, 0), (0, -0.75))


def text(s: Sheet) -> None:
    """Some printed lines, in letters of some size."""
    words = "to draw a face begin with an egg then halve it twice put eyes there 1 2 3".split()
    size = int(s.rng.integers(16, 70))
    font = ImageFont.load_default(size)
    for v in range(10, SIZE - size, int(1.3 * size)):
        s.pen.text((12, v), " ".join(s.rng.choice(words, 8)), fill=0, font=font)


def robot(s: Sheet) -> None:
    """A box with lamps, an aerial and a grille."""
    s.line((-0.8, -0.6), (0.8, -0.6), (0.8, 0.9), (-0.8, 0.9), (-0.8, -0.6))
    s.line((0, -0.6), (0, -0.95))
    s.arc(0, -1, 0.07)
    for side in (-1, 1):
        s.arc(side * 0.38, -0.1, 0.2)
        s.line((side * 0.8, 0), (side, 0), (side, 0.4), (side * 0.8, 0.4))
    s.line((-0.5, 0.4), (0.5, 0.4), (0.5, 0.7), (-0.5, 0.7), (-0.5, 0.4))
    for u in (-0.25, 0, 0.25):
        s.line((u, 0.4), (u, 0.7))


def fish(s: Sheet) -> None:
    """A fish from the side."""
    s.arc(-0.1, 0, 0.8, 0.45)
    s.line((0.68, 0), (1.15, -0.4), (1.1, 0.4), (0.68, 0))
    s.dot(-0.6, -0.1, 0.06)
    s.arc(-0.35, 0, 0.15, 0.35, -70, 70)
    for u in (-0.05, 0.2):
        s.arc(u, 0, 0.1, 0.15, -80, 80, width=0.6)


def egg(s: Sheet) -> None:
    """An empty oval, perhaps with the cross of construction lines."""
    s.arc(0, 0, 0.75, 1)
    if s.rng.random() < 0.7:
        s.line((0, -1), (0, 1), width=0.6)
        s.line((-0.75, 0), (0.75, 0), width=0.6)


DOODLES: tuple[Callable[[Sheet], None], ...] = (
    smiley, emoji, cat, dog, house, eye, mouth, hand, tree, flower, car, person, cup, clock, text,
    robot, fish, egg,
)  # fmt: skip


def doodle(draw: Callable[[Sheet], None], seed: int) -> np.ndarray:
    """(SIZE, SIZE) float32 drawing, 1 = paper."""
    sheet = Sheet(np.random.default_rng((seed, DOODLES.index(draw))))
    draw(sheet)
    return np.asarray(sheet.image, np.float32) / 255


def head(seed: int, yaw: float | None = None) -> np.ndarray:
    """(SIZE, SIZE) float32 drawing of the rig's own face, 1 = paper: a random person in a random
    style. yaw : degrees that the head is turned instead of by lot."""
    rig, rng = load_rig(), np.random.default_rng((seed, 0xFACE))
    sample = sample_face(rig, rng, SIZE, "sparse")
    parameters, camera = sample.parameters, sample.camera
    if yaw is not None:
        turned = (float(np.radians(yaw)), *parameters.head[1:])
        parameters = FaceParameters(parameters.aus, parameters.identity, turned)
        camera = Camera.framing(rig.extent(parameters), SIZE, SIZE, 0.06)
    vertices, style = rig.pose(parameters), sample.style
    lines = draw_strokes(rig, vertices, camera, sample.detail, style.layers, sample.kinds)
    page = draw_page(lines, rig, vertices, camera, style, rng)
    return page.picture.astype(np.float32) / 255


def profile(seed: int) -> np.ndarray:
    """A head from the side."""
    rng = np.random.default_rng((seed, 0x90))
    return head(seed, float(rng.choice([-1, 1]) * rng.uniform(82, 98)))


def half(seed: int) -> np.ndarray:
    """The left or the right half of a frontal face, the upper or the lower."""
    page = head(seed, 0.0)
    ink = np.nonzero(page < 0.7)
    v, u = int(np.median(ink[0])), int(np.median(ink[1]))
    part = seed % 4
    page = page.copy()
    page[{0: np.s_[:, u:], 1: np.s_[:, :u], 2: np.s_[v:], 3: np.s_[:v]}[part]] = 1
    return page
