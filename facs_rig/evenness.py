"""Which further edges to split, so that quads fill what lies between coarse and fine ones.

Quads fill a region only if its rim has an even number of edges, and a coarse quad beside a finer
one has five: one of its sides is split. Where two such quads lie side by side, both become even
when the side that they share is split as well; others are joined by a path of split sides through
the quads between them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

GROUND = -1  # stands for all that is beyond a rim: any number of sides may be split toward it


def even_splits(
    quad_edges: NDArray,
    whole: NDArray,
    odd: NDArray,
    split: NDArray,
    mirror: tuple[NDArray, NDArray],
) -> NDArray[np.intp]:
    """Edges to be split as well, so that no quad that stays whole keeps an odd rim.

    quad_edges : (f, 4) edge between corner k and k + 1      split : (e,) bool, edges that are split
    whole : (k,) quads that stay      odd : (k,) bool, which of them have a rim of odd length
    mirror : the mirror image of each quad (f,) and of each edge (e,), or itself

    Such an edge lies between two quads that stay, or in one alone on the mesh's rim, where there
    is no other way; mirror images are split alike. So a quad and its image count as one, and
    the edge between these two changes both.
    """
    quad_mirror, edge_mirror = mirror
    node = np.full(len(quad_edges), -2)
    node[whole] = np.minimum(whole, quad_mirror[whole])
    is_odd = np.zeros(len(quad_edges), dtype=bool)
    is_odd[whole] = odd

    order = np.argsort(quad_edges, axis=None, kind="stable")
    uses = np.bincount(quad_edges.ravel(), minlength=len(split))
    last = np.cumsum(uses) - 1
    ends = np.sort(node[order[[last - uses + 1, last]] // 4], axis=0)
    edge = np.arange(len(split))
    rim, alike = uses == 1, ends[0] == ends[1]
    ends[0, rim | alike] = GROUND
    free = ~split & (ends[1] >= 0) & (ends[0] >= GROUND) & (edge <= edge_mirror)
    free &= ~alike | rim | (edge_mirror == edge)

    # Best is an edge of two odd quads that in both of them meets a split one at a corner.
    around = split[quad_edges].astype(np.int64)
    turns = np.zeros(len(split), dtype=np.int64)
    np.add.at(turns, quad_edges, np.roll(around, 1, axis=1) + np.roll(around, -1, axis=1))
    cost = 2 * (~is_odd[ends]).sum(axis=0) - np.minimum(turns, 2) + 8 * (ends[0] == GROUND)
    edge = edge[free]
    edge = edge[np.lexsort((edge, cost[edge], rim[edge]))]
    found = edge[_join(ends[:, edge].T, set(node[whole[odd]].tolist()))]
    return np.union1d(found, edge_mirror[found])


def _join(ends: NDArray, odd: set[int]) -> list[int]:
    """Which of the links (e, 2), the better ones first, join odd nodes in pairs or to the ground.

    There is but one way along a spanning forest, which takes the better links: from its tips
    inwards, each node that is odd passes that on.
    """
    root: dict[int, int] = {}

    def rooted(node: int) -> int:
        while root.setdefault(node, node) != node:
            root[node] = root[root[node]]
            node = root[node]
        return node

    links: dict[int, list[tuple[int, int]]] = {}
    for k, (a, b) in enumerate(ends.tolist()):
        if rooted(a) != rooted(b):
            root[rooted(a)] = rooted(b)
            links.setdefault(a, []).append((b, k))
            links.setdefault(b, []).append((a, k))
    chosen: list[int] = []
    odd, seen = set(odd), set()
    for start in sorted(links):  # the ground is the lowest, and so the root of its tree
        if start in seen:
            continue
        walk, ahead = [], [(start, start, -1)]
        while ahead:
            node, parent, link = ahead.pop()
            seen.add(node)
            walk.append((node, parent, link))
            ahead += [(other, node, k) for other, k in links[node] if other != parent]
        for node, parent, link in walk[:0:-1]:
            if node in odd:
                odd ^= {node, parent}
                chosen.append(link)
    return chosen


def mirror_images(rows: NDArray, mirror: NDArray) -> NDArray[np.intp]:
    """(k,) which of the edges or faces, vertices (k, c) of each, is the mirror image of each.

    mirror : (n,) vertices' mirror images. ValueError if the mesh is not symmetric.
    """
    given, wanted = np.sort(rows, axis=1), np.sort(mirror[rows], axis=1)
    order, other = np.lexsort(given.T), np.lexsort(wanted.T)
    if (given[order] != wanted[other]).any():
        raise ValueError("the mesh is not its own mirror image")
    out = np.empty(len(rows), dtype=np.intp)
    out[other] = order
    return out
