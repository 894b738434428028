"""The closed, light surface of a head of hair on a person.

Its columns run from the parting, or the whorl, to the edge: over the skull in great circles, and
where hair falls down from where the head is widest. Around a bald crown they begin at its edge. An
outer sheet carries the hair's look, a second one lies a little off the skin, and a rim joins them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..rig import FaceRig
from .cut import ANGLES, AZIMUTHS, Cut
from .head import Head, head_of
from .tails import tail

COLUMNS, ROWS = 72, 20
CLEAR = 0.0012  # metres that the inner sheet keeps off the skin
LEAST = 0.0008  # metres between the two sheets
DEEP = (0.022, 0.003)  # metres between them where hair begins to fall, and at its tips
DENSER = 0.5  # columns where the edge is steep: 0 as many as elsewhere, 1 evenly along the edge
# Share of its thickness that hair loses at a parting, metres of it at most, and metres from it to
# where it is whole, and to where its sides may be of unlike thickness.
GROOVE, ALIKE = (0.5, 0.004, 0.012), 0.06
SHORT = 0.22  # metres of a column that loses the share whatever that is
WHORL = (np.radians(58.0), 0.12)  # elevation of the crown's whorl from behind, half its length
WAVELENGTH = 0.055  # metres of a wave of hair
THINNER = (0.25, 0.02)  # the same two where hair begins around a bald crown
ROOTED = (0.003, 0.6)  # metres that such hair stands off at most where it begins, and as it goes on
GONE = (0.010, 0.006)  # metres of a column below which it sinks into the skin, and how deep
LOCKS, ROOM = 0.005, 0.7  # metres that tips are uneven, and share of a column from which on
STEEP = 0.10  # metres a radian of an edge that is not level
EARS = (0.02, -0.10)  # heights between which an edge at the ear begins to cover it


@dataclass(frozen=True)
class Shell:
    """A head of hair as a mesh, upright in the frame of the rig.

    points : (n, 3) float32, metres
    quads : (q, 4) int32, each turned outwards
    uv : (n, 2) float32, 0..1: u around the head from front to back, alike on both sides (around
        a tail), v along the strands from the parting to the edge
    outer, inner : (columns, rows) int32, points of the two sheets from the parting to the edge,
        column 0 in front, then to the face's own left; at the parting both sides have the same,
        around a bald crown each has its own
    azimuth : (columns,) radians at which each column ends, 0 to 2 pi
    tails : (rings, sides) int32, points of each of the cut's balls, along it and around it
    """

    points: NDArray[np.float32]
    quads: NDArray[np.int32]
    uv: NDArray[np.float32]
    outer: NDArray[np.int32]
    inner: NDArray[np.int32]
    azimuth: NDArray[np.float64]
    tails: tuple[NDArray[np.int32], ...] = ()

    @property
    def triangles(self) -> NDArray[np.int32]:
        """(2 q, 3) the halves of the quads."""
        return np.concatenate([self.quads[:, [0, 1, 2]], self.quads[:, [0, 2, 3]]])


def shell(
    rig: FaceRig,
    identity: Mapping[str, float] | None,
    cut: Cut,
    columns: int = COLUMNS,
    rows: int = ROWS,
) -> Shell:
    """The hair of a person; see `shell_on`."""
    return shell_on(head_of(rig, identity), cut, columns, rows)


def shell_on(head: Head, cut: Cut, columns: int = COLUMNS, rows: int = ROWS) -> Shell:
    """The surface of a cut on a head.

    columns : even;  rows : of each sheet, from the parting to the edge
    """
    azimuth = _azimuths(head, cut, columns)
    share = np.linspace(0, 1, rows)
    ways, drop, along = _paths(head, cut, azimuth, share)
    outer, inner = _sheets(head, cut, azimuth, share, ways, drop, along)
    outer_at, inner_at, quads, uv = layout(columns, rows, cut.top is not None)
    points = np.empty((len(uv), 3))
    for sheet, at in ((outer, outer_at), (inner, inner_at)):
        if cut.top is None:
            sheet[:, 0] = (sheet[:, 0] + sheet[-np.arange(columns), 0]) / 2
        points[at] = sheet
    parts, faces, places, tails = [points], [quads], [uv], []
    for ball in cut.balls:
        more, turned, on, ring = tail(head, ball, 2 * max(columns // 9, 3))
        first = sum(map(len, parts))
        parts.append(more)
        faces.append(turned + first)
        places.append(on)
        tails.append((ring + first).astype(np.int32))
    return Shell(
        np.concatenate(parts).astype(np.float32), np.concatenate(faces).astype(np.int32),
        np.concatenate(places).astype(np.float32), outer_at, inner_at, azimuth, tuple(tails),
    )  # fmt: skip


def lowered(shell: Shell, share: float) -> Shell:
    """The shell with so much of its thickness gone."""
    if not share:
        return shell
    points = shell.points.copy()
    points[shell.outer] += share * (points[shell.inner] - points[shell.outer])
    return replace(shell, points=points)


def edge_heights(cut: Cut, azimuth: NDArray) -> NDArray[np.float64]:
    """(...) heights of a cut's edge at azimuths in radians."""
    return np.interp(azimuth, ANGLES, cut.edge, period=2 * np.pi)


def _azimuths(head: Head, cut: Cut, columns: int) -> NDArray[np.float64]:
    """(columns,) where columns end: closer together where the edge is steep.

    One ends in front and one behind, so that a cut alike on both sides has a shell alike on both.
    """
    fine = np.linspace(0, np.pi, 4 * AZIMUTHS + 1)
    sides = []
    for turn in (1.0, -1.0):
        edge = head.metres(edge_heights(cut, turn * fine))
        width = head.middle[1] - head.eyes[1] + head.above / 2  # metres, about the head's radius
        slope = np.abs(np.diff(edge)) / (width * np.diff(fine))
        density = (1 - DENSER) + DENSER * np.sqrt(1 + slope**2)
        length = np.concatenate([[0.0], np.cumsum(density)])
        sides.append(np.interp(np.linspace(0, length[-1], columns // 2 + 1), length, fine))
    left, right = sides
    return np.concatenate([left, 2 * np.pi - right[-2:0:-1]])


def _paths(
    head: Head, cut: Cut, azimuth: NDArray, share: NDArray
) -> tuple[NDArray, NDArray, NDArray]:
    """Unit ways from the head's middle (c, r, 3), metres fallen and metres from the root (c, r).

    On the skull what hair covers is seen as a disc, the crown its middle and the edge its rim.
    There columns are straight, so that they neither cross nor leave it: an ear they go around.
    """
    widest = head.middle[1] - head.eyes[1]
    edge = head.metres(edge_heights(cut, azimuth))
    low = head.metres(np.array(-1.6))  # what goes deeper without falling would leave the neck
    falls = cut.hangs & (edge < widest)
    at = np.where(falls, widest, np.maximum(edge, low))
    rim = np.arctan2(at - widest, head.levels(head.axis, azimuth, at))

    def reach(around: NDArray) -> NDArray:
        """Radians from the crown to the edge."""
        return np.pi / 2 - np.interp(around, azimuth, rim, period=2 * np.pi)

    ends = _ways(azimuth, rim)
    starts = _starts(head, cut, len(azimuth)) if cut.top is None else _rim(head, cut, azimuth, ends)
    turn = np.arccos(np.clip(np.einsum("ck,ck->c", starts, ends), -1, 1))
    arc = np.maximum(turn, 1e-3) * (head.above - widest) * 1.15
    fall = np.where(falls, widest - edge, 0.0)
    along = share * (arc + fall)[:, None]
    ends_at = np.clip((share - ROOM) / (1 - ROOM), 0, 1) ** 2
    along = along + ends_at * (np.minimum(fall, LOCKS) * _tips(azimuth, edge))[:, None]
    t = np.clip(along / arc[:, None], 0, 1)
    around, elevation = _angles(starts)
    root = np.minimum((np.pi / 2 - elevation) / reach(around), 0.97 if cut.top is None else 1.0)
    x, z = (
        (1 - t) * (root * turned(around))[:, None] + t * turned(azimuth)[:, None]
        for turned in (np.sin, np.cos)
    )
    around = np.arctan2(x, z)
    ways = _ways(around, np.pi / 2 - np.hypot(x, z) * reach(around))
    return ways, np.maximum(along - arc[:, None], 0), along


def _tips(azimuth: NDArray, edge: NDArray) -> NDArray[np.float64]:
    """(c,) -1..1, how much longer falling hair is, in locks, where its edge (c,), m, is level."""
    rise = np.roll(edge, -1) - np.roll(edge, 1)
    run = (np.roll(azimuth, -1) - np.roll(azimuth, 1)) % (2 * np.pi)
    level = 1 / (1 + (rise / run / STEEP) ** 2)
    return level * (np.cos(10 * azimuth) + np.cos(7 * azimuth)) / 2


def _angles(ways: NDArray) -> tuple[NDArray, NDArray]:
    """Azimuths and elevations (...) of unit vectors (..., 3)."""
    return np.arctan2(ways[..., 0], ways[..., 2]), np.arcsin(np.clip(ways[..., 1], -1, 1))


def _ways(azimuth: NDArray, elevation: NDArray) -> NDArray[np.float64]:
    """(..., 3) unit vectors."""
    flat = np.cos(elevation)
    return np.stack([np.sin(azimuth) * flat, np.sin(elevation), np.cos(azimuth) * flat], axis=-1)


def _starts(head: Head, cut: Cut, columns: int) -> NDArray[np.float64]:
    """(c, 3) unit ways from the head's middle to where the columns begin, the same on both sides:
    along a parting from the hairline to the crown, or a short one on the crown."""
    k = np.arange(columns)
    t = np.minimum(k, columns - k) / (columns // 2)
    if cut.part is None:
        up, half = WHORL
        if cut.balls and cut.balls[0].line[0, 1] > 0:  # hair runs to where it is gathered
            up = _elevation(head, cut.balls[0].line[0])
        tilt = up + half * (1 - 2 * t)  # from behind
        return np.stack([0 * t, np.sin(tilt), -np.cos(tilt)], axis=-1)
    lean = cut.part
    height = max(float(edge_heights(cut, np.array(lean))), 0.56)
    front = _way(head, lean * 0.9, height)
    front = front + 0.10 * np.array([0, 1, 0])
    crown = np.array([0.35 * np.sin(lean), np.sin(WHORL[0]), -np.cos(WHORL[0])])
    middle = np.array([0.95 * np.sin(lean), 1.0, 0.25])
    t = (1 - (1 - t) ** 1.5)[:, None]
    ways = (1 - t) ** 2 * front + 2 * t * (1 - t) * middle + t**2 * crown
    return ways / np.linalg.norm(ways, axis=1, keepdims=True)


def _rim(head: Head, cut: Cut, azimuth: NDArray, ends: NDArray) -> NDArray[np.float64]:
    """(c, 3) unit ways from the head's middle to a bald crown's edge above the columns' ends."""
    heights = cut.edge if cut.top is None else cut.top
    top = head.metres(np.interp(azimuth, ANGLES, heights, period=2 * np.pi))
    widest = head.middle[1] - head.eyes[1]
    elevation = np.arctan2(top - widest, head.levels(head.axis, azimuth, top))
    return _ways(azimuth, np.maximum(elevation, _angles(ends)[1]))


def _way(head: Head, azimuth: float, height: float) -> NDArray[np.float64]:
    """(3,) unit way from the head's middle to the skin at an azimuth and a height."""
    metres = head.metres(np.array(height))
    far = head.levels(head.axis, np.array(azimuth), metres)
    up = metres - (head.middle[1] - head.eyes[1])
    return _ways(np.array(azimuth), np.arctan2(up, far))


def _elevation(head: Head, place: NDArray) -> float:
    """Elevation, seen from the head's middle and from behind, of a place of a ball's line."""
    way = _way(head, float(place[0]), min(float(place[1]), 0.97))
    return float(np.arctan2(way[1], -way[2]))


def _sheets(
    head: Head, cut: Cut, azimuth: NDArray, share: NDArray, ways: NDArray, drop: NDArray,
    along: NDArray,
) -> tuple[NDArray, NDArray]:  # fmt: skip
    """(c, r, 3) metres, the outer and the inner sheet."""
    widest = head.middle[1] - head.eyes[1]
    thick = _thickness(cut, azimuth, share)
    if cut.top is not None:
        least, reach = THINNER
        thick = thick * (least + (1 - least) * np.clip(along / reach, 0, 1) ** 0.5)
    else:  # both sides of where hair parts begin at the same place
        step = thick[-np.arange(len(thick)), :1] - thick[:, :1]
        thick = thick + step / 2 * np.clip(1 - along / ALIKE, 0, 1) ** 2
    if cut.part is not None and cut.top is None:
        part, most, reach = GROOVE
        short = np.clip(1 - along[:, -1:] / SHORT, 0, 1)  # a hairline is near
        lost = part * thick[:, :1]
        lost = short * lost + (1 - short) * np.minimum(lost, most)
        thick = thick - lost * (1 - np.clip(along / reach, 0, 1) ** 0.5)
    sunk = np.zeros((len(azimuth), 1))
    if cut.top is not None:
        there = np.clip(along[:, -1:] / GONE[0], 0, 1)
        sunk = GONE[1] * (1 - there)
        # What is thick where there is none would come out of the skin again.
        thick = there * np.minimum(thick, ROOTED[0] + ROOTED[1] * along)
    covers = _covers(cut, azimuth)[:, None]
    skin = head.rays(head.skull, ways)
    skin = skin + covers * (head.rays(head.covered, ways) - skin)
    relief = _relief(cut, azimuth, share, along)
    hangs = drop > 0
    kept = np.where(hangs, 0.0, skin + CLEAR)
    stand = np.maximum(skin + thick, kept + LEAST)
    # What falls keeps off head and ears, and ends where its own thickness is.
    around = np.arctan2(ways[..., 0], ways[..., 2])
    past = head.levels(head.hull, around, widest - drop) + 2 * CLEAR
    inside = np.where(hangs, past, kept)
    outside = np.where(hangs, np.maximum(stand, past + LEAST), stand)
    t = np.clip(drop / 0.12, 0, 1)
    deep = DEEP[0] + (DEEP[1] - DEEP[0]) * t
    gap = np.minimum(deep, np.maximum(outside - inside, LEAST))
    inside = np.where(hangs, outside - gap, inside)
    outside = np.maximum(outside + (relief if cut.top is None else there * relief), inside + LEAST)
    inside, outside = inside - sunk, outside - sunk
    fallen = np.stack([0 * drop, -drop, 0 * drop], axis=-1)
    origin = head.middle + fallen
    return origin + outside[..., None] * ways, origin + inside[..., None] * ways


def _thickness(cut: Cut, azimuth: NDArray, share: NDArray) -> NDArray[np.float64]:
    """(c, r) metres of a cut's thickness between its azimuths and steps."""
    column = azimuth * AZIMUTHS / (2 * np.pi)
    left = np.floor(column).astype(np.intp)
    across = (column - left)[:, None]
    rows = (1 - across) * cut.thick[left % AZIMUTHS] + across * cut.thick[(left + 1) % AZIMUTHS]
    place = share * (cut.thick.shape[1] - 1)
    low = np.minimum(place.astype(np.intp), cut.thick.shape[1] - 2)
    up = place - low
    return rows[:, low] * (1 - up) + rows[:, low + 1] * up


def _covers(cut: Cut, azimuth: NDArray) -> NDArray[np.float64]:
    """(c,) how far the hair at an azimuth goes over the ear there rather than around it."""
    begins, ends = EARS
    ear = np.linspace(np.radians(85), np.radians(100), 4)
    sides = [np.clip((edge_heights(cut, s * ear).max() - begins) / (ends - begins), 0, 1)
             for s in (1, -1)]  # fmt: skip
    turn = (azimuth + np.pi) % (2 * np.pi) - np.pi
    return np.where(turn > 0, sides[0], sides[1])


def wave_phase(azimuth: NDArray) -> NDArray[np.float64]:
    """(...) radians by which waves are ahead at azimuths: neighbours wave together."""
    return 3 * np.cos(3 * azimuth) + 1.5 * np.cos(8 * azimuth)


def _relief(cut: Cut, azimuth: NDArray, share: NDArray, along: NDArray) -> NDArray[np.float64]:
    """(c, r) metres by which waves and curls raise the surface, alike on both sides."""
    rising = np.clip(along / 0.06, 0, 1)
    wave = 0.004 * cut.wave * np.sin(2 * np.pi * along / WAVELENGTH + wave_phase(azimuth)[:, None])
    bumps = np.cos(13 * azimuth)[:, None] * np.cos(2 * np.pi * along / 0.03)
    bumps = bumps + 0.6 * np.cos(2 * np.pi * along / 0.021 + 7 * np.cos(5 * azimuth)[:, None])
    return rising * (wave + 0.003 * cut.curl * bumps)


@lru_cache(maxsize=8)
def layout(columns: int, rows: int, open_: bool) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Points of both sheets (c, r), quads (q, 4) and uv (n, 2), the same for every cut.

    The first row is the parting, whose points column k and column -k share, or where it is open it
    goes around a bald crown, with a rim of its own.
    """
    k = np.arange(columns)
    half = columns if open_ else columns // 2 + 1
    sheet = np.empty((columns, rows), dtype=np.int32)
    sheet[:, 0] = k if open_ else np.minimum(k, columns - k)
    sheet[:, 1:] = half + np.arange(columns * (rows - 1)).reshape(columns, rows - 1)
    count = half + columns * (rows - 1)
    ahead = np.roll(sheet, -1, axis=0)
    out = np.stack([sheet[:, :-1], sheet[:, 1:], ahead[:, 1:], ahead[:, :-1]], axis=-1)
    back = (out + count)[..., ::-1]
    rims = [np.stack([sheet[:, -1], sheet[:, -1] + count, ahead[:, -1] + count, ahead[:, -1]], -1)]
    if open_:
        top, next_ = sheet[:, 0], ahead[:, 0]
        rims.append(np.stack([top, next_, next_ + count, top + count], -1))
    quads = np.concatenate([out.reshape(-1, 4), back.reshape(-1, 4), *rims]).astype(np.int32)
    uv = np.empty((2 * count, 2))
    u = 2 * np.minimum(k, columns - k) / columns
    for at in (sheet, sheet + count):
        uv[at, 0], uv[at, 1] = u[:, None], np.linspace(0, 1, rows)
    inner = sheet + np.int32(count)
    for array in (sheet, inner, quads, uv):
        array.flags.writeable = False
    return sheet, inner, quads, uv
