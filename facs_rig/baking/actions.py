"""Other ways to do an action: people smile, frown and sneer each in their own way.

A variant of a control is a *direction*: what it adds to the control's mean at 1, and takes away at
-1. The first is from the mean's one sculpt to its other, as most actions were sculpted twice:
MakeHuman's expression units and the ARKit-named ones. (The units of the three ethnicities are one
sculpt: they differ by 3 % at most.) The others are smooth fields over the head by which skin
follows more here and less there and goes aside a little, the last of them unlike on both sides.

No variant makes an action stronger or weaker as a whole: what lies along the mean is taken out. All
have the same size, a share of the mean's. They leave lids to their keys, lips as far apart as the
mean has them, and teeth, tongue and joints where they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..actions import GROUP_OF, WAYS, variant_name
from ..controls import CONTROL_NAMES, CONTROLS, WHOLE, Mix, both_sides
from .lips import Mouth, sealed
from .makehuman import Source
from .variants import Variant

# The one and the other sculpt of an action, {side} as in facs_rig.controls.
SCULPTS: dict[str, tuple[Mix, Mix]] = {
    "frontalis": ((("arkit/browOuterUp{Side}", 1.0), ("arkit/browInnerUp", 0.6)),
                  (("units/eyebrows-{side}-up", 1.0), ("units/eyebrows-{side}-extern-up", 0.3))),
    "medialis_frontalis": ((("arkit/browInnerUp", 1.0),),
                           (("units/eyebrows-{side}-inner-up", 1.0),)),
    "outer_frontalis": ((("arkit/browOuterUp{Side}", 1.0),),
                        (("units/eyebrows-{side}-extern-up", 1.0),)),
    "brow_furrow": ((("arkit/browDown{Side}", 1.0),), (("units/eyebrows-{side}-down", 1.0),)),
    "squint": ((("arkit/eyeSquint{Side}", 1.0),),
               (("units/eye-{side}-slit", 1.0), ("arkit/cheekSquint{Side}", 0.4))),
    "outer_squint": ((("arkit/cheekSquint{Side}", 1.0), ("arkit/mouthSmile{Side}", 0.15)),
                     (("arkit/cheekSquint{Side}", 0.8), ("arkit/eyeSquint{Side}", 0.7))),
    "wince": ((("arkit/noseSneer{Side}", 1.0),),
              (("units/nose-{side}-elevation", 1.0), ("units/eyebrows-{side}-down", 0.3))),
    "sneer": ((("arkit/mouthUpperUp{Side}", 1.0),), (("units/mouth-upward-retraction", 1.0),)),
    "nasolabial_deepen": ((("arkit/cheekSquint{Side}", 1.0),),
                          (("arkit/mouthUpperUp{Side}", 1.0),)),
    "smile": ((("arkit/mouthSmile{Side}", 1.0),), (("units/mouth-corner-puller", 1.0),)),
    "pucker": ((("arkit/mouthPucker", 1.0), ("arkit/mouthDimple{Side}", 0.5)),
               (("units/mouth-pursing", 1.0),)),
    "frown": ((("arkit/mouthFrown{Side}", 1.0),), (("units/mouth-depression", 1.0),)),
    "lower_lip_depress": ((("arkit/mouthLowerDown{Side}", 1.0),),
                          (("units/mouth-depression-retraction", 1.0),)),
    "shrug": ((("arkit/mouthShrugLower", 1.0),),
              (("units/mouth-eversion", 0.6), ("units/mouth-elevation", 0.4))),
    "purse": ((("arkit/mouthPucker", 1.0),), (("units/mouth-pursing", 1.0),)),
    "grimace": ((("arkit/mouthStretch{Side}", 1.0),),
                (("units/mouth-retraction", 1.0), ("units/neck-platysma", 0.6))),
    "lip_loosen": ((("arkit/mouthFunnel", 1.0),), (("units/mouth-protusion", 1.0),)),
    "lip_lock": ((("arkit/mouthPress{Side}", 1.0),), (("units/mouth-compression", 1.0),)),
    "jaw_open": ((("arkit/jawOpen", 1.0),), (("units/mouth-open", 1.0),)),
}  # fmt: skip

# Size of a variant at 1, as a share of its action's, and how far it reaches at most in such shares.
# The teeth go with the jaw and have no variants, and rolled-in lips have no room: theirs are small.
SHARE, MOST = 0.45, 1.2
SMALLER = {"jaw_": 0.12, "lip_tighten": 0.3, "lip_lock": 0.3}
LEAST = 2e-5  # metres: what moves less is left out
LEAST_ACTION = 1e-3  # metres, root of the sum of squares: lids alone have no variants
WAVELENGTHS = (0.07, 0.14)  # metres: a field is alike over a third of a face and more
WAVES = 5
TURN = 0.8  # radians of the skin's way aside, per share by which it follows more
# What is sharp in one sculpt and not in the other folds the skin: edges of the cage grow longer or
# shorter by this share at most, those below a length as if they had it.
STRAIN, SHORTEST = 0.4, 0.001  # share; metres
RELAXING = 20  # steps
# Both lips go along with one field, that of the displacements around: metres to its width, and
# from the line of the lips to where it is all that counts, to where it counts no more.
AROUND, LIPS, BEYOND = 0.008, 0.010, 0.028
TOUCH = 0.0003  # metres by which a variant may bring the lips together or part them


@dataclass(frozen=True)
class Skin:
    """What of the cage variants move, and which of it lies together.

    free : (m, 1) 1 where skin may be moved, 0 at the lids' edges and on all else
    edges : (e, 2) vertices;  beside : (m, m) the mean of a vertex's neighbours;  at : (m, e) ones
    lips : (m, 1) how far a vertex goes along with the lips;  around : (m, m) the mean around it
    """

    free: NDArray
    edges: NDArray
    beside: sp.csr_matrix
    at: sp.csr_matrix
    lips: NDArray
    around: sp.csr_matrix

    def as_lips(self, moves: NDArray) -> NDArray[np.float64]:
        """Displacements (m, 3) that are the same for both lips where these meet."""
        return moves + self.free * self.lips * (self.around @ moves - moves)

    def relaxed(self, moves: NDArray, posed: NDArray) -> NDArray[np.float64]:
        """Displacements (m, 3) smoothed along the mesh where they stretch the edges of the cage
        (m, 3) that they are added to by more than STRAIN."""
        length = np.maximum(np.linalg.norm(np.subtract(*posed[self.edges.T]), axis=1), SHORTEST)
        for _ in range(RELAXING):
            strain = np.linalg.norm(np.subtract(*moves[self.edges.T]), axis=1) / length
            if strain.max() <= STRAIN:
                break
            over = np.clip(self.at @ np.maximum(strain / STRAIN - 1, 0), 0, 1)[:, None]
            moves = moves + self.free * over * (self.beside @ moves - moves) / 2
        return moves


def skin_of(source: Source, cage: NDArray, rims: NDArray, mouth: Mouth) -> Skin:
    """The skin of the cage (m, 3);  rims : (m,) share of the lids' edges in a vertex."""
    m = len(cage)
    free = (source.is_part("skin") * (1 - rims))[:, None]
    ends = np.stack([source.quads, np.roll(source.quads, -1, axis=1)], axis=2).reshape(-1, 2)
    edges = np.unique(np.sort(ends, axis=1), axis=0)
    at = sp.csr_matrix((np.ones(edges.size), (edges.T.ravel(), np.tile(np.arange(len(edges)), 2))))
    ends = np.concatenate([edges, edges[:, ::-1]])
    beside = means(sp.csr_matrix((np.ones(len(ends)), ends.T), shape=(m, m)))

    seam = (mouth.matrix[mouth.markers.ravel()] @ cage).reshape(-1, 2, 3).mean(axis=1)
    x = np.linspace(seam[0, 0], seam[-1, 0], 61)
    line = np.stack([np.interp(x, seam[:, 0], seam[:, c]) for c in range(3)], axis=1)
    away, _ = cKDTree(line).query(cage)
    t = np.clip((away - LIPS) / (BEYOND - LIPS), 0, 1)
    skin = np.flatnonzero(source.is_part("skin"))
    near = cKDTree(cage[skin])
    pairs = near.sparse_distance_matrix(near, 3 * AROUND, output_type="coo_matrix")
    weight = np.exp(-((pairs.data / AROUND) ** 2) / 2)
    around = sp.csr_matrix((weight, (skin[pairs.row], skin[pairs.col])), shape=(m, m))
    around += sp.diags(np.where(source.is_part("skin"), 0.0, 1.0))
    return Skin(free, edges, beside, at, (1 - t * t * (3 - 2 * t))[:, None], means(around))


def means(weights: sp.csr_matrix) -> sp.csr_matrix:
    """The matrix with rows that add up to one."""
    total = np.asarray(weights.sum(axis=1)).ravel()
    return sp.csr_matrix(sp.diags(1 / np.where(total > 0, total, 1)) @ weights)


def action_variants(
    source: Source, plain: NDArray, controls: NDArray, rims: NDArray, mouth: Mouth
) -> list[Variant]:
    """The variants of all actions and of their sides.

    plain : (M, 3) the default face;  controls : (47, m, 3) metres at intensity 5, without lids;
    rims : (m,) share of the lids' edges in a vertex, which variants leave alone
    """
    m = source.size
    skin = skin_of(source, plain[:m], rims, mouth)
    fields = {way: Field.of(plain[:m], way, WAYS[way] == "lopsided") for way in WAYS}
    out = []
    for k, name in enumerate(CONTROL_NAMES):
        mean = controls[k, :m] * skin.free
        if WHOLE[k] != k or name not in GROUP_OF or np.linalg.norm(mean) < LEAST_ACTION:
            continue
        share = next((x for stem, x in SMALLER.items() if name.startswith(stem)), SHARE)
        posed = plain[:m] + controls[k, :m]
        for way in WAYS:
            move = skin.free * direction(source, mouth, name, way, mean, fields[way])
            move = fitted(without(skin.as_lips(move), mean), mean, share)
            move = as_parted(posed, skin.relaxed(move, posed), mouth)
            for j in (j for j in range(len(CONTROLS)) if WHOLE[j] == k):  # itself and its sides
                half = move * mouth.masks.get(CONTROLS[j].side, 1.0) if j != k else move
                kept = half * (np.abs(half).max(axis=1, keepdims=True) > LEAST)
                own, still = CONTROL_NAMES[j], ((0, len(plain) - m), (0, 0))
                out.append(Variant(variant_name(own, way), own, np.pad(kept, still)))
    return out


@dataclass(frozen=True)
class Field:
    """How skin differs in following: `follow` (m,) how much more, `turn` (m, 3) radians aside."""

    follow: NDArray
    turn: NDArray

    @classmethod
    def of(cls, cage: NDArray, seed: int, lopsided: bool) -> Field:
        """A random smooth one over the cage (m, 3): symmetric, or the opposite on both sides."""
        rng = np.random.default_rng([47, seed])
        follow, *turn = (waves(cage, rng, odd != lopsided) for odd in (False, False, True, True))
        return cls(follow, TURN * np.stack(turn, axis=1))

    def moved(self, mean: NDArray) -> NDArray[np.float64]:
        """(m, 3) what it adds to an action."""
        return self.follow[:, None] * mean + np.cross(self.turn, mean)


def direction(
    source: Source, mouth: Mouth, name: str, way: int, mean: NDArray, field: Field
) -> NDArray[np.float64]:
    """(m, 3) where a variant of an action's mean (m, 3) leads, of any size."""
    if WAYS[way] == "shape" and name in SCULPTS:
        one, other = (sculpt(source, mouth.masks, mix, mean) for mix in SCULPTS[name])
        return one - other
    return field.moved(mean)


def sculpt(
    source: Source, masks: Mapping[str, NDArray], mix: Mix, mean: NDArray
) -> NDArray[np.float64]:
    """(m, 3) a mix of blendshapes, as strong as the mean."""
    moves = source.mixed(both_sides(mix), masks)[: source.size]
    return moves * (mean * mean).sum() / (moves * mean).sum()


def without(moves: NDArray, mean: NDArray) -> NDArray[np.float64]:
    """Displacements without what of them is more or less of the mean."""
    return moves - mean * (moves * mean).sum() / (mean * mean).sum()


def fitted(moves: NDArray, mean: NDArray, share: float) -> NDArray[np.float64]:
    """Displacements whose size is this share of the mean's, and nowhere too large a one."""
    size, most = (norm(moves) / norm(mean) for norm in (np.linalg.norm, farthest))
    return moves * min(share / size, MOST * share / most)


def farthest(moves: NDArray) -> float:
    """How far the displacements (m, 3) reach."""
    return float(np.linalg.norm(moves, axis=1).max())


def waves(cage: NDArray, rng: np.random.Generator, odd: bool) -> NDArray[np.float64]:
    """(m,) a random smooth function of the place, even or odd in x."""
    out = np.zeros(len(cage))
    for _ in range(WAVES):
        way = rng.standard_normal(3)
        number = 2 * np.pi / rng.uniform(*WAVELENGTHS) * way / np.linalg.norm(way)
        phase = rng.uniform(0, 2 * np.pi)
        across = (np.sin if odd else np.cos)(number[0] * cage[:, 0])
        out += across * np.cos(cage[:, 1:] @ number[1:] + phase)
    return out / np.sqrt(WAVES)


def as_parted(posed: NDArray, moves: NDArray, mouth: Mouth) -> NDArray[np.float64]:
    """A variant that leaves the lips of a posed cage (m, 3) as far apart, to about TOUCH, in both
    directions."""
    apart = mouth.gaps(posed)

    def excess(gaps: NDArray) -> NDArray:
        return gaps - apart - np.clip(gaps - apart, -TOUCH, TOUCH)

    if not any(excess(mouth.gaps(posed + sign * moves)).any() for sign in (1, -1)):
        return moves
    ends = [sign * sealed(posed, sign * moves, mouth, excess) for sign in (1, -1)]
    return (ends[0] + ends[1]) / 2
