"""A head of hair as one mesh, ready to be painted, written to a file or made an object."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..common.errors import InputError
from ..looks import colours_of
from ..rig import FaceRig
from ..shape import Worn
from .cut import Cut
from .follow import Bound, bind
from .hem import hanging
from .locks import hair
from .shell import Shell, shell
from .strands import Strands, grow
from .style import AS_DRAWN, Style, styled

# A surface with locks on it, that surface alone, and strands over a thinner one.
KINDS, NAME = ("locks", "surface", "curves"), "hair"
DETAIL = 0.5  # of locks; see `locks.hair`
OUTER, INNER = 0.65, 0.35  # how light the two sheets of the shell are: what lies under locks
# Share of its thickness that the shell has under strands, and metres from the parting from which on
# it has that: there strands have hardly left the skin.
UNDER, UNDER_FROM = 0.5, 0.05
LOOSE = 0.20  # how much lighter or darker than the hair a lock may be
HAIRS = 300.0  # single hairs around the head, in pictures
APART = 11.0  # hairs from one lock to the next
ROUGHNESS = 0.45


@dataclass(frozen=True)
class HairMesh:
    """Hair on a person.

    points : (n, 3) float32, metres, on the upright person at rest
    quads : (q, 4) int32, turned outwards      uv : (n, 2) float32, 0..1, v along the strands
    shade : (n,) float32, of the hair's colour, 1 as it is
    grain : (n,) float32, which single hair lies there: neighbours differ
    colour : linear RGB      bound : how it follows the skull
    cut, style, kind : what it was made of, how it was combed, and as which of KINDS
    strands : over the mesh, for `curves`; they lie on the person, not on what was fitted to it:
        the skin takes them along
    """

    points: NDArray[np.float32]
    quads: NDArray[np.int32]
    uv: NDArray[np.float32]
    shade: NDArray[np.float32]
    grain: NDArray[np.float32]
    colour: tuple[float, float, float]
    bound: Bound
    cut: Cut
    kind: str
    style: Style = AS_DRAWN
    strands: Strands | None = None

    @property
    def triangles(self) -> NDArray[np.int32]:
        """(2 q, 3) the halves of the quads."""
        return np.concatenate([self.quads[:, [0, 1, 2]], self.quads[:, [0, 2, 3]]])

    def on(self, vertices: NDArray) -> NDArray[np.float32]:
        """(n, 3) metres, the points on a posed face (v, 3) of the rig."""
        return self.bound.points(vertices)

    def lying_on(self, vertices: NDArray) -> HairMesh:
        """The same hair, its points on an upright face at rest (v, 3) whose skin was fitted."""
        return replace(self, points=self.on(vertices))

    def worn_on(self, vertices: NDArray) -> Worn:
        """The same as a face wears it in a file."""
        points = self.on(vertices)
        return Worn(NAME, points, self.quads, self.uv, self.shade, self.colour, ROUGHNESS)


def hair_mesh(
    rig: FaceRig,
    identity: Mapping[str, float] | None,
    cut: Cut,
    kind: str = "locks",
    detail: float = DETAIL,
    style: Style = AS_DRAWN,
) -> HairMesh:
    """The hair of a person: the shell alone (`surface`), with locks on it, or under strands.

    The same cut makes the same hair. InputError for another kind and a detail out of range.
    """
    if kind not in KINDS:
        raise InputError(f"hair is made as {' or '.join(KINDS)}, not as '{kind}'")
    rng = np.random.default_rng(0)
    drawn, cut = cut, styled(cut, style)
    ribbons = threads = None
    if kind == "locks":
        under, ribbons = hair(rig, identity, cut, rng, detail)
    else:
        under = shell(rig, identity, cut)
    if kind == "curves":
        threads = grow(rig, identity, cut, under, rng, detail)
        under = _under_strands(under)
    shade = np.full(len(under.points), 1.0 if kind == "surface" else OUTER)
    inner = np.linspace(0, 1, under.inner.shape[1]) ** 4 * hanging(under, cut)[:, None]
    shade[under.inner] = INNER + (OUTER - INNER) * inner
    points, quads, uv, shades = [under.points], [under.quads], [under.uv], [shade]
    grain = [HAIRS * under.uv[:, 0]]
    if ribbons:
        points.append(ribbons.points)
        quads.append(ribbons.quads + len(under.points))
        uv.append(ribbons.uv)
        shades.append(1 + LOOSE * ribbons.tone)
        lock = np.cumsum(ribbons.uv[:, 1] < np.roll(ribbons.uv[:, 1], 1))
        grain.append(APART * lock + 9 * ribbons.uv[:, 0])
    every = np.concatenate(points).astype(np.float32)
    colour = colours_of({**(identity or {}), "brow_colour": cut.colour})["brows"].colour
    return HairMesh(
        every,
        np.concatenate(quads).astype(np.int32),
        np.concatenate(uv).astype(np.float32),
        np.concatenate(shades).astype(np.float32),
        np.concatenate(grain).astype(np.float32),
        colour[:3],
        bind(every, rig, identity),
        drawn,
        kind,
        style,
        threads,
    )


def _under_strands(shell: Shell) -> Shell:
    """A thinner shell, which keeps the skin from showing between strands."""
    points = shell.points.copy()
    inner, outer = points[shell.inner], points[shell.outer]
    steps = np.linalg.norm(np.diff(outer, axis=1, prepend=outer[:, :1]), axis=-1, keepdims=True)
    way = np.minimum(np.cumsum(steps, axis=1) / UNDER_FROM, 1)
    points[shell.outer] = inner + UNDER * way * (outer - inner)
    for ring in shell.tails:
        middle = points[ring].mean(axis=1, keepdims=True)
        points[ring] = middle + UNDER * (points[ring] - middle)
    return replace(shell, points=points)


def strands(points: NDArray, quads: NDArray, uv: NDArray) -> NDArray[np.float64]:
    """(n, 3) unit, the way that the strands run at points of hair: along which v grows fastest.

    The gradient of a function over a triangle, averaged at its corners.
    """
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    a, b, c = (np.asarray(points, float)[triangles[:, k]] for k in range(3))
    v = uv[triangles, 1].astype(float)
    one, two = b - a, c - a
    normal = np.cross(one, two)
    size = np.maximum((normal**2).sum(axis=1, keepdims=True), 1e-18)
    rise, run = (v[:, 1:2] - v[:, :1]), (v[:, 2:] - v[:, :1])
    slope = (rise * np.cross(two, normal) + run * np.cross(normal, one)) / size
    slope *= np.sqrt(size)  # by the triangle's area
    out = np.zeros((len(points), 3))
    for k in range(3):
        np.add.at(out, triangles[:, k], slope)
    return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12)
