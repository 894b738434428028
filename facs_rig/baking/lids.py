"""Eyeballs and eyelids: spheres, and lids that slide on them.

MakeHuman's targets squeeze the eyeballs out of round and move lids on straight lines, through the
ball. Here an eyeball only moves and grows, and each lid has one degree of freedom: it turns about
the ball's horizontal axis, on its arc. All controls move lids through these alone (how far is
measured from their targets), so that any combination of blink, squint, gaze and the rest keeps
lids on the ball and stops where they meet.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..keys import Key
from ..raster import rasterise

PIXELS = 10_000.0  # per metre: the opening of the eye is measured to a tenth of a millimetre
REACH_UP, REACH_DOWN = np.radians(27.0), np.radians(30.0)  # skin beyond the rim that a lid pulls
RIM = np.radians(5.0)  # skin that counts as the rim itself
RIM_FADE = np.radians(26.0)  # beyond the rim, where the controls' own movement is back
# How far lids go, as shares of the opening: wide open, and the lower lid's highest place.
WIDEST, LOWER_DOWN, LOWER_UP = -0.55, -0.45, 0.55
# Eyes that are wide open at rest, as stylised ones are: how far they open at all, and how far open
# the arc takes them to be when they open more.
WIDER, OPENER = -0.8, -0.6
# How far lids follow the eye: shares of the opening for each degree that it looks down.
UPPER_FOLLOWS, LOWER_FOLLOWS = 0.019, -0.012
# Blink is set, not measured: it closes the eye, a little from below.
BLINK_UPPER, BLINK_LOWER = 1.0, 0.1
CORNERS = 0.004  # metres beyond the visible ball over which the opening closes to its corner
THINNER = 0.6  # of what the source's lids stand off the ball: they are thicker than real ones
LEAST = 0.015  # of the opening: what moves a lid less does not count


@dataclass(frozen=True)
class Opening:
    """The opening of one eye in the plain face, as angles about the ball's horizontal axis.

    centre : (3,) metres;  radius : metres;  x : (k,) metres from the centre, from one corner of
    the eye to the other;  top, bottom : (k,) radians above the horizontal
    """

    centre: NDArray
    radius: float
    x: NDArray
    top: NDArray
    bottom: NDArray

    def at(self, x: NDArray) -> tuple[NDArray, NDArray]:
        """Angles of both rims at `x`; beyond the corners they are one."""
        places = np.concatenate([[self.x[0] - CORNERS], self.x, [self.x[-1] + CORNERS]])
        middle = (self.top + self.bottom) / 2
        top, bottom = (
            np.interp(x, places, np.concatenate([middle[:1], rim, middle[-1:]]))
            for rim in (self.top, self.bottom)
        )
        return top, bottom


def keep_round(deltas: NDArray, rest: NDArray, ball: NDArray, joint: int) -> None:
    """Replace an eyeball's displacements by the nearest shift and growth, in place.

    deltas : (k, n, 3) of targets;  rest : (n, 3) with a round ball;  ball : (b,) its vertices;
    joint : the vertex at its centre. Least squares; linear, so sums of targets stay round.
    """
    middle = rest[ball].mean(axis=0)
    arm = rest[ball] - middle
    moved = deltas[:, ball]
    shift = moved.mean(axis=1)[:, None]
    growth = (np.einsum("kbd,bd->k", moved, arm) / np.sum(arm**2))[:, None, None]
    deltas[:, ball] = shift + growth * arm
    deltas[:, joint] = (shift + growth * (rest[joint] - middle))[:, 0]


def hold_rim(
    points: NDArray,
    centre: NDArray,
    radius: float,
    field: LidField,
    rest: NDArray,
    thickness: float = 1.0,
) -> NDArray[np.float64]:
    """(m, 3) points of an identity with the lids' rims on its ball as those at rest.

    centre, radius : of the ball of that identity;  rest : (m, 3) the plain face;
    thickness : of the lids, as a share of what stands off the ball at rest. Only the distance
    from the ball's centre changes, so that the eye keeps the identity's shape.
    """
    opening = field.opening
    far = np.linalg.norm(rest - opening.centre, axis=1, keepdims=True) / opening.radius
    far = np.where(far > 1, 1 + thickness * (far - 1), far)
    arm = points - centre
    length = np.linalg.norm(arm, axis=1, keepdims=True)
    held = centre + arm * (far * radius / np.maximum(length, 1e-9))
    return points + field.rim[:, None] * (held - points)


def measure_opening(vertices: NDArray, triangles: NDArray, is_eye: NDArray, left: bool) -> Opening:
    """The opening between the lids, as seen from the front on the fine plain face.

    vertices : (n, 3), without lashes;  is_eye : (t,) which triangles are eyeball
    """
    side = 1 if left else -1
    own = is_eye & (side * vertices[triangles[:, 0], 0] > 0)
    ball = vertices[np.unique(triangles[own])]
    low, high = ball.min(axis=0), ball.max(axis=0)
    centre, radius = (low + high) / 2, float((high[0] - low[0]) / 2)
    width = int(4 * radius * PIXELS)
    scale = (PIXELS, PIXELS)
    camera = Camera(width, width, scale, (width / 2 - PIXELS * centre[0],
                                          width / 2 + PIXELS * centre[1]))  # fmt: skip
    seen = rasterise(vertices, triangles, camera).triangle
    eye = (seen >= 0) & own[seen]
    columns = np.flatnonzero(eye.sum(axis=0) > 2)
    x = (columns + 0.5 - width / 2) / PIXELS
    first, last = eye[:, columns].argmax(axis=0), width - eye[::-1, columns].argmax(axis=0)
    y_top, y_bottom = (width / 2 - first) / PIXELS, (width / 2 - last) / PIXELS

    def angle(y: NDArray) -> NDArray:
        return np.arctan2(y, np.sqrt(np.maximum(radius**2 - x**2 - y**2, 1e-8)))

    return Opening(centre, radius, x, angle(y_top), angle(y_bottom))


def _polar(points: NDArray, opening: Opening) -> tuple[NDArray, NDArray, NDArray]:
    """x, angle and radius of points about the ball's horizontal axis."""
    local = points - opening.centre
    return local[:, 0], np.arctan2(local[:, 1], local[:, 2]), np.hypot(local[:, 1], local[:, 2])


def _ease(t: NDArray) -> NDArray:
    """1 at 0 and below, 0 at 1 and above, smooth."""
    t = np.clip(t, 0, 1)
    return 1 - t * t * (3 - 2 * t)


@dataclass(frozen=True)
class LidField:
    """How cage vertices follow the lids of one eye: upper, lower (m,) in 0..1 times the opening
    `sweep` (m,) in radians at their x; rim (m,) in 0..1 where the lids alone decide."""

    opening: Opening
    upper: NDArray
    lower: NDArray
    sweep: NDArray
    rim: NDArray

    def turned(self, cage: NDArray, upper: float, lower: float) -> NDArray[np.float64]:
        """The cage (m, 3) with the upper lid closed and the lower raised by shares of the
        opening, every vertex on its own arc."""
        x, angle, radius = _polar(cage, self.opening)
        angle = angle + self.sweep * (lower * self.lower - upper * self.upper)
        arc = np.stack([x, radius * np.sin(angle), radius * np.cos(angle)], axis=1)
        moved = (self.upper > 0) | (self.lower > 0)
        return np.where(moved[:, None], arc + self.opening.centre, cage)


def lid_field(
    cage: NDArray, skin: NDArray, lashes_up: NDArray, lashes_down: NDArray, opening: Opening
) -> LidField:
    """Which cage vertices (m, 3) move with the lids of one eye; skin, lashes_... : (m,) bool."""
    x, angle, radius = _polar(cage, opening)
    top, bottom = opening.at(x)
    sweep = np.maximum(top - bottom, 0)
    span = opening.x[-1] - opening.x[0]
    middle = (opening.x[0] + opening.x[-1]) / 2
    across = np.abs(x - middle) / span
    near = (across < 0.75) & (radius < opening.radius + 0.016) & (np.abs(angle) < np.radians(100))
    above = angle > (top + bottom) / 2
    deep = radius < opening.radius - 0.004  # the socket's own skin, behind the ball's surface
    fade = np.where(deep, 0.0, 1.0)
    upper = near & skin & above
    lower = near & skin & ~above
    field_up = upper * _ease((angle - top - RIM) / REACH_UP) * fade
    field_down = lower * _ease((bottom - angle - RIM) / REACH_DOWN) * fade
    rim = np.where(
        above, _ease((angle - top - RIM) / RIM_FADE), _ease((bottom - angle - RIM) / RIM_FADE)
    )
    rim = near * skin * rim * _ease((across - 0.5) / 0.2)
    own = np.abs(x - middle) < 0.8 * span
    field_up = np.where(lashes_up & own, 1.0, field_up)
    field_down = np.where(lashes_down & own, 1.0, field_down)
    lash = (lashes_up | lashes_down) & own
    rim = np.where(lash, 1.0, rim)
    # Lashes flare out beyond the corner; they go as far as the lid does where they grow.
    top, bottom = opening.at(np.clip(x, opening.x[0] + 0.001, opening.x[-1] - 0.003))
    sweep = np.where(lash, top - bottom, sweep)
    return LidField(opening, field_up, field_down, sweep, rim)


def lid_shares(
    fine: NDArray, moved: NDArray, opening: Opening, quantile: float = 0.5
) -> tuple[float, float]:
    """How far a control closes the upper lid and raises the lower, as shares of the opening.

    fine, moved : (n, 3) skin vertices of the plain face, and with the control at intensity 5;
    quantile : of the shares along the middle of the lid
    """
    x, angle, radius = _polar(fine, opening)
    top, bottom = opening.at(x)
    span = opening.x[-1] - opening.x[0]
    middle = np.abs(x - (opening.x[0] + opening.x[-1]) / 2) < 0.25 * span
    middle &= (radius > opening.radius + 0.001) & (radius < opening.radius + 0.008)
    turned = _polar(moved, opening)[1] - angle
    shares = []
    for distance, sign in ((angle - top, -1), (bottom - angle, 1)):
        rim = middle & (np.abs(distance) < RIM)
        shares.append(float(np.quantile(sign * turned[rim] / (top - bottom)[rim], quantile)))
    return shares[0], shares[1]


def lid_keys(
    side: str, upper: dict[str, float], lower: dict[str, float]
) -> tuple[Key, Key, Key, Key]:
    """The four keys of one eye's lids: how far each is moved, and the way out onto its arc.

    upper, lower : shares of the opening by control, at intensity 5. The upper lid stops at the
    lower one; `lid_rest` is how far the identity's eyes are closed to begin with, r: its arc
    goes on from there, (r + u) (1 - r - u) - r (1 - r) = u (1 - u - 2 r); half of r is the lower's.
    """

    def total(shares: dict[str, float], follows: float) -> str:
        terms = [f"{value / 5:+.4g}*{name}" for name, value in shares.items()]
        return "".join([*terms, f"{follows:+.4g}*gaze_pitch"]).lstrip("+")

    low, up = f"lid_lower_{side}", f"lid_upper_{side}"
    raised = f"min(max({total(lower, LOWER_FOLLOWS)},{LOWER_DOWN}),{LOWER_UP})"
    opened = f"max(max({total(upper, UPPER_FOLLOWS)},{WIDEST})*(1-lid_rest),{WIDER})"
    upper_value = f"min({opened},1-lid_rest-{low})"
    farther = f"(lid_rest*max({up},0)+max(lid_rest,{OPENER})*min({up},0))"
    return (
        Key(low, f"{raised}*min(1,1-lid_rest)"),
        Key(up, upper_value),
        Key(f"{low}_arc", f"2*{low}*(1-{low}-lid_rest)"),
        Key(f"{up}_arc", f"2*{up}*(1-{up})-4*{farther}"),
    )


def lid_deltas(cage: NDArray, field: LidField) -> NDArray[np.float64]:
    """(4, m, 3) displacements of `lid_keys`, in their order.

    On a circle the place at half the way lies off the chord; the arc keys add that parabola.
    """
    out = []
    for upper, lower in ((0.0, 1.0), (1.0, 0.0)):
        whole = field.turned(cage, upper, lower) - cage
        half = field.turned(cage, upper / 2, lower / 2) - cage
        out.append((whole, 2 * half - whole))
    return np.stack([out[0][0], out[1][0], out[0][1], out[1][1]])
