"""What controls and identities do to the eyes: round balls, lids on their arcs, gaze.

The targets are measured, and what they do to the lids' rims is done by the lids' own keys instead
(see facs_rig.baking.lids).
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..anatomy import PART_NAMES
from ..common.ties import first_most
from ..controls import ARKIT_NAMES, CONTROLS
from ..identity import target_weights
from ..rotation import rotation
from .lids import (
    BLINK_LOWER,
    BLINK_UPPER,
    LEAST,
    LOWER_FOLLOWS,
    THINNER,
    UPPER_FOLLOWS,
    LidField,
    hold_rim,
    lid_deltas,
    lid_field,
    lid_shares,
    measure_opening,
)
from .makehuman import JOINTS, Source
from .people import WHOLE_FACES, People

SIGNS = {"left": 1, "right": -1}  # of x on the face's own left and right
EYE_JOINTS = {"left": JOINTS.index("l-eye"), "right": JOINTS.index("r-eye")}
ARKIT_LOOK = 28.0  # degrees that the eyes turn at 1 of ARKit's eyeLook units
BALL_RADIUS = 0.0143  # metres, in the plain face
OPENED = -0.45, -0.2  # shares of the opening by which stylised upper and lower lids are wider
WIDE_OPEN = 0.15  # quantile along the lid: a blink must close the widest place of an identity's eye


def eye_balls(source: Source, base: NDArray) -> dict[str, NDArray]:
    """The cage's vertices of each eyeball."""
    eye = source.is_part("eyes")
    x = base[: source.size, 0]
    return {side: np.flatnonzero(eye & (sign * x > 0)) for side, sign in SIGNS.items()}


def round_rows(
    source: Source, plain: NDArray, matrix: sp.csr_matrix, part: NDArray
) -> sp.csr_matrix:
    """The refinement (n, m) with rows that put every vertex of the eyeballs on a sphere.

    Catmull-Clark shrinks a coarse sphere unevenly. Balls only move and grow, so any of their
    points is a fixed affine combination of four of their vertices, far apart.
    """
    m = source.size
    rows = sp.lil_matrix(matrix)
    fine = matrix @ plain[:m]
    for side, ball in eye_balls(source, plain).items():
        centre = plain[m + EYE_JOINTS[side]]
        corners = np.array([(1, 1, 1), (-1, -1, 1), (-1, 1, -1), (1, -1, -1)])
        arms = (plain[ball] - centre) * (SIGNS[side], 1, 1)
        spread = ball[first_most(corners @ arms.T, axis=1)]
        at = np.flatnonzero((part == PART_NAMES.index("eyes")) & (SIGNS[side] * fine[:, 0] > 0))
        away = fine[at] - centre
        away *= BALL_RADIUS / np.linalg.norm(away, axis=1, keepdims=True)
        system = np.vstack([(plain[spread] - centre).T, np.ones(4)])
        weights = np.linalg.solve(system, np.vstack([away.T, np.ones(len(at))]))
        for row, values in zip(at, weights.T, strict=True):
            order = np.argsort(spread)
            rows.rows[row], rows.data[row] = spread[order].tolist(), values[order].tolist()
    return rows.tocsr().astype(np.float32)


def lid_fields(
    source: Source, plain: NDArray, matrix: sp.csr_matrix, triangles: NDArray, part: NDArray
) -> dict[str, LidField]:
    """The lids of both eyes, measured on the plain face (M, 3); part : (n,) of fine vertices."""
    is_eye = part[triangles[:, 0]] == PART_NAMES.index("eyes")
    cage, lashes = plain[: source.size], source.is_part("lashes")
    fields = {}
    for side in SIGNS:
        opening = measure_opening(matrix @ cage, triangles, is_eye, side == "left")
        middle = opening.radius * (np.sin(opening.top) + np.sin(opening.bottom)).mean() / 2
        up = cage[:, 1] > opening.centre[1] + middle
        fields[side] = lid_field(cage, source.is_part("skin"), lashes & up, lashes & ~up, opening)
    return fields


def fit_lids(
    people: People,
    m: int,
    matrix: sp.csr_matrix,
    fields: dict[str, LidField],
    balls: dict[str, NDArray],
) -> NDArray[np.float64]:
    """Lay the lids of every identity target on its eyeball, in place; how far each closes them.

    matrix : (s, m) refinement of the skin alone. Returns (targets,) shares of the opening, both
    lids together, zero for the plain face.
    """
    deltas, plain, thickness = people.deltas, people.plain, THINNER
    closed = np.zeros(len(deltas))
    for k in range(len(deltas)):
        if k == WHOLE_FACES:  # what follows only changes that face, whose lids are thin by now
            plain, thickness = people.plain, 1.0
        rest = people.base if k < WHOLE_FACES else plain
        if np.abs(deltas[k, :m] * fields["left"].rim[:, None]).max() < 1e-6:
            continue
        for side, field in fields.items():
            joint, ball = m + EYE_JOINTS[side], balls[side]
            who = rest + deltas[k]
            now, before = (np.linalg.norm(p[ball] - p[joint], axis=1) for p in (who, plain))
            grown, centre = now.mean() / before.mean(), who[joint]
            radius = grown * field.opening.radius
            held = hold_rim(who[:m], centre, radius, field, plain[:m], thickness)
            deltas[k, :m] = held - rest[:m]
            own = matrix @ ((held - centre) / grown + field.opening.centre)
            shares = lid_shares(matrix @ plain[:m], own, field.opening, WIDE_OPEN)
            closed[k] += sum(shares) / 2
    default = target_weights({})[:WHOLE_FACES]
    closed[:WHOLE_FACES] -= default @ closed[:WHOLE_FACES]
    return closed


def lids_of_controls(
    side: str, controls: NDArray, matrix: sp.csr_matrix, plain: NDArray, field: LidField
) -> tuple[dict[str, float], dict[str, float]]:
    """How far each control closes the upper and raises the lower lid of one eye, by its name.

    controls : (47, M, 3);  matrix : (s, m) refinement of the skin alone
    """
    upper: dict[str, float] = {}
    lower: dict[str, float] = {}
    m = matrix.shape[1]
    rest = matrix @ plain[:m]
    for control, delta in zip(CONTROLS, controls, strict=True):
        if control.side not in ("both", side):
            continue
        if control.name.startswith("blink"):
            up, low = BLINK_UPPER, BLINK_LOWER
        else:
            up, low = lid_shares(rest, rest + matrix @ delta[:m], field.opening)
        if abs(up) > LEAST:
            upper[control.name] = up
        if abs(low) > LEAST:
            lower[control.name] = low
    for shares in (upper, lower):  # a symmetric control moves this lid as its own side does
        for name in [c.name.removesuffix(f"_{side}") for c in CONTROLS if c.side == side]:
            shares.pop(name, None)
            if f"{name}_{side}" in shares:
                shares[name] = shares[f"{name}_{side}"]
    return upper, lower


def lids_opened(cage: NDArray, fields: dict[str, LidField]) -> tuple[NDArray, float]:
    """(m, 3) metres that the lids of stylised people stand farther apart, on the ball all the
    same, and how far that closes them: less than not at all. cage : (m, 3) the plain face"""
    moves = sum(field.turned(cage, *OPENED) - cage for field in fields.values())
    return moves, sum(OPENED)


def lids_of_arkit(
    source: Source,
    plain: NDArray,
    matrix: sp.csr_matrix,
    fields: dict[str, LidField],
    balls: dict[str, NDArray],
) -> NDArray[np.float64]:
    """(52, M, 3) metres that ARKit's units move the cage, lids on their arcs and eyes round."""
    m = source.size
    units = np.stack([source.target(f"arkit/{name}") for name in ARKIT_NAMES])
    units[:, m:] = 0
    rest = matrix @ plain[:m]
    for side, field in fields.items():
        end = side.capitalize()
        shares = {
            name: lid_shares(rest, rest + matrix @ unit[:m], field.opening)
            for name, unit in zip(ARKIT_NAMES, units, strict=True)
            if name.endswith(end)
        }
        shares[f"eyeBlink{end}"] = 1 - BLINK_LOWER, BLINK_LOWER
        units[:, :m] *= 1 - field.rim[:, None]
        turns = {"Down": (0, 1), "Up": (0, -1), "Out": (SIGNS[side], 0), "In": (-SIGNS[side], 0)}
        for way, turn in turns.items():
            yaw, pitch = np.radians(ARKIT_LOOK) * np.array(turn)
            arm = plain[balls[side]] - plain[m + EYE_JOINTS[side]]
            look = ARKIT_NAMES.index(f"eyeLook{way}{end}")
            units[look, balls[side]] = arm @ rotation((yaw, pitch, 0.0)).T - arm
            degrees = ARKIT_LOOK * turn[1]
            shares[f"eyeLook{way}{end}"] = UPPER_FOLLOWS * degrees, LOWER_FOLLOWS * degrees
        deltas = lid_deltas(plain[:m], field)
        for name, (up, low) in shares.items():
            arcs = 2 * low * (1 - low), 2 * up * (1 - up)
            move = np.tensordot([low, up, *arcs], deltas, axes=1)
            units[ARKIT_NAMES.index(name), :m] += move
    return units
