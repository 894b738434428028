"""A hat as parameters that carry from person to person, and the closed surface made of them.

Its crown is two sheets and a rim, as hair is, by rays from the head's middle; a brim or a peak goes
around the rim or lies before a part of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from ..common.errors import InputError
from ..mesh import is_shape
from ..rig import FaceRig
from ..shape import Worn
from .cut import ANGLES, AZIMUTHS, Cut
from .follow import Bound, bind
from .head import Head, head_of
from .shell import CLEAR, LEAST, Shell, layout, shell_on

NAME, ROUGHNESS = "hat", 0.8
COLUMNS, ROWS = 72, 24  # of the crown's two sheets, around and from its top to the rim
TOP = 0.04  # share of a row that the crown's top is long, where its columns begin
BRIM = 5  # rings of a brim, from the rim outwards
FLAT = 0.003  # metres, how thick a brim is
LIP = 0.0015  # metres that a brim juts out at least, all around: a hem
UNDER, HIGHEST = 0.1, 0.93  # height around a rim at which hair goes under it, and of its edge
FLATTENED, LOOSE = 0.004, 0.25  # metres that hair stands off under a hat, and its curls at most
# Linear RGB of cloth by how dark it is drawn: undyed, a greyish blue, and black.
TONES = (0.0, 0.45, 1.0)
DYES = ((0.80, 0.745, 0.64), (0.115, 0.125, 0.155), (0.010, 0.010, 0.012))
STEP = 0.011  # share of a column over which a band's upper border falls to the crown
RIBBON = 0.42  # of the colour: a band that does not stand off is one
CREASE, SHADED = 0.55, 0.62  # the same above a cuff and where a brim begins, and of what is inside
PEAKED, SEAM, SEAMS = 0.86, 0.86, 6  # the same of a peak, of a cap's seams, and how many it has


@dataclass(frozen=True)
class Hat:
    """One hat. The arrays run over `cut.ANGLES`.

    edge : (48,) float, height of its rim as in `Cut.edge`
    thick : (48, r) float, metres that its crown stands off the skin in r equal steps of the angle
        from its top, straight above the head's middle, to the rim
    brim : (48,) float, metres that its brim juts out, 0 where there is none
    droop : metres that the brim's border lies lower for each metre that it juts out
    colour : 0 light to 1 black
    cloth : of a hood or a scarf, which falls as hair does, the cut that it is like; the rest is
        idle
    band : metres that a band goes up from the rim, 0 without one
    cuff : metres that the band stands off the crown, as what is folded up does; 0 for a ribbon

    InputError for arrays of another shape and for numbers that are none or out of range.
    """

    edge: NDArray[np.float64]
    thick: NDArray[np.float64]
    brim: NDArray[np.float64]
    droop: float = 0.0
    colour: float = 0.3
    cloth: Cut | None = None
    band: float = 0.0
    cuff: float = 0.0

    def __post_init__(self) -> None:
        crown = Cut(self.edge, self.thick)  # the same of both is checked
        brim = is_shape(np.array(self.brim, dtype=np.float64), (AZIMUTHS,), "brim")
        if not (np.isfinite(brim).all() and (brim >= 0).all() and np.isfinite(self.droop)):
            raise InputError("a hat's brim must jut out by 0 metres or more")
        if not (0 <= self.band < np.inf and 0 <= self.cuff < np.inf):
            raise InputError("a hat's band must be 0 metres high or more, and stand off as much")
        if not 0 <= self.colour <= 1:
            raise InputError(f"a hat's colour must be from 0 to 1, got {self.colour}")
        brim.flags.writeable = False
        for name, values in (("edge", crown.edge), ("thick", crown.thick), ("brim", brim)):
            object.__setattr__(self, name, values)

    @property
    def peaked(self) -> bool:
        """Whether it has a peak: what juts out does not go all around."""
        return bool(self.brim.max() > 0 and self.brim.min() == 0)

    @classmethod
    def hanging(cls, cut: Cut, colour: float) -> Hat:
        """A hood or a scarf where hair would be."""
        plain = replace(cut, part=None, wave=0.0, curl=0.0, balls=())
        return cls(plain.edge, plain.thick, np.zeros(AZIMUTHS), 0.0, colour, plain)


@dataclass(frozen=True)
class HatMesh:
    """A hat on a person.

    points : (n, 3) float32, metres, on the upright person at rest
    quads : (q, 4) int32, turned outwards      uv : (n, 2) float32, 0..1
    shade : (n,) float32, of the colour      colour : linear RGB
    bound : how it follows the skull      hat : what it was made of
    """

    points: NDArray[np.float32]
    quads: NDArray[np.int32]
    uv: NDArray[np.float32]
    shade: NDArray[np.float32]
    colour: tuple[float, float, float]
    bound: Bound
    hat: Hat

    @property
    def triangles(self) -> NDArray[np.int32]:
        """(2 q, 3) the halves of the quads."""
        return np.concatenate([self.quads[:, [0, 1, 2]], self.quads[:, [0, 2, 3]]])

    def on(self, vertices: NDArray) -> NDArray[np.float32]:
        """(n, 3) metres, the points on a posed face (v, 3) of the rig."""
        return self.bound.points(vertices)

    def lying_on(self, vertices: NDArray) -> HatMesh:
        """The same hat, its points on an upright face at rest (v, 3) whose skin was fitted."""
        return replace(self, points=self.on(vertices))

    def worn_on(self, vertices: NDArray) -> Worn:
        """The same as a face wears it in a file."""
        points = self.on(vertices)
        return Worn(NAME, points, self.quads, self.uv, self.shade, self.colour, ROUGHNESS)


def hat_mesh(rig: FaceRig, identity: Mapping[str, float] | None, hat: Hat) -> HatMesh:
    """The hat of a person; the same hat makes the same mesh. InputError for what no person is."""
    head = head_of(rig, identity)
    crown = crown_on(head, hat) if hat.cloth is None else shell_on(head, hat.cloth)
    points, quads, uv = [crown.points], [crown.quads], [crown.uv]
    if hat.cloth is None:
        rim = crown.points[crown.outer[:, -1]].astype(float)
        more, faces = _brim(head, hat, rim, crown.azimuth)
        points.append(more.astype(np.float32))
        quads.append(faces + len(crown.points))
        around = np.linspace(0, 1, len(rim), endpoint=False)
        out = np.tile(np.linspace(0, 1, BRIM), 2)
        uv.append(np.stack(np.meshgrid(around, out), axis=-1).reshape(-1, 2))
    every = np.concatenate(points).astype(np.float32)
    shade = _shade(head, hat, crown, len(every))
    dyes = np.sqrt(DYES).T
    colour = tuple(float(np.interp(hat.colour, TONES, dye)) ** 2 for dye in dyes)
    return HatMesh(
        every,
        np.concatenate(quads).astype(np.int32),
        np.concatenate(uv).astype(np.float32),
        shade,
        (colour[0], colour[1], colour[2]),
        bind(every, rig, identity),
        hat,
    )


def crown_on(head: Head, hat: Hat, columns: int = COLUMNS, rows: int = ROWS) -> Shell:
    """A hat without its brim. columns : even, around it;  rows : from its top to the rim"""
    azimuth = 2 * np.pi * np.arange(columns) / columns
    share, first = _shares(head, hat, rows)
    ways = ways_of(head, hat.edge, azimuth, share)
    around, out = _disc(azimuth, share)
    skin = head.rays(head.covered, ways)
    off = thickness(hat.thick, around, np.minimum(out, 1))
    off[:, first:] += hat.cuff
    stand = skin + np.maximum(off, CLEAR + LEAST)
    outer_at, inner_at, quads, uv = layout(columns, rows, False)
    points = np.empty((len(uv), 3), dtype=np.float32)
    for far, at in ((stand, outer_at), (skin + CLEAR, inner_at)):
        points[at] = head.middle + far[..., None] * ways
    return Shell(points, quads, uv.astype(np.float32), outer_at, inner_at, azimuth)


def _shares(head: Head, hat: Hat, rows: int) -> tuple[NDArray[np.float64], int]:
    """(rows,) shares of the way from a hat's top to its rim, and the first row of its band."""
    even = np.linspace(0, 1, rows)
    if not hat.band:
        return even, rows
    metres = head.metres(hat.edge)
    far = head.levels(head.axis, ANGLES, metres)
    up = metres - (head.middle[1] - head.eyes[1])
    long = np.mean((np.pi / 2 - np.arctan2(up, far)) * np.hypot(up, far))
    begins = float(np.clip(1 - hat.band / long, 0.4, 0.97))
    k = int(np.clip(round(begins * (rows - 1)), 2, rows - 2))
    at = [0, k - 1, k, rows - 1]
    return np.interp(np.arange(rows), at, [0, begins - STEP, begins, 1]), k


def _disc(azimuth: NDArray, share: NDArray) -> tuple[NDArray, NDArray]:
    """(c, r) azimuths and shares of the way from a hat's top to its rim, at places of its columns.

    As a disc: the top is its middle and the rim its border; the columns of both sides meet on a
    short line in the middle.
    """
    x = share * np.sin(azimuth)[:, None]
    z = (share + (1 - share) * TOP) * np.cos(azimuth)[:, None]
    return np.arctan2(x, z), np.hypot(x, z)


def ways_of(head: Head, edge: NDArray, azimuth: NDArray, share: NDArray) -> NDArray[np.float64]:
    """(c, r, 3) unit vectors from the head's middle to the places of a crown's columns.

    edge : (48,) heights of its rim;  azimuth : (c,) radians;  share : (r,) of the way to the rim
    """
    around, out = _disc(azimuth, share)
    metres = head.metres(np.interp(around, ANGLES, edge, period=2 * np.pi))
    up = metres - (head.middle[1] - head.eyes[1])
    rim = np.arctan2(up, head.levels(head.axis, around, metres))
    elevation = np.pi / 2 - np.minimum(out, 1) * (np.pi / 2 - rim)
    flat = np.cos(elevation)
    return np.stack(
        [np.sin(around) * flat, np.sin(elevation), np.cos(around) * flat], axis=-1
    )  # fmt: skip


def _shade(head: Head, hat: Hat, crown: Shell, count: int) -> NDArray[np.float32]:
    """(count,) of the colour: bands, seams and creases are darker, and so is what is inside."""
    shade = np.ones(count, dtype=np.float32)
    shade[crown.inner] = SHADED
    if hat.cloth is not None:
        return shade
    columns, rows = crown.outer.shape
    if hat.peaked:
        shade[crown.outer[:: columns // SEAMS]] = SEAM
    if hat.band:
        _, first = _shares(head, hat, rows)
        shade[crown.outer[:, first - 1]] = CREASE
        shade[crown.outer[:, first:]] = 1.0 if hat.cuff else RIBBON
    upper, lower = shade[len(crown.points) :].reshape(2, BRIM, columns)
    upper[:] = PEAKED if hat.peaked else 1.0
    upper[0] = CREASE
    lower[:] = SHADED
    return shade


def thickness(thick: NDArray, azimuth: NDArray, share: NDArray) -> NDArray[np.float64]:
    """(...) metres of a hat's `thick` (48, r) at azimuths in radians and shares from top to rim."""
    column, row = azimuth * AZIMUTHS / (2 * np.pi), share * (thick.shape[1] - 1)
    left = np.floor(column).astype(np.intp)
    low = np.clip(row.astype(np.intp), 0, thick.shape[1] - 2)
    a, b = column - left, row - low
    left, right = left % AZIMUTHS, (left + 1) % AZIMUTHS
    lower = thick[left, low] * (1 - a) + thick[right, low] * a
    upper = thick[left, low + 1] * (1 - a) + thick[right, low + 1] * a
    return lower * (1 - b) + upper * b


def pressed(cut: Cut, hat: Hat, head: Head) -> Cut:
    """Hair under a hat: flat as far as the hat goes, no bun there, and seen below the rim alone."""
    rim = hat.edge
    # What ends at the rim was not drawn below it.
    edge = np.where(cut.edge > rim - UNDER, np.maximum(cut.edge, rim + UNDER), cut.edge)
    edge = np.minimum(edge, HIGHEST)
    steps = np.linspace(0, 1, ROWS)
    given = np.linspace(0, 1, cut.thick.shape[1])
    fine = np.stack([np.interp(steps, given, row) for row in cut.thick])
    under = shell_on(head, cut, rows=ROWS)
    places = under.points[under.outer] - head.eyes
    around = np.arctan2(places[..., 0], places[..., 2] + head.eyes[2] - head.middle[2])
    above = head.height(places[..., 1]) - np.interp(around, ANGLES, rim, period=2 * np.pi)
    order = np.argsort(under.azimuth)
    above = np.stack(
        [np.interp(ANGLES, under.azimuth[order], of[order], period=2 * np.pi) for of in above.T],
        axis=1,
    )
    share = np.clip(1 + above / UNDER, 0, 1)  # thinner already a little below the rim
    share = maximum_filter(share, (5, 3), mode=("wrap", "nearest"))
    thick = np.where(share > 0, np.minimum(fine, FLATTENED + (1 - share) * 0.05), fine)
    balls = tuple(ball for ball in cut.balls if ball.line[0, 1] < rim.min())
    curl = min(cut.curl, LOOSE)
    flat = replace(cut, edge=edge, thick=thick, part=None, balls=balls, curl=curl)
    return replace(flat, stand=0.0, sweep=None)


def _brim(
    head: Head, hat: Hat, rim: NDArray, azimuth: NDArray
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """A closed ring of its own, (2 BRIM columns, 3) and quads: an upper sheet from the rim (c, 3)
    outwards, and a lower one that goes back under the crown."""
    columns = len(rim)
    juts = np.maximum(np.interp(azimuth, ANGLES, hat.brim, period=2 * np.pi), LIP)
    way = rim - head.middle
    way[:, 1] = 0
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    share = np.linspace(0, 1, BRIM)[:, None]
    # It begins inside the crown, level, and falls the more the farther out it is.
    out = share * juts - (1 - share) * 0.004
    fall = hat.droop * juts * share**1.5
    upper = rim + out[..., None] * way - fall[..., None] * [0, 1, 0]
    lower = upper - [0, FLAT, 0]
    lower[-1] += 0.3 * FLAT * np.array([0, 1, 0])
    points = np.concatenate([upper, lower]).reshape(-1, 3)
    k = np.arange(2 * BRIM * columns).reshape(2, BRIM, columns)
    ahead = np.roll(k, -1, axis=2)
    top = np.stack([k[0, :-1], k[0, 1:], ahead[0, 1:], ahead[0, :-1]], axis=-1)
    under = np.stack([k[1, :-1], ahead[1, :-1], ahead[1, 1:], k[1, 1:]], axis=-1)
    border = np.stack([k[0, -1], k[1, -1], ahead[1, -1], ahead[0, -1]], axis=-1)
    inside = np.stack([k[0, 0], ahead[0, 0], ahead[1, 0], k[1, 0]], axis=-1)
    parts = [part.reshape(-1, 4) for part in (top, under, border, inside)]
    return points, np.concatenate(parts)
