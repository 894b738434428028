"""The inside of the mouth: what carries teeth, gums and tongue, and how the jaw turns.

The source's teeth and tongue are bands and a slab, and its targets bend them. Here their vertices
are only carriers: four of them are a *frame*, an origin's place and its three axes, and every
point of a tooth is a fixed affine combination of its frame's four, so that teeth keep their shape
whatever moves them. There is a frame for the upper jaw, one for the lower, and some along the
tongue, between which its points are blended. A frame moves with the person's mouth: its edges
with the seam of the lips, its size with the walls of the cavity. With the jaw it turns about the
jaw's hinge.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..anatomy import PART_NAMES, lines_mouth
from ..keys import Key
from .makehuman import JOINTS, Source
from .people import People
from .strands import MM, Hairs
from .teeth import LOWER, UPPER, Cage, joined, row, tongue

# Free of skin on the texture: (left, bottom), (width, height).
TEXTURE = {"teeth": ((0.02, 0.30), (0.60, 0.04)), "gums": ((0.02, 0.36), (0.60, 0.06)),
           "tongue": ((0.45, 0.45), (0.16, 0.10))}  # fmt: skip
JAW_JOINT = JOINTS.index("mouth")
ARM = 30.0  # millimetres from a frame's origin to its carriers
STATIONS = (0.0, 0.3, 0.55, 0.75, 0.9, 1.0)  # of the tongue's frames, from its root to its tip
# Where each station of the tongue goes when it is put out at 1: metres up and forward, radians
# that it turns down, and how thick it is then.
OUT = (
    (0.0, 0.000, 0.0, 1.0),
    (0.001, 0.006, 0.0, 1.0),
    (0.004, 0.015, -0.05, 0.9),
    (0.0075, 0.024, 0.05, 0.75),
    (0.006, 0.031, 0.45, 0.75),
    (0.0015, 0.034, 0.75, 0.8),
)
# How far each of these lies down on the floor of the mouth when the jaw opens fully: metres.
DROP = (0.006, 0.010, 0.010, 0.006, 0.002, 0.0)
# Where the lips meet, inside and in front: metres from the head's joint.
SEAM, LIPS = np.array((0.0, -0.0282, 0.0975)), np.array((0.0, -0.0273, 0.1054))
WHOLLY = (0.8, 0.97)  # how far skin follows the jaw from where on it turns with it as bone does
SHORTER = 0.85  # how far teeth go sideways, of how far the source has them go
NEAR_SEAM = 0.0045  # metres from there
FOLLOWS = 0.003  # metres; skin that the jaw moves by less than this follows it only in part


@dataclass(frozen=True)
class Frames:
    """carriers : (frames, 4) cage vertices; origin : (frames, 3) metres from the head's joint.

    The first frame is the upper jaw's, the second the lower's, the others are the tongue's. Their
    carriers stand to the left and right of the origin, above it and before it.
    """

    carriers: NDArray[np.int64]
    origin: NDArray[np.float64]

    @property
    def places(self) -> NDArray[np.float64]:
        """(frames, 4, 3) the carriers on the default face."""
        arms = ARM * MM * np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, 0, 1)])
        return np.asarray(self.origin[:, None] + arms)

    @property
    def of_jaw(self) -> NDArray[np.int64]:
        """Carriers that go with the lower jaw."""
        return self.carriers[1:].ravel()

    def rows(self, points: NDArray, frame: int, m: int) -> sp.csr_matrix:
        """Rows (k, m) over the cage for points (k, 3) in metres that a frame carries."""
        system = np.vstack([self.places[frame].T, np.ones(4)])
        weights = np.linalg.solve(system, np.vstack([points.T, np.ones(len(points))])).T
        index = np.tile(self.carriers[frame], (len(points), 1))
        start = np.arange(0, 4 * len(points) + 1, 4)
        return sp.csr_matrix((weights.ravel(), index.ravel(), start), shape=(len(points), m))


def make_frames(source: Source) -> Frames:
    """Frames on the source's teeth and tongue, whose vertices have nothing else to do."""
    free = np.flatnonzero(source.is_part("teeth") | source.is_part("tongue"))
    _, along = tongue()
    middle = tongue()[0].points.reshape(-1, 3)
    rings = np.unique(np.round(along, 9))
    centres = np.array([middle[np.abs(along - ring) < 1e-6].mean(axis=0) for ring in rings])
    stations = np.stack([np.interp(STATIONS, rings, axis) for axis in centres.T], axis=1)
    stations[:, 0] = 0.0
    origin = np.vstack([[(0.0, -24.0, 75.0), (0.0, -34.0, 72.0)], stations]) * MM
    return Frames(free[: 4 * len(origin)].reshape(-1, 4), origin)


def clear_out(source: Source, people: People, frames: Frames) -> None:
    """Put the carriers where their frames have them, for every identity alike, in place.

    Other vertices of the source's teeth and tongue are in no use. They stand in a row on the
    middle, so that the cage stays its own mirror image.
    """
    head = source.size + JOINTS.index("head")
    free = np.flatnonzero(source.is_part("teeth") | source.is_part("tongue"))
    place = np.zeros((len(free), 3))
    place[:, 2] = -0.2 * MM * np.arange(len(free))
    place[: frames.carriers.size] = frames.places.reshape(-1, 3)
    people.deltas[:, free] = people.deltas[:, [head]]
    people.base[free] = people.base[head] + place


@dataclass(frozen=True)
class Part:
    """fine : rows over the cage, and polygons;  uv : (c, 2) where their corners lie on a texture;
    coarse : (f, 4) quads of the step before between the first of its vertices, whose corners lie at
    `coarse_uv` (f, 4, 2)"""

    fine: Hairs
    uv: NDArray[np.float64]
    coarse: NDArray[np.int64]
    coarse_uv: NDArray[np.float64]


def mouth_parts(frames: Frames, m: int) -> list[Part]:
    """Teeth, gums and tongue over a cage of m vertices."""
    out = []
    rows = zip(row(UPPER), row(LOWER), strict=True)
    for name, cages in zip(("teeth", "gums"), rows, strict=True):
        carried = [frames.rows(cage.points * MM, jaw, m) for jaw, cage in enumerate(cages)]
        out.append(_part(name, joined(list(cages)), sp.vstack(carried).tocsr()))
    cage, along = tongue()
    blend = _blending(along)
    stations = [sp.diags(blend[:, k]) @ frames.rows(cage.points * MM, 2 + k, m)
                for k in range(len(STATIONS))]  # fmt: skip
    out.append(_part("tongue", cage, sp.csr_matrix(sum(stations))))
    return out


def _blending(along: NDArray) -> NDArray[np.float64]:
    """(k, stations) how far points so far along the tongue follow each station; smooth."""
    stops = np.array(STATIONS)
    at = np.clip(np.searchsorted(stops, along, side="right") - 1, 0, len(stops) - 2)
    t = (along - stops[at]) / (stops[at + 1] - stops[at])
    out = np.zeros((len(along), len(stops)))
    out[np.arange(len(along)), at] = 1 - t
    out[np.arange(len(along)), at + 1] = t
    return out


def _part(name: str, cage: Cage, rows: sp.csr_matrix) -> Part:
    matrix, quads, chart = cage.fine()
    corner, size = TEXTURE[name]
    scale = np.array(size) / chart.max(axis=(0, 1))
    starts = np.arange(0, quads.size, 4)
    part = PART_NAMES.index(name)
    fine = Hairs((matrix @ rows).tocsr(), quads.ravel(), starts, part)
    uv = corner + scale * chart
    return Part(fine, uv.reshape(-1, 2), cage.quads, corner + scale * cage.chart)


# --- whose mouth it is ---


def follow_people(source: Source, people: People, frames: Frames) -> None:
    """Move the frames with every identity's mouth, in place; the default face stays."""
    at, plain = frames.carriers.ravel(), people.plain
    people.deltas[:, at] = _followed(people.deltas, source, plain, frames)
    people.base[at] += plain[at] - people.plain[at]


def follow_mouth(
    moves: NDArray, growth: NDArray, source: Source, plain: NDArray, frames: Frames
) -> None:
    """Move the frames with a mouth that is stylised, in place; plain : (M, 3) the default face.

    moves : (k, M, 3) metres;  growth : (k, M, 3) what movements by keys are stretched by there:
    for a frame, which stays stiff, that of the lips' seam
    """
    at = frames.carriers.ravel()
    moves[:, at] = _followed(moves, source, plain, frames)
    growth[:, at] = growth[:, _seam(source, plain)].mean(axis=1, keepdims=True)


def _seam(source: Source, plain: NDArray) -> NDArray[np.int64]:
    """Skin about where the lips meet inside, in the middle."""
    cage = plain[: source.size] - plain[source.size + JOINTS.index("head")]
    away = np.linalg.norm((cage - SEAM) * [1.0, 1.0, 0.5], axis=1)
    return np.flatnonzero((away < NEAR_SEAM) & source.is_part("skin"))


def _followed(
    moves: NDArray, source: Source, plain: NDArray, frames: Frames
) -> NDArray[np.float64]:
    """(k, carriers, 3) how the frames follow displacements (k, M, 3) of the default face (M, 3).

    Sizes follow the walls of the cavity, by least squares along each axis; the place follows the
    seam of the lips in the middle, so that no tooth comes out of a closed mouth.
    """
    m, head = source.size, source.size + JOINTS.index("head")
    cage = plain[:m] - plain[head]
    skin = np.flatnonzero(source.is_part("skin"))
    wall = skin[lines_mouth((cage[skin] - LIPS) / MM)]
    own = moves[:, :m] - moves[:, [head]]
    shift = own[:, _seam(source, plain)].mean(axis=1)
    shift[:, 0] = 0.0
    arm = cage[wall] - cage[wall].mean(axis=0)
    stretch = np.einsum("kvd,vd->kd", own[:, wall], arm) / np.sum(arm**2, axis=0)
    stretch[:, 1] = stretch[:, 0]  # the wall's height says little: the floor is far below the teeth
    arms = frames.places.reshape(-1, 3) - SEAM
    return np.asarray(shift[:, None] + stretch[:, None] * arms + moves[:, [head]])


# --- the jaw ---


@dataclass(frozen=True)
class Jaw:
    """How the jaw opens, at 1 of ARKit's jawOpen: an angle (radians) about the axis through the
    `hinge` (3,), metres from the head's joint, and a glide (3,) forward.

    follow : (m,) how far each vertex of the cage goes with it
    """

    hinge: NDArray
    angle: float
    glide: NDArray
    follow: NDArray

    def moved(self, points: NDArray, share: float) -> NDArray[np.float64]:
        """Displacements of points (k, 3) that follow fully, at a share of the opening."""
        turn = share * self.angle
        c, s = np.cos(turn), np.sin(turn)
        matrix = np.array([(1, 0, 0), (0, c, -s), (0, s, c)])
        return np.asarray((points - self.hinge) @ (matrix - np.eye(3)).T + share * self.glide)


def measure_jaw(source: Source, plain: NDArray) -> Jaw:
    """The jaw of the plain face (M, 3), which still has the source's teeth.

    ARKit's jawOpen moves the source's lower teeth on the chord of an arc: its angle is taken from
    there, and what is left of the movement when they turn about the hinge is the glide.
    """
    m, head = source.size, source.size + JOINTS.index("head")
    cage = plain[:m] - plain[head]
    moves = source.target("arkit/jawOpen")[:m]
    lower = lower_teeth(source)
    start = (cage[lower] - cage[lower].mean(axis=0))[:, 1:]
    end = start + (moves[lower] - moves[lower].mean(axis=0))[:, 1:]
    cross = start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0]
    angle = float(np.arctan2(cross.sum(), np.sum(start * end)))
    hinge = plain[m + JAW_JOINT] - plain[head]
    jaw = Jaw(hinge, angle, np.zeros(3), np.zeros(m))
    glide = (moves[lower] - jaw.moved(cage[lower], 1.0)).mean(axis=0)
    jaw = replace(jaw, glide=glide * (0, 1, 1))
    whole = jaw.moved(cage, 1.0)
    size = np.sum(whole**2, axis=1)
    follow = np.einsum("vd,vd->v", moves, whole) / (size + FOLLOWS**2)
    follow = np.clip(follow * (1 + FOLLOWS**2 / size.max()), 0, 1) * source.is_part("skin")
    return replace(jaw, follow=follow)


def turn_skin(moves: NDArray, opening: NDArray, cage: NDArray, jaw: Jaw) -> None:
    """Let chin and lower lip, which follow the jaw fully, turn with it as bone does, in place.

    moves : (k, m, 3) displacements of the cage (m, 3), metres from the head's joint;
    opening : (k,) how far each opens the jaw. What follows in part stays as the source has it.
    """
    t = np.clip((jaw.follow - WHOLLY[0]) / (WHOLLY[1] - WHOLLY[0]), 0, 1)
    share = (t * t * (3 - 2 * t))[:, None]
    for k in np.flatnonzero(opening):
        moves[k] += share * (jaw.moved(cage, opening[k]) - moves[k])


def lower_teeth(source: Source) -> NDArray[np.int64]:
    """The source's lower teeth: those that go with the jaw."""
    moves = np.linalg.norm(source.target("arkit/jawOpen")[: source.size], axis=1)
    return np.flatnonzero(source.is_part("teeth") & (moves > MM))


def stiffen(moves: NDArray, opening: NDArray, source: Source, frames: Frames, jaw: Jaw) -> None:
    """Let nothing but the jaw move the mouth's parts, as a whole, in place.

    moves : (k, M, 3) displacements of the cage;  opening : (k,) how far each of them opens the
    jaw, in ARKit's jawOpen; what else the source does to its lower teeth is a shift.
    """
    free = np.flatnonzero(source.is_part("teeth") | source.is_part("tongue"))
    shift = moves[:, lower_teeth(source)].mean(axis=1)
    shift[opening != 0] = 0.0
    shift[:, 0] *= SHORTER  # skin beside the corners does not follow as far
    moves[:, free] = 0.0
    places = frames.places[1:].reshape(-1, 3)
    drop = np.zeros_like(places)
    drop[4:, 1] = -np.repeat(DROP, 4)
    for k, share in enumerate(opening):
        turned = jaw.moved(places, share) + share * drop if share else 0.0
        moves[k, frames.of_jaw] = shift[k] + turned


def jaw_keys(frames: Frames, jaw: Jaw, cage: NDArray, opening: float) -> tuple[list[Key], NDArray]:
    """The key that takes an opening jaw from the chord to the arc, and its displacements
    (1, m, 3) of the cage (m, 3), metres from the head's joint.

    opening : of jaw_open at intensity 5, in ARKit's jawOpen. As for the lids (`lid_deltas`), the
    key adds the parabola that the arc is to second order.
    """
    bend = jaw.moved(cage, opening / 2) - jaw.moved(cage, opening) / 2
    out = jaw.follow[:, None] * bend
    places = frames.places[1:].reshape(-1, 3)
    out[frames.of_jaw] = jaw.moved(places, opening / 2) - jaw.moved(places, opening) / 2
    return [Key("jaw_open_arc", "0.8*jaw_open*(1-0.2*jaw_open)")], out[None]


def put_out(frames: Frames) -> NDArray[np.float64]:
    """(carriers, 3) metres that ARKit's tongueOut moves `frames.carriers[2:]`."""
    out = []
    for (up, ahead, turn, thick), places in zip(OUT, frames.places[2:], strict=True):
        arms = places - places[[0, 1]].mean(axis=0)
        shape = np.diag([1 - 0.3 * (1 - thick), thick, 1.0])
        c, s = np.cos(turn), np.sin(turn)
        turned = arms @ shape.T @ np.array([(1, 0, 0), (0, c, -s), (0, s, c)]).T
        out.append(turned - arms + (0.0, up, ahead))
    return np.concatenate(out)
