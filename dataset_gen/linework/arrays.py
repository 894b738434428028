"""The functions of dataset_gen.linework.compiled in plain numpy, for machines without numba.

Same arguments, same results but for rounding; the docstrings are there.
"""

from __future__ import annotations

import numpy as np

from .compiled import chain as chain_lists


def vertex_normals(vertices, triangles):
    a, b, c = corners = _columns(triangles, np.intp)
    axes = _columns(vertices, np.float64)
    first = [axis[a] for axis in axes]
    u = [axis[b] - at for axis, at in zip(axes, first, strict=True)]
    v = [axis[c] - at for axis, at in zip(axes, first, strict=True)]
    around = np.concatenate(corners)
    x, y, z = (
        np.bincount(around, np.tile(u[i] * v[j] - u[j] * v[i], 3), len(vertices))
        for i, j in ((1, 2), (2, 0), (0, 1))
    )
    length = np.maximum(np.sqrt(x * x + y * y + z * z), 1e-20)
    return np.stack([x / length, y / length, z / length], axis=1)


def radial_curvature(vertices, triangles, chosen, normals, view):
    n = len(vertices)
    tri = triangles[chosen]
    p, m = vertices[tri], normals[tri]
    opposite = [p[:, 2] - p[:, 1], p[:, 0] - p[:, 2], p[:, 1] - p[:, 0]]
    normal = _cross(opposite[2], -opposite[1])
    area2 = np.maximum(np.einsum("ij,ij->i", normal, normal), 1e-24)
    mean = m[:, 0] + m[:, 1] + m[:, 2]
    mean /= np.maximum(np.sqrt(np.einsum("ij,ij->i", mean, mean)), 1e-12)[:, None]
    v = (view[tri[:, 0]] + view[tri[:, 1]] + view[tri[:, 2]]) / 3
    w = v - np.einsum("ij,ij->i", v, mean)[:, None] * mean
    length2 = np.maximum(np.einsum("ij,ij->i", w, w), 1e-6)
    across = _cross(w, normal)
    slopes = np.stack([np.einsum("ij,ij->i", o, across) for o in opposite], axis=1)
    slopes /= area2[:, None]
    kr = np.einsum("tk,tkd,td->t", slopes, m, w, optimize=["einsum_path", (1, 2), (0, 1)])
    kr /= length2
    area = np.sqrt(area2)
    weight = np.maximum(_sums(tri, area, n), 1e-24)
    curvature = _sums(tri, area * kr, n) / weight
    slopes /= np.sqrt(length2)[:, None]
    rise = np.einsum("tk,tk->t", curvature[tri], slopes) * area
    return curvature, _sums(tri, rise, n) / weight


def touching(triangles, chosen, hot):
    return chosen & (hot[triangles[:, 0]] | hot[triangles[:, 1]] | hot[triangles[:, 2]])


def _hats(vertices, tri):
    """Gradients of the hat functions of the second and third corner, times area, and area."""
    p = vertices[tri]
    u, v = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    normal = _cross(u, v)
    area = np.sqrt(np.maximum(np.einsum("ij,ij->i", normal, normal), 1e-24))
    normal /= area[:, None]
    return _cross(v, normal), _cross(normal, u), area


def rises(vertices, triangles, chosen, value, direction):
    tri = triangles[chosen]
    b, c, area = _hats(vertices, tri)
    b *= (value[tri[:, 1]] - value[tri[:, 0]])[:, None]
    c *= (value[tri[:, 2]] - value[tri[:, 0]])[:, None]
    total = _sums(tri, b + c, len(vertices))
    along = np.einsum("nd,nd->n", total, direction)
    along /= np.maximum(_sums(tri, area, len(vertices)), 1e-24)
    return along[:, None] * direction


def shape_operators(vertices, triangles, chosen, normals):
    tri = triangles[chosen]
    b, c, area = _hats(vertices, tri)
    p = normals[tri[:, 1]] - normals[tri[:, 0]]
    q = normals[tri[:, 2]] - normals[tri[:, 0]]
    both = [
        (b[:, i] * p[:, j] + b[:, j] * p[:, i] + c[:, i] * q[:, j] + c[:, j] * q[:, i]) / 2
        for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
    ]
    total = _sums(tri, np.stack(both, axis=1), len(vertices))
    return total / np.maximum(_sums(tri, area, len(vertices)), 1e-24)[:, None]


def principal(shape, normals):
    n, chosen = len(normals), shape.any(axis=1)
    k1, k2, d1, d2 = np.zeros(n), np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3))
    normal, s = normals[chosen], shape[chosen][:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
    size = np.abs(normal)
    flat = (size[:, 0] <= size[:, 1]) & (size[:, 0] <= size[:, 2])
    axis = np.where(flat, 0, np.where(size[:, 1] <= size[:, 2], 1, 2))
    e = _cross(normal, np.eye(3)[axis])
    e /= np.maximum(np.sqrt(np.einsum("ij,ij->i", e, e)), 1e-30)[:, None]
    f = _cross(normal, e)
    se = np.einsum("nij,nj->ni", s, e)
    sf = np.einsum("nij,nj->ni", s, f)
    ee, ff = np.einsum("ni,ni->n", e, se), np.einsum("ni,ni->n", f, sf)
    ef = np.einsum("ni,ni->n", f, se)
    mean, half = (ee + ff) / 2, np.sqrt((ee - ff) ** 2 / 4 + ef**2)
    side = np.where(mean >= 0, 1.0, -1.0)
    k1[chosen], k2[chosen] = mean + side * half, mean - side * half
    steep = side * (ee - ff) >= 0
    a = np.where(steep, k1[chosen] - ff, ef)
    b = np.where(steep, ef, k1[chosen] - ee)
    length = np.hypot(a, b)
    a, b = np.where(length < 1e-20, 1.0, a), np.where(length < 1e-20, 0.0, b)
    length = np.where(length < 1e-20, 1.0, length)
    a, b = (a / length)[:, None], (b / length)[:, None]
    d1[chosen], d2[chosen] = a * e + b * f, a * f - b * e
    return k1, k2, d1, d2


def sign_changes(triangles, triangle_edges, chosen, value):
    sign = (value > 0)[triangles]
    owner = np.flatnonzero(chosen & ((sign[:, 0] != sign[:, 1]) | (sign[:, 1] != sign[:, 2])))
    sign = sign[owner]
    crossed = sign != np.roll(sign, -1, axis=1)
    return triangle_edges[owner][crossed].reshape(-1, 2)


def turns(triangles, triangle_edges, chosen, rise, vertices):
    owner = np.flatnonzero(chosen)
    tri = triangles[owner]
    x, y, z = (rise[:, d][tri] for d in range(3))
    after = [1, 2, 0]
    against = x * x[:, after] + y * y[:, after] + z * z[:, after]
    maybe = np.flatnonzero((against <= 0).sum(axis=1) >= 2)
    owner, tri, against = owner[maybe], tri[maybe], against[maybe]
    here = rise[tri]
    length = np.sqrt(here[..., 0] ** 2 + here[..., 1] ** 2 + here[..., 2] ** 2)
    crossed = against <= 0
    whole = np.flatnonzero(crossed.all(axis=1) & (length > 0).all(axis=1))
    certain = against[whole] / (length[whole] * length[whole][:, after])
    crossed[whole, certain.argmax(axis=1)] = False
    p = vertices[tri]
    opposite = [p[:, 2] - p[:, 1], p[:, 0] - p[:, 2], p[:, 1] - p[:, 0]]
    normal = _cross(opposite[2], -opposite[1])
    way = here[np.arange(len(here)), length.argmax(axis=1)]
    falls = np.zeros(len(here))
    for k, side in enumerate(opposite):
        hat = np.einsum("td,td->t", _cross(normal, side), way)
        falls += hat * np.einsum("td,td->t", here[:, k], way)
    line = (length > 0).all(axis=1) & (falls < 0)
    return triangle_edges[owner[line]][crossed[line]].reshape(-1, 2)


def number(pairs, edges):
    used, first, index = np.unique(pairs.ravel(), return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")  # points are numbered as they are met
    place = np.empty(len(order), dtype=np.int32)
    place[order] = np.arange(len(order))
    return used[order], place[index].reshape(-1, 2)


def edge_weights(triangles, owner, start, end, share):
    corner, share = triangles[owner], share[:, None]
    first = np.where(corner == start[:, None], 1 - share, 0.0)
    return np.where(corner == end[:, None], share, first)


def mixed(triangles, owner, weights, values):
    corner = triangles[owner]
    return sum(weights[:, k, None] * values[corner[:, k]] for k in range(3))


def topmost(pixels, z, triangles, points):
    depth = np.full(len(points), -np.inf)
    owner = np.full(len(points), -1, dtype=np.int32)
    if not len(points):
        return depth, owner
    left, right = points.min(axis=0), points.max(axis=0)
    side = 256
    per = 1 / np.maximum((right - left) / side, 1e-9)
    col, row = np.minimum(((points - left) * per).astype(np.int64), side - 1).T
    cell = row * side + col
    order = np.argsort(cell, kind="stable")
    start = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=side * side))])
    corners = _columns(triangles, np.intp)
    u, v = _columns(pixels, np.float64)
    # Most triangles lie over no point: how many there are in their cells, by a table of sums.
    sums = np.zeros((side + 1, side + 1), dtype=np.int32)
    sums[1:, 1:] = np.diff(start).reshape(side, side).cumsum(axis=0).cumsum(axis=1)
    sums, wide = sums.ravel(), side + 1
    ends = []
    for axis, begin, scale in ((u, left[0], per[0]), (v, left[1], per[1])):
        place = np.clip((axis - begin) * scale, 0, side - 1).astype(np.int32)
        one, two, three = (place[corner] for corner in corners)
        ends += [most(most(one, two), three) for most in (np.minimum, np.maximum)]
    u0, u1, v0, v1 = ends
    low, high = v0 * wide, (v1 + 1) * wide
    over = sums[high + u1 + 1] - sums[low + u1 + 1] - sums[high + u0] + sums[low + u0]
    seen = np.flatnonzero(over)
    (au, bu, cu), (av, bv, cv) = ([axis[c[seen]] for c in corners] for axis in (u, v))
    area = (bu - au) * (cv - av) - (bv - av) * (cu - au)
    front = np.flatnonzero(area < 0)
    seen, area = seen[front], area[front]
    au, bu, cu, av, bv, cv = (axis[front] for axis in (au, bu, cu, av, bv, cv))
    u0, u1, v0, v1 = (end[seen].astype(np.intp) for end in (u0, u1, v0, v1))
    one, rows = _spread(v1 - v0 + 1)  # every row of cells of every triangle
    rows = (v0[one] + rows) * side
    begin = start[rows + u0[one]]
    pair, place = _spread(start[rows + u1[one] + 1] - begin)  # every point in that row
    row = one[pair]
    i, t = order[begin[pair] + place], seen[row]
    pu, pv = (axis[i] for axis in _columns(points, np.float64))
    au, bu, cu, av, bv, cv, area = (axis[row] for axis in (au, bu, cu, av, bv, cv, area))
    wa = ((cu - bu) * (pv - bv) - (cv - bv) * (pu - bu)) / area
    wb = ((au - cu) * (pv - cv) - (av - cv) * (pu - cu)) / area
    inside = np.flatnonzero((wa >= -1e-9) & (wb >= -1e-9) & (wa + wb <= 1 + 1e-9))
    i, t, wa, wb = i[inside], t[inside], wa[inside], wb[inside]
    za, zb, zc = (z[corner[t]] for corner in corners)
    here = wa * za + wb * zb + (1 - wa - wb) * zc
    np.maximum.at(depth, i, here)
    won = np.flatnonzero(here == depth[i])[::-1]  # of several, the first triangle
    owner[i[won]] = t[won]
    return depth, owner


def chain(ends, first, places, used, line, starts):
    uses = np.diff(first)
    if (uses > 2).any():
        lists = [array.tolist() for array in (ends, first, places, used, line, starts)]
        count = chain_lists(*lists)
        line[:], starts[:] = lists[4], lists[5]
        return count
    # No line branches: a segment, seen from either of its ends, goes on in one other at most.
    after = np.full(len(ends), -1)
    inner = first[:-1][uses == 2]
    after[places[inner]], after[places[inner + 1]] = places[inner + 1], places[inner]
    begins = [places[first[:-1][uses == count]].tolist() for count in (1, 2)]
    there, after, done = ends.tolist(), after.tolist(), used.tolist()
    points: list[int] = []
    begun: list[int] = []
    for place in [*begins[0], *begins[1]]:
        if done[place >> 1]:
            continue
        begun.append(len(points))
        points.append(there[place])
        while place >= 0 and not done[place >> 1]:
            done[place >> 1] = True
            points.append(there[place ^ 1])
            place = after[place ^ 1]
    line[: len(points)] = points
    starts[: len(begun) + 1] = [*begun, len(points)]
    return len(begun)


def _spread(counts):
    """For each thing as many rows as it counts: its number, and 0, 1, 2, … within it."""
    which = np.repeat(np.arange(len(counts)), counts)
    return which, np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)


def _sums(triangles, value, n):
    """A value (t,) or (t, c) of each triangle summed at its three vertices."""
    corners = triangles.T.ravel()
    if value.ndim == 1:
        return np.bincount(corners, np.tile(value, 3), n)
    return np.stack([np.bincount(corners, np.tile(c, 3), n) for c in value.T], axis=1)


def _cross(a, b):
    return np.stack(
        [
            a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1],
            a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2],
            a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0],
        ],
        axis=1,
    )


def _columns(array, kind):
    """The columns of an array (n, c), each contiguous: quicker to take from than rows."""
    return [np.ascontiguousarray(array[:, k], dtype=kind) for k in range(array.shape[1])]
