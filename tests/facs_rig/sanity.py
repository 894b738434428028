"""How sane a posed face is: skin that is folded over, collapsed, or runs through other skin.

What counts is what a viewer can see: the insides of mouth, nostrils and sockets are left out.
A posed face is measured against the same person without expression, so that only what posing does
wrong is counted. Crossings are found by Blender's own search trees, which share no code with the
rig; they need `bpy`.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.csgraph import dijkstra

from facs_rig import CONTROL_NAMES, LANDMARKS, Camera, FaceParameters, rasterise
from facs_rig.anatomy import lip_curves
from facs_rig.mesh import corner_matrix, triangle_normals
from facs_rig.raster import visible
from facs_rig.rotation import rotation

MM = 1e-3
PIXELS = 700  # the picture's side, for what can be seen
YAWS = (0.0, 0.7, -0.7)  # of the views, in radians: from the front and from three quarters
FOLDED = np.cos(np.radians(120))  # a triangle is turned against its surroundings beyond this
TURNED = np.cos(np.radians(30))  # ... if it has turned at least so much from where it was at rest
COLLAPSED = 0.02  # of its area at rest
ACROSS = 3  # rings of triangles that are a triangle's surroundings
LIPS = 0.012  # metres along the skin from the border of a lip that count as that lip
LIDS = 0.006  # metres from the ball within which skin is a lid
APART = 0.003  # metres along the skin: lips are told apart from here, they are one at the corner
TOUCH = 0.0002  # metres that lips press into each other without being swallowed
DEEPEST = 0.006  # metres up to which depths are looked for


def held(found: tuple[float, ...], bars: tuple[float, ...], missed: tuple[float, ...]) -> None:
    """Figures are at most their bars; where one is over it, at most as far as is `missed` today."""
    assert all(f <= max(bar, most) for f, bar, most in zip(found, bars, missed, strict=True))
    if any(f > bar for f, bar in zip(found, bars, strict=True)):
        pytest.xfail(f"the mouth of today gives {found}, where {bars} is asked")


class Surface:
    """What of the rig's mesh is looked at, found once on the face at rest.

    triangles : (t, 3) of the skin; all ids are into these.
    """

    def __init__(self, rig) -> None:
        self.rig = rig
        self.rest = rig.neutral()
        skin = rig.triangle_part == rig.part_names.index("skin")
        hair = [rig.part_names.index(name) for name in ("lashes", "brows")]
        self.solid = np.flatnonzero(~np.isin(rig.triangle_part, hair))
        self.triangles = rig.triangles[skin]
        self.corners = corner_matrix(self.triangles, rig.n_vertices)
        self.is_skin = skin[self.solid]

    @cached_property
    def seen(self) -> np.ndarray:
        """(t,) bool: skin that some view shows at rest or with the eyes closed."""
        found = np.zeros(self.rig.n_vertices, dtype=bool)
        for aus in ({}, {"blink": 5.0}):
            for turned in views(self.rig.shape(FaceParameters(aus))):
                camera = Camera.framing(turned, PIXELS, PIXELS)
                buffers = rasterise(turned, self.rig.triangles[self.solid], camera)
                facing = (self.corners @ triangle_normals(turned, self.triangles))[:, 2] > 0
                found |= visible(turned, camera, buffers, 0.8 * MM) & facing
        return found[self.triangles].all(axis=1)

    # --- folds ---

    @cached_property
    def around(self) -> sp.csr_matrix:
        """(seen, t) which triangles are near each seen one: ACROSS rings of them, and itself."""
        touch = _ones(self.corners.T @ self.corners)
        rows = touch[self.seen]
        for _ in range(ACROSS - 1):
            rows = _ones(rows @ touch)
        return rows

    def bent(self, vertices: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """(k,) cosine between the normals of some seen triangles and of their surroundings."""
        normals = triangle_normals(vertices, self.triangles)
        own = normals[np.flatnonzero(self.seen)[rows]]
        wide = self.around[rows] @ normals - own
        length = np.linalg.norm(own, axis=1) * np.linalg.norm(wide, axis=1)
        return np.einsum("ij,ij->i", own, wide) / np.maximum(length, 1e-20)

    def folded(self, vertices: np.ndarray, rest: np.ndarray) -> np.ndarray:
        """Ids of seen triangles that are turned over, and are not at rest."""
        # who has not turned much against the person at rest needs no look at the surroundings
        now, then = (triangle_normals(v, self.triangles[self.seen]) for v in (vertices, rest))
        cosine = np.einsum("ij,ij->i", now, then)
        size = np.linalg.norm(now, axis=1) * np.linalg.norm(then, axis=1)
        rows = np.flatnonzero(cosine < TURNED * size)
        rows = rows[self.bent(vertices, rows) < FOLDED]
        rows = rows[self.bent(rest, rows) >= FOLDED]
        return np.flatnonzero(self.seen)[rows]

    def collapsed(self, vertices: np.ndarray, rest: np.ndarray) -> np.ndarray:
        """Ids of seen triangles with less than COLLAPSED of their area at rest."""
        now, then = (
            np.linalg.norm(triangle_normals(v, self.triangles[self.seen]), axis=1)
            for v in (vertices, rest)
        )
        return np.flatnonzero(self.seen)[now < COLLAPSED * then]

    def backs(self, vertices: np.ndarray, yaw: float = 0.0) -> int:
        """Pixels of a picture PIXELS high in which the inside of seen skin is in front.

        The outside of a closed surface hides its inside, unless it is turned over.
        """
        both = self.rig.triangles[self.solid]
        both = np.concatenate([both, both[:, ::-1]])
        inside = np.zeros(len(self.solid), dtype=bool)
        inside[np.flatnonzero(self.is_skin)[self.seen]] = True
        turned = vertices @ rotation((yaw, 0.0, 0.0)).T
        camera = Camera.framing(turned, PIXELS, PIXELS)
        owner = rasterise(turned, both, camera).triangle
        owner = owner[owner >= len(self.solid)] - len(self.solid)
        return int(inside[owner].sum())

    # --- lips and lids ---

    @cached_property
    def lips(self) -> tuple[Patch, Patch]:
        """The upper and the lower lip, told apart along the skin."""
        joints = self.rig.joints()
        middle = (joints["eye_left"] + joints["eye_right"]) / 2
        curves = lip_curves(self.rest, self.rig.triangles, self.rig.parts["skin"], middle)
        up, low = (
            self._along(index[np.arange(len(index)), weight.argmax(axis=1)])
            for index, weight in (curves["lip_upper"], curves["lip_lower"])
        )
        near = (np.minimum(up, low) < LIPS) & (np.abs(up - low) > APART)
        upper, lower = (
            Patch(self.triangles[(near & own)[self.triangles].all(axis=1)])
            for own in (up < low, low < up)
        )
        return upper, lower

    def _along(self, sources: np.ndarray) -> np.ndarray:
        """(n,) metres along the skin's edges to the nearest of some vertices, 1 if far away."""
        edges = np.concatenate([self.triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
        length = np.linalg.norm(self.rest[edges[:, 0]] - self.rest[edges[:, 1]], axis=1)
        n = self.rig.n_vertices
        graph = sp.csr_matrix((length, edges.T), shape=(n, n))
        far = dijkstra(graph.maximum(graph.T), indices=sources, min_only=True, limit=0.06)
        return np.nan_to_num(far, posinf=1.0)

    @cached_property
    def eyes(self) -> list[tuple[Patch, Patch, Patch]]:
        """The upper lid, the lower lid and the ball of each eye.

        The lids' inner edges count, the skin of the sockets behind the balls does not.
        """
        mark = dict(zip(LANDMARKS, self.rig.landmarks, strict=True))
        touch = self.corners.T @ self.corners
        skin = self.seen.astype(np.float32)
        for _ in range(2):
            skin = (touch @ skin > 0).astype(np.float32)
        out = []
        for side, sign in (("left", 1), ("right", -1)):
            centre = self.rig.joints()[f"eye_{side}"]
            inner, outer = (self.rest[mark[f"eye_{k}_{side}"]] for k in ("inner", "outer"))
            width = np.linalg.norm(outer - inner)
            across = (outer - inner) / width
            up = np.cross(across, (inner + outer) / 2 - centre)
            up *= np.sign(up[1]) / np.linalg.norm(up)
            arm = self.rest - inner
            height, along = arm @ up, arm @ across / width
            own = self.rig.parts["eyes"] & (sign * self.rest[:, 0] > 0)
            ball = self.rig.triangles[own[self.rig.triangles].all(axis=1)]
            away = np.linalg.norm(self.rest - centre, axis=1)
            near = away - np.linalg.norm(self.rest[own] - centre, axis=1).min() < LIDS
            near &= (along > -0.2) & (along < 1.2) & (np.abs(height) < 12 * MM)
            lids = (
                Patch(self.triangles[(near & part)[self.triangles].all(axis=1) & (skin > 0)])
                for part in (height > 0.5 * MM, height < -0.5 * MM)
            )
            out.append((*lids, Patch(ball)))
        return out

    @cached_property
    def areas(self) -> np.ndarray:
        """(n,) square metres of skin around each vertex at rest."""
        sizes = np.linalg.norm(triangle_normals(self.rest, self.triangles), axis=1) / 2
        return self.corners @ sizes / 3

    @cached_property
    def seen_of(self) -> dict[Patch, np.ndarray]:
        """The vertices of lips and lids that can be seen."""
        seen = np.unique(self.triangles[self.seen])
        patches = [*self.lips, *(lid for eye in self.eyes for lid in eye[:2])]
        return {patch: np.intersect1d(patch.used, seen) for patch in patches}

    def lip_depth(self, vertices: np.ndarray) -> tuple[int, float]:
        """Pairs of triangles of the two lips that cross, and how deep, in metres."""
        return crossing(vertices, *self.lips)

    def swallowed(self, vertices: np.ndarray) -> float:
        """Square metres of the seen skin of either lip that lie inside the other one."""
        total = 0.0
        for own, other in (self.lips, self.lips[::-1]):
            at = self.seen_of[own]
            deep = behind(vertices[at], other.tree(vertices))
            total += float(self.areas[at[deep > TOUCH]].sum())
        return total

    def lid_depth(self, vertices: np.ndarray) -> tuple[int, float]:
        """Pairs of triangles of upper and lower lids that cross, and how deep, in metres."""
        pairs, depth = zip(*(crossing(vertices, *eye[:2]) for eye in self.eyes), strict=True)
        return sum(pairs), max(depth)

    def in_ball(self, vertices: np.ndarray) -> np.ndarray:
        """(k,) metres that seen skin of the lids lies in its eyeball."""
        deep = []
        for *lids, ball in self.eyes:
            tree = ball.tree(vertices)
            deep += [behind(vertices[self.seen_of[lid]], tree) for lid in lids]
        return np.concatenate(deep)

    def ball_depth(self, vertices: np.ndarray, rest: np.ndarray) -> float:
        """Metres that seen skin of a lid lies deeper in its ball than at rest (n, 3)."""
        now = self.in_ball(vertices)
        return float((now - self.in_ball(rest)).max()) if now.any() else 0.0


def window(camera: Camera, points: np.ndarray) -> Camera:
    """The part of a camera's picture, in whole pixels, in which places (k, 3) lie: there it shows
    the very pixels of the whole picture, for a twentieth of the work."""
    pixels = camera.project(points)
    low = np.clip(np.floor(pixels.min(axis=0)).astype(int), 0, None)
    high = np.minimum(np.ceil(pixels.max(axis=0)).astype(int), (camera.width, camera.height))
    return camera.cropped(*low, *high, *(high - low))


def views(vertices: np.ndarray) -> list[np.ndarray]:
    """The face (n, 3) turned as the views see it."""
    return [vertices @ rotation((yaw, 0.0, 0.0)).T for yaw in YAWS]


def _ones(matrix: sp.spmatrix) -> sp.csr_matrix:
    matrix = matrix.tocsr()
    matrix.data = np.ones(len(matrix.data), dtype=np.float32)
    return matrix


class Patch:
    """Some triangles (k, 3) of the mesh, for Blender's own search trees."""

    def __init__(self, triangles: np.ndarray) -> None:
        self.triangles = triangles
        self.used, local = np.unique(triangles, return_inverse=True)
        self._polygons = local.reshape(-1, 3).tolist()

    def tree(self, vertices: np.ndarray):
        """The triangles where vertices (n, 3) are."""
        import bpy  # noqa: F401  (brings mathutils)
        from mathutils.bvhtree import BVHTree

        return BVHTree.FromPolygons(
            vertices[self.used].tolist(), self._polygons, all_triangles=True
        )


def crossing(vertices: np.ndarray, one: Patch, other: Patch) -> tuple[int, float]:
    """Pairs of triangles of two patches that pass through each other, not counting neighbours,
    and how many metres the deepest of their corners is behind the other patch."""
    trees = one.tree(vertices), other.tree(vertices)
    pairs = np.array(trees[0].overlap(trees[1]), dtype=int).reshape(-1, 2)
    a, b = one.triangles[pairs[:, 0]], other.triangles[pairs[:, 1]]
    apart = ~(a[:, :, None] == b[:, None, :]).any(axis=(1, 2))
    if not apart.any():
        return 0, 0.0
    corners = np.unique(a[apart]), np.unique(b[apart])
    deep = behind(vertices[corners[0]], trees[1]), behind(vertices[corners[1]], trees[0])
    return int(apart.sum()), float(max(d.max() for d in deep))


def behind(points: np.ndarray, tree) -> np.ndarray:
    """(k,) metres that points (k, 3) lie behind the surface of a search tree, 0 in front of it.

    A point whose nearest place is on the surface's edge may be beside it: that is not behind.
    """
    found = [tree.find_nearest(point, DEEPEST) for point in points.tolist()]
    near = np.array([k for k, hit in enumerate(found) if hit[0] is not None], dtype=int)
    out = np.zeros(len(points))
    if len(near):
        places, normals = (np.array([found[k][c][:] for k in near]) for c in (0, 1))
        way = places - points[near]
        depth = np.einsum("ij,ij->i", way, normals)
        out[near] = np.where(depth > 0.7 * np.linalg.norm(way, axis=1), depth, 0.0)
    return out


def random_expression(rng: np.random.Generator, count: int = 10, most: float = 5.0) -> dict:
    """`count` different controls at random values up to `most`."""
    chosen = rng.choice(len(CONTROL_NAMES), count, replace=False)
    return {CONTROL_NAMES[k]: round(float(rng.uniform(0, most)), 2) for k in chosen}
