"""Stylised people: smooth displacements of the whole head that go where no person's head goes.

A target of MakeHuman's beyond its end folds the skin. So what is beyond a feature's human range is
a *warp*: a displacement field in space that is linear in its weight. Each is put together from a
few profiles whose slope is bounded, so that space is squeezed beside what grows but not turned
over. The eyes are left alike: within a ball, its lids and its lashes every field is a shift and a
growth that is the same in all directions, so that balls stay spheres and lids lie on them.

What moves by keys moves as far as the space around it was stretched: a warp's `growth` is the
diagonal of its derivative, which is found by differences.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..identity import STYLED
from .makehuman import JOINTS

FINEST, FINEST_GROWTH = 2.0**-18, 2.0**-9  # metres; shares
Points = NDArray[np.float64]  # (k, 3) metres, upright, from the head's joint
Field = Callable[[Points], Points]
OPENING = "eye_opening"  # the one that is no field: lids go on along the ball
STEP = 1e-6  # metres, of the differences
MIRROR = np.array([-1.0, 1.0, 1.0])

# Places in the default face, and sizes, in metres.
EYE = 0.0195  # from a ball's centre: the ball, the lids' rims, the roots of the lashes
EYE_FADE = 0.037  # ... where a field is itself again; the other eye begins at 0.038
NOSE_ROOT = np.array([0.0, 0.020, 0.094])
NOSE_TIP = np.array([0.0, -0.011, 0.108])
MOUTH = np.array([0.0, -0.040, 0.095])
CHIN = np.array([0.0, -0.068, 0.078])
CHEEK = np.array([0.044, -0.014, 0.075])
EAR_ROOT = np.array([0.066, 0.018, 0.003])


# --- profiles -------------------------------------------------------------------------------------


def ease(x: NDArray, a: float, b: float) -> NDArray[np.float64]:
    """0 at a, 1 at b (which may lie below a), twice smooth and level beyond both."""
    t: NDArray[np.float64] = np.clip((x - a) / (b - a), 0, 1)
    out: NDArray[np.float64] = t**3 * (10 - 15 * t + 6 * t * t)
    return out


def ramp(x: NDArray, a: float, b: float) -> NDArray[np.float64]:
    """The integral of `ease`: 0 up to a, slope 1 from b on."""
    t = np.clip((x - a) / (b - a), 0, 1)
    return (b - a) * t**4 * (2.5 - 3 * t + t * t) + np.maximum(x - b, 0)


def swell(x: NDArray, full: float, back: float, soft: float = 0.01) -> NDArray[np.float64]:
    """A movement along x: x itself up to `full`, then falling by `back` for each metre, to 0. Odd.

    Its slope is between -back and 1: with a weight below 1 / back nothing turns over.
    """
    r = np.abs(x)
    end = (1 + back) / back * (full + soft / 2)
    out = r - (1 + back) * ramp(r, full, full + soft)
    out += back * ramp(r, end - soft / 2, end + soft / 2)
    return np.sign(x) * out


def around(p: Points, centre: NDArray, full: float, reach: ArrayLike) -> NDArray[np.float64]:
    """(k,) 1 within a share `full` of an ellipsoid's `reach` around a place, 0 beyond it."""
    away = np.linalg.norm((p - centre) / np.asarray(reach, float), axis=1)
    return ease(away, 1.0, full)


def along(axis: int, amount: NDArray) -> Points:
    """(k, 3) of amounts (k,) along one axis."""
    out = np.zeros((len(amount), 3))
    out[:, axis] = amount
    return out


def both(field: Field) -> Field:
    """A field of the left side, and its mirror image."""
    return lambda p: field(p) + MIRROR * field(MIRROR * p)


# --- the fields, at weight 1 ----------------------------------------------------------------------


@dataclass(frozen=True)
class Eyes:
    """centre : (3,) of the left ball. What only concerns the eyes, and what has to spare them."""

    centre: NDArray[np.float64]

    def spared(self, field: Field, even: float = 0.0) -> Field:
        """The field, but around each eye a shift and a growth: `even` of its own stretch there."""

        def out(p: Points) -> Points:
            d = field(p)
            total = d.copy()
            for centre in (self.centre, MIRROR * self.centre):
                at = centre[None]
                stretch = even * growth_of(field, at).sum()
                near = ease(np.linalg.norm(p - centre, axis=1), EYE_FADE, EYE)
                total += near[:, None] * (field(at) + stretch * (p - centre) - d)
            return total

        return out

    def size(self, p: Points) -> Points:
        """Three quarters larger. Eyes grow away from each other and into the head, so that at the
        largest, 2.5 times, there is still a nose between them and they stand in one face."""
        x, y, z = (p - (0, *self.centre[1:])).T
        middle, out_by, back_by = self.centre[0], 0.0120, 0.0135
        below = 0.65 * ramp(-y, 0.005, 0.020)  # cheeks have less room than foreheads
        beside = np.maximum(np.abs(x) - middle, 0)  # from the line between both eyes
        away = np.sqrt(beside**2 + (y - below) ** 2 + z**2)
        wide = np.sqrt(beside**2 + (0.55 * y) ** 2 + (0.8 * z) ** 2)  # jaw and skull go along
        inner = 0.0155  # from the middle, where the nose's side becomes the eye's corner
        meet = inner - 0.003  # of the two straight parts of the movement along x
        squeezed = 1 - (middle - out_by) / meet
        r = np.abs(x)
        sideways = squeezed * r + (1 - squeezed) * ramp(r, 2 * meet - inner, inner)
        nose = ease(r, inner, 0.002) * ease(y, 0.022, -0.002)
        own = 1 - 0.8 * nose
        grown, grown_wide = (
            np.where(far > 1e-9, swell(far, EYE, 0.35, 0.014) / np.maximum(far, 1e-9), 1.0)
            for far in (away, wide)
        )
        deep = own * (z - back_by) * ease(away, 0.04, EYE)
        return np.stack([own * np.sign(x) * sideways * grown_wide, own * y * grown, deep], axis=1)

    def spacing(self, p: Points) -> Points:
        """Six millimetres outward."""

        def left(p: Points) -> Points:
            near = around(p, self.centre, EYE / 0.036, (0.036, 0.045, 0.05))
            return near[:, None] * (0.006, 0.0, -0.001)

        return both(left)(p)

    def height(self, p: Points) -> Points:
        """Eight millimetres up, with what is between them and the brows."""
        x, y, z = (p - (0, *self.centre[1:])).T
        beside = np.maximum(np.abs(x) - self.centre[0], 0)
        away = np.sqrt((beside / 0.055) ** 2 + (y / 0.08) ** 2 + (z / 0.07) ** 2)
        return along(1, 0.008 * ease(away, 1.0, EYE / 0.055))


def head_width(p: Points) -> Points:
    return along(0, 0.15 * p[:, 0] * _of_head(p))


def head_height(p: Points) -> Points:
    return along(1, 0.15 * (p[:, 1] - 0.03) * _of_head(p))


def forehead_height(p: Points) -> Points:
    """The skull above the brows, taller and a little wider."""
    above = ramp(p[:, 1], 0.045, 0.085)
    wide = 0.5 * ease(p[:, 1], 0.04, 0.12)
    return 0.25 * np.stack([wide * p[:, 0] * 0.3, above, 0.3 * wide * (p[:, 2])], axis=1)


def head_shape(p: Points) -> Points:
    """Wide below and narrow above."""
    y = p[:, 1]
    taper = ramp(y, -0.09, -0.04) - ramp(y, 0.09, 0.14) - 0.09
    return along(0, -1.6 * taper * p[:, 0] * _of_head(p))


def nose_width(p: Points) -> Points:
    x = swell(p[:, 0], 0.017, 0.7, 0.006)
    return along(0, 0.27 * x * _of_nose(p))


def nose_length(p: Points) -> Points:
    """From its root down; what is below makes room."""
    down = NOSE_ROOT[1] - p[:, 1]
    y = -swell(ramp(down, -0.005, 0.015), 0.032, 0.7, 0.008)
    beside = around(p * (1, 0, 1), NOSE_ROOT * (1, 0, 1), 0.35, (0.05, 1, 0.06))
    return along(1, 0.27 * y * beside)


def nose_depth(p: Points) -> Points:
    z = ramp(p[:, 2], 0.088, 0.098)
    return along(2, 0.27 * z * _of_nose(p))


def nose_tip_width(p: Points) -> Points:
    """A ball at the nose's tip."""
    near = around(p, NOSE_TIP, 0.3, (0.032, 0.023, 0.034))
    return 0.4 * near[:, None] * (p - NOSE_TIP)


def cheek_volume(p: Points) -> Points:
    near = around(p, CHEEK, 0.0, (0.04, 0.045, 0.06))
    return near[:, None] * (0.0065, -0.001, 0.004)


def chin_height(p: Points) -> Points:
    down = ramp(-p[:, 1], 0.045, 0.062)
    front = ease(p[:, 2], -0.01, 0.05)
    return along(1, -0.4 * down * front * ease(p[:, 1], -0.13, -0.08))


def chin_width(p: Points) -> Points:
    x = swell(p[:, 0], 0.02, 0.35, 0.02)
    return along(0, 0.3 * x * around(p, CHIN, 0.25, (0.2, 0.05, 0.09)))


def chin_forward(p: Points) -> Points:
    return along(2, 0.007 * around(p, CHIN, 0.15, (0.05, 0.045, 0.06)))


def jaw_width(p: Points) -> Points:
    low = around(p, np.array([0, -0.05, 0.045]), 0.2, (1.0, 0.065, 0.08))
    return along(0, 0.15 * p[:, 0] * low)


def mouth_width(p: Points) -> Points:
    x = swell(p[:, 0], 0.024, 0.5, 0.01)
    return along(0, 0.3 * x * around(p, MOUTH, 0.45, (0.2, 0.045, 0.06)))


def mouth_height(p: Points) -> Points:
    return along(1, 0.007 * around(p, MOUTH, 0.3, (0.055, 0.045, 0.09)))


def lip(side: int) -> Field:
    """Fuller upper (1) or lower (-1) lip: from where lips meet, up or down, and forward."""

    def field(p: Points) -> Points:
        away = side * (p[:, 1] - MOUTH[1])
        near = around(p * (1, 0, 1), MOUTH * (1, 0, 1) + (0, 0, 0.006), 0.3, (0.03, 1, 0.022))
        grown = swell(ramp(away, 0.0, 0.003), 0.009, 0.6, 0.005)
        full = ease(away, 0, 0.006) * ease(away, 0.024, 0.008)
        return near[:, None] * np.stack([0 * away, 0.5 * side * grown, 0.0025 * full], axis=1)

    return field


def brow_height(p: Points) -> Points:
    return along(1, 0.005 * around(p, np.array([0, 0.052, 0.1]), 0.2, (0.1, 0.055, 0.09)))


def ear_size(p: Points) -> Points:
    flat = (p - EAR_ROOT) * (0, 1, 1)
    away = np.linalg.norm(flat, axis=1, keepdims=True)
    grown = swell(away, 0.034, 0.6, 0.008) / np.maximum(away, 1e-9)
    out = along(0, ramp(p[:, 0], 0.062, 0.07) * ease(away[:, 0], 0.06, 0.036))
    return 0.35 * (ease(p[:, 0], 0.02, 0.06)[:, None] * grown * flat + out)


def neck_girth(p: Points) -> Points:
    """About the neck's axis, which leans."""
    axis = -0.03 + 0.2 * (p[:, 1] + 0.1)
    low = 1 - _of_head(p)
    return 0.2 * low[:, None] * np.stack([p[:, 0], 0 * axis, p[:, 2] - axis], axis=1)


def _of_head(p: Points) -> NDArray[np.float64]:
    """(k,) 1 on the head, 0 low on the neck; between them along the jaw and under the skull."""
    return ease(p[:, 1] + 0.45 * p[:, 2], -0.11, -0.045)


def _of_nose(p: Points) -> NDArray[np.float64]:
    """(k,) 1 on the nose, 0 from the brows up, from the lips down and on the cheeks."""
    x, y, z = p.T
    high = ease(y, -0.034, -0.021) * ease(y, 0.05, 0.02)
    return high * ease(np.abs(x), 0.06, 0.025) * ease(z, 0.05, 0.085)


def fields(eyes: Eyes) -> dict[str, Field]:
    """Feature -> the field of one step beyond its human range, toward its high end.

    p -> (k, 3) metres, of the upright default face from the head's joint.
    """
    whole = {"head_width": head_width, "head_height": head_height}
    spared = {
        "head_shape": head_shape, "forehead_height": forehead_height,
        "nose_width": nose_width, "nose_length": nose_length,
        "nose_depth": nose_depth, "nose_tip_width": nose_tip_width, "mouth_width": mouth_width,
        "mouth_height": mouth_height, "upper_lip": lip(1), "lower_lip": lip(-1),
        "cheek_volume": both(cheek_volume), "chin_height": chin_height, "chin_width": chin_width,
        "chin_forward": chin_forward, "jaw_width": jaw_width, "brow_height": brow_height,
        "ear_size": both(ear_size), "neck_girth": neck_girth,
    }  # fmt: skip
    return {
        "eye_size": lambda p: 0.75 * eyes.size(p),
        "eye_spacing": eyes.spacing,
        "eye_height": eyes.height,
        **{name: eyes.spared(field, 0.5) for name, field in whole.items()},
        **{name: eyes.spared(field) for name, field in spared.items()},
    }


def growth_of(field: Field, p: Points) -> Points:
    """(k, 3) the diagonal of the field's derivative at p."""
    steps = STEP * np.eye(3)
    return np.stack(
        [(field(p + s) - field(p - s))[:, k] / (2 * STEP) for k, s in enumerate(steps)], axis=1
    )


def warps(
    plain: Points, size: int, opened: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(styles, M, 3) metres of a step of each of identity.STYLED, and their growth (styles, M, 3).

    plain : (M, 3) the default face, upright, from the head's joint; its joints come behind `size`
    vertices;  opened : (size, 3) metres that lids open by, which is no field
    """
    known = fields(Eyes(plain[size + JOINTS.index("l-eye")]))
    known[OPENING] = lambda p: np.pad(opened, ((0, len(p) - size), (0, 0)))
    moves = np.stack([known[f.name](plain) for f in STYLED])
    growth = np.stack([
        0 * plain if f.name == OPENING else growth_of(known[f.name], plain) for f in STYLED
    ])  # fmt: skip
    return np.round(moves / FINEST) * FINEST, np.round(growth / FINEST_GROWTH) * FINEST_GROWTH
