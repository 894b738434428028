"""The loops over a mesh, written for numba; `linework.arrays` has the same functions in numpy.

Nothing here imports numba, and no function calls another: `linework.kernels` compiles each by
itself. Arrays are C-contiguous: float64, int32 where they index, bool where they choose.
"""

from __future__ import annotations

import numpy as np


def vertex_normals(vertices, triangles):
    """Unit normals (n, 3): the mean of the triangles around a vertex, weighted with area."""
    out = np.zeros(vertices.shape)
    for t in range(len(triangles)):
        a, b, c = triangles[t]
        ux = vertices[b, 0] - vertices[a, 0]
        uy = vertices[b, 1] - vertices[a, 1]
        uz = vertices[b, 2] - vertices[a, 2]
        vx = vertices[c, 0] - vertices[a, 0]
        vy = vertices[c, 1] - vertices[a, 1]
        vz = vertices[c, 2] - vertices[a, 2]
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        for k in range(3):
            p = triangles[t, k]
            out[p, 0] += x
            out[p, 1] += y
            out[p, 2] += z
    for p in range(len(out)):
        x, y, z = out[p]
        length = max(np.sqrt(x * x + y * y + z * z), 1e-20)
        out[p, 0] = x / length
        out[p, 1] = y / length
        out[p, 2] = z / length
    return out


def radial_curvature(vertices, triangles, chosen, normals, view):
    """See dataset_gen.linework.curvature.radial_curvature; of the `chosen` (t,) triangles alone."""
    n = len(vertices)
    weight = np.zeros(n)
    curvature = np.zeros(n)
    growth = np.zeros(n)
    count = 0
    for t in range(len(chosen)):
        count += chosen[t]
    slopes = np.empty((count, 3))
    areas = np.empty(count)
    p = np.empty((3, 3))
    m = np.empty((3, 3))
    here = 0
    for t in range(len(triangles)):
        if not chosen[t]:
            continue
        vx, vy, vz = 0.0, 0.0, 0.0
        for k in range(3):
            corner = triangles[t, k]
            for d in range(3):
                p[k, d] = vertices[corner, d]
                m[k, d] = normals[corner, d]
            vx += view[corner, 0]
            vy += view[corner, 1]
            vz += view[corner, 2]
        vx, vy, vz = vx / 3, vy / 3, vz / 3
        ux, uy, uz = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
        sx, sy, sz = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1], p[2, 2] - p[0, 2]
        nx, ny, nz = uy * sz - uz * sy, uz * sx - ux * sz, ux * sy - uy * sx
        area2 = max(nx * nx + ny * ny + nz * nz, 1e-24)
        ax, ay, az = (
            m[0, 0] + m[1, 0] + m[2, 0], m[0, 1] + m[1, 1] + m[2, 1], m[0, 2] + m[1, 2] + m[2, 2]
        )  # fmt: skip
        length = max(np.sqrt(ax * ax + ay * ay + az * az), 1e-12)
        ax, ay, az = ax / length, ay / length, az / length
        along = vx * ax + vy * ay + vz * az
        wx, wy, wz = vx - along * ax, vy - along * ay, vz - along * az
        length2 = max(wx * wx + wy * wy + wz * wz, 1e-6)
        per_area, per_length = 1 / area2, 1 / np.sqrt(length2)
        # the slope along w of the hat function of each corner
        cx, cy, cz = wy * nz - wz * ny, wz * nx - wx * nz, wx * ny - wy * nx
        kr = 0.0
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            slope = (
                (p[j, 0] - p[i, 0]) * cx + (p[j, 1] - p[i, 1]) * cy + (p[j, 2] - p[i, 2]) * cz
            ) * per_area
            kr += slope * (m[k, 0] * wx + m[k, 1] * wy + m[k, 2] * wz)
            slopes[here, k] = slope * per_length
        kr /= length2
        area = np.sqrt(area2)
        areas[here] = area
        for k in range(3):
            weight[triangles[t, k]] += area
            curvature[triangles[t, k]] += area * kr
        here += 1
    for v in range(n):
        curvature[v] /= max(weight[v], 1e-24)
    here = 0
    for t in range(len(triangles)):
        if not chosen[t]:
            continue
        a, b, c = triangles[t]
        rise = (
            curvature[a] * slopes[here, 0]
            + curvature[b] * slopes[here, 1]
            + curvature[c] * slopes[here, 2]
        ) * areas[here]
        growth[a] += rise
        growth[b] += rise
        growth[c] += rise
        here += 1
    for v in range(n):
        growth[v] /= max(weight[v], 1e-24)
    return curvature, growth


def touching(triangles, chosen, hot):
    """Which of the chosen (t,) triangles have a corner among the hot (n,) vertices."""
    out = np.zeros(len(triangles), dtype=np.bool_)
    for t in range(len(triangles)):
        a, b, c = triangles[t]
        out[t] = chosen[t] and (hot[a] or hot[b] or hot[c])
    return out


def rises(vertices, triangles, chosen, value, direction):
    """(n, 3) derivatives of a field (n,) along directions (n, 3), times these directions.

    Of its gradients, the mean over the `chosen` (t,) triangles around a vertex, weighted with area.
    """
    out = np.zeros((len(vertices), 3))
    weight = np.zeros(len(vertices))
    for t in range(len(triangles)):
        if not chosen[t]:
            continue
        a, b, c = triangles[t]
        ux = vertices[b, 0] - vertices[a, 0]
        uy = vertices[b, 1] - vertices[a, 1]
        uz = vertices[b, 2] - vertices[a, 2]
        vx = vertices[c, 0] - vertices[a, 0]
        vy = vertices[c, 1] - vertices[a, 1]
        vz = vertices[c, 2] - vertices[a, 2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        area = np.sqrt(max(nx * nx + ny * ny + nz * nz, 1e-24))
        # the sum of value times opposite side, as value - value[a] has no part at a
        fb, fc = (value[b] - value[a]) / area, (value[c] - value[a]) / area
        ox, oy, oz = fc * ux - fb * vx, fc * uy - fb * vy, fc * uz - fb * vz
        gx, gy, gz = ny * oz - nz * oy, nz * ox - nx * oz, nx * oy - ny * ox
        for k in range(3):
            v = triangles[t, k]
            weight[v] += area
            out[v, 0] += gx
            out[v, 1] += gy
            out[v, 2] += gz
    for v in range(len(out)):
        if weight[v] > 0:
            x, y, z = direction[v]
            along = (out[v, 0] * x + out[v, 1] * y + out[v, 2] * z) / weight[v]
            out[v, 0], out[v, 1], out[v, 2] = along * x, along * y, along * z
    return out


def shape_operators(vertices, triangles, chosen, normals):
    """(n, 6) symmetric gradients xx, xy, xz, yy, yz, zz of normals (n, 3), means as in `rises`."""
    out = np.zeros((len(vertices), 6))
    weight = np.zeros(len(vertices))
    for t in range(len(triangles)):
        if not chosen[t]:
            continue
        a, b, c = triangles[t]
        ux = vertices[b, 0] - vertices[a, 0]
        uy = vertices[b, 1] - vertices[a, 1]
        uz = vertices[b, 2] - vertices[a, 2]
        vx = vertices[c, 0] - vertices[a, 0]
        vy = vertices[c, 1] - vertices[a, 1]
        vz = vertices[c, 2] - vertices[a, 2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        area = np.sqrt(max(nx * nx + ny * ny + nz * nz, 1e-24))
        nx, ny, nz = nx / area, ny / area, nz / area
        # gradients of the hat functions of b and c, times area
        bx, by, bz = nz * vy - ny * vz, nx * vz - nz * vx, ny * vx - nx * vy
        cx, cy, cz = ny * uz - nz * uy, nz * ux - nx * uz, nx * uy - ny * ux
        px = normals[b, 0] - normals[a, 0]
        py = normals[b, 1] - normals[a, 1]
        pz = normals[b, 2] - normals[a, 2]
        qx = normals[c, 0] - normals[a, 0]
        qy = normals[c, 1] - normals[a, 1]
        qz = normals[c, 2] - normals[a, 2]
        xx, yy, zz = bx * px + cx * qx, by * py + cy * qy, bz * pz + cz * qz
        xy = (bx * py + by * px + cx * qy + cy * qx) / 2
        xz = (bx * pz + bz * px + cx * qz + cz * qx) / 2
        yz = (by * pz + bz * py + cy * qz + cz * qy) / 2
        for k in range(3):
            v = triangles[t, k]
            weight[v] += area
            out[v, 0] += xx
            out[v, 1] += xy
            out[v, 2] += xz
            out[v, 3] += yy
            out[v, 4] += yz
            out[v, 5] += zz
    for v in range(len(out)):
        if weight[v] > 0:
            for d in range(6):
                out[v, d] /= weight[v]
    return out


def sign_changes(triangles, triangle_edges, chosen, value):
    """Pairs of edges (s, 2) of triangles that the zero line of `value` (n,) crosses."""
    pairs = np.empty((len(triangles), 2), dtype=np.int32)
    count = 0
    for t in range(len(triangles)):
        if not chosen[t]:
            continue
        a = value[triangles[t, 0]] > 0
        b = value[triangles[t, 1]] > 0
        c = value[triangles[t, 2]] > 0
        if a == b and b == c:
            continue
        side = 0
        for k in range(3):
            if (a != b, b != c, c != a)[k]:
                pairs[count, side] = triangle_edges[t, k]
                side += 1
        count += 1
    return pairs[:count]


def turns(triangles, triangle_edges, chosen, rise, vertices):
    """Like `sign_changes`, for vectors `rise` (n, 3): edges on which they turn against each other.

    A field that is largest along a line rises toward it from both sides: across a triangle's part
    of the line the vectors turn round, and they point to the line, not away from it.
    """
    pairs = np.empty((len(triangles), 2), dtype=np.int32)
    crossed = np.zeros(3, dtype=np.bool_)
    against = np.zeros(3)
    length = np.zeros(3)
    count = 0
    for t in range(len(triangles)):
        if not chosen[t]:
            continue
        crossings = 0
        for k in range(3):
            a, b = triangles[t, k], triangles[t, (k + 1) % 3]
            against[k] = rise[a, 0] * rise[b, 0] + rise[a, 1] * rise[b, 1] + rise[a, 2] * rise[b, 2]
            crossed[k] = against[k] <= 0
            crossings += crossed[k]
        if crossings < 2:
            continue
        most = 0
        for k in range(3):
            a = triangles[t, k]
            length[k] = np.sqrt(rise[a, 0] ** 2 + rise[a, 1] ** 2 + rise[a, 2] ** 2)
            if length[k] > length[most]:
                most = k
        if length[0] == 0 or length[1] == 0 or length[2] == 0:
            continue
        if crossings == 3:  # no line crosses three edges: the least certain one is none
            for k in range(3):
                against[k] /= length[k] * length[(k + 1) % 3]
            least = 0
            for k in range(1, 3):
                if against[k] > against[least]:
                    least = k
            crossed[least] = False
        a, b, c = triangles[t]
        ux = vertices[b, 0] - vertices[a, 0]
        uy = vertices[b, 1] - vertices[a, 1]
        uz = vertices[b, 2] - vertices[a, 2]
        vx = vertices[c, 0] - vertices[a, 0]
        vy = vertices[c, 1] - vertices[a, 1]
        vz = vertices[c, 2] - vertices[a, 2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        m = triangles[t, most]
        rx, ry, rz = rise[m, 0], rise[m, 1], rise[m, 2]
        falls = 0.0  # how the rise along its own direction changes along that direction
        for k in range(3):
            i, j, o = triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3], triangles[t, k]
            ox = vertices[j, 0] - vertices[i, 0]
            oy = vertices[j, 1] - vertices[i, 1]
            oz = vertices[j, 2] - vertices[i, 2]
            hat = (ny * oz - nz * oy) * rx + (nz * ox - nx * oz) * ry + (nx * oy - ny * ox) * rz
            falls += hat * (rise[o, 0] * rx + rise[o, 1] * ry + rise[o, 2] * rz)
        if falls >= 0:
            continue
        side = 0
        for k in range(3):
            if crossed[k]:
                pairs[count, side] = triangle_edges[t, k]
                side += 1
        count += 1
    return pairs[:count]


def number(pairs, edges):
    """The edges (p,) that segments run between, each once, and the segments (s, 2) of these.

    pairs : (s, 2) edges of each segment;  edges : how many edges there are
    """
    at = np.full(edges, -1, dtype=np.int32)
    used = np.empty(2 * len(pairs), dtype=np.int32)
    segments = np.empty((len(pairs), 2), dtype=np.int32)
    count = 0
    for s in range(len(pairs)):
        for k in range(2):
            edge = pairs[s, k]
            if at[edge] < 0:
                at[edge] = count
                used[count] = edge
                count += 1
            segments[s, k] = at[edge]
    return used[:count], segments


def edge_weights(triangles, owner, start, end, share):
    """Barycentric weights (m, 3), in triangles `owner` (m,), of points on the edges start-end."""
    out = np.zeros((len(owner), 3))
    for i in range(len(owner)):
        for k in range(3):
            corner = triangles[owner[i], k]
            if corner == start[i]:
                out[i, k] = 1 - share[i]
            elif corner == end[i]:
                out[i, k] = share[i]
    return out


def mixed(triangles, owner, weights, values):
    """Fields (n, c) of the vertices at points with barycentric weights (m, 3): (m, c)."""
    out = np.empty((len(owner), values.shape[1]))
    for i in range(len(owner)):
        a, b, c = triangles[owner[i]]
        for f in range(values.shape[1]):
            out[i, f] = (
                weights[i, 0] * values[a, f]
                + weights[i, 1] * values[b, f]
                + weights[i, 2] * values[c, f]
            )
    return out


def topmost(pixels, z, triangles, points):
    """Depth (p,) and number (p,) of the nearest triangle that faces the viewer over each point.

    pixels : (n, 2) of the vertices;  z : (n,) their depths;  points : (p, 2) pixels
    -inf and -1 where there is none. Points are sorted into cells, and every triangle looks at
    the points of the cells that it touches.
    """
    p = len(points)
    depth = np.full(p, -np.inf)
    owner = np.full(p, -1, dtype=np.int32)
    if p == 0:
        return depth, owner
    left, top = points[0]
    right, bottom = points[0]
    for i in range(p):
        left, right = min(left, points[i, 0]), max(right, points[i, 0])
        top, bottom = min(top, points[i, 1]), max(bottom, points[i, 1])
    side = 256
    iu = 1 / max((right - left) / side, 1e-9)
    iv = 1 / max((bottom - top) / side, 1e-9)
    cell = np.empty(p, dtype=np.int32)
    start = np.zeros(side * side + 1, dtype=np.int32)
    for i in range(p):
        col = min(int((points[i, 0] - left) * iu), side - 1)
        row = min(int((points[i, 1] - top) * iv), side - 1)
        cell[i] = row * side + col
        start[cell[i] + 1] += 1
    for i in range(side * side):
        start[i + 1] += start[i]
    order = np.empty(p, dtype=np.int32)
    fill = start.copy()
    for i in range(p):
        order[fill[cell[i]]] = i
        fill[cell[i]] += 1
    for t in range(len(triangles)):
        a, b, c = triangles[t]
        au, av = pixels[a, 0], pixels[a, 1]
        bu, bv = pixels[b, 0], pixels[b, 1]
        cu, cv = pixels[c, 0], pixels[c, 1]
        area = (bu - au) * (cv - av) - (bv - av) * (cu - au)
        if area >= 0:  # v runs down: what faces the viewer has a negative area
            continue
        low, high = min(au, bu, cu), max(au, bu, cu)
        near, far = min(av, bv, cv), max(av, bv, cv)
        if high < left or low > right or far < top or near > bottom:
            continue
        first = min(int(max(low - left, 0.0) * iu), side - 1)
        last = min(int((high - left) * iu), side - 1)
        for row in range(
            min(int(max(near - top, 0.0) * iv), side - 1), min(int((far - top) * iv), side - 1) + 1
        ):
            for s in range(start[row * side + first], start[row * side + last + 1]):
                i = order[s]
                u, v = points[i]
                wa = ((cu - bu) * (v - bv) - (cv - bv) * (u - bu)) / area
                wb = ((au - cu) * (v - cv) - (av - cv) * (u - cu)) / area
                if wa < -1e-9 or wb < -1e-9 or wa + wb > 1 + 1e-9:
                    continue
                here = wa * z[a] + wb * z[b] + (1 - wa - wb) * z[c]
                if here > depth[i]:
                    depth[i] = here
                    owner[i] = t
    return depth, owner


def principal(shape, normals):
    """Principal curvatures k1, k2 (n,), |k1| >= |k2|, and directions d1, d2 (n, 3) of vertices.

    shape : (n, 6) of `shape_operators`; where it is 0 everything is
    """
    n = len(normals)
    k1, k2 = np.zeros(n), np.zeros(n)
    d1, d2 = np.zeros((n, 3)), np.zeros((n, 3))
    e, f = np.empty(3), np.empty(3)
    for v in range(n):
        some = 0.0
        for d in range(6):
            some += abs(shape[v, d])
        if some == 0.0:
            continue
        x, y, z = normals[v]
        if abs(x) <= abs(y) and abs(x) <= abs(z):
            e[0], e[1], e[2] = 0.0, z, -y
        elif abs(y) <= abs(z):
            e[0], e[1], e[2] = -z, 0.0, x
        else:
            e[0], e[1], e[2] = y, -x, 0.0
        length = max(np.sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2]), 1e-30)
        for d in range(3):
            e[d] /= length
        f[0], f[1], f[2] = y * e[2] - z * e[1], z * e[0] - x * e[2], x * e[1] - y * e[0]
        xx, xy, xz, yy, yz, zz = shape[v]
        sx = xx * e[0] + xy * e[1] + xz * e[2]
        sy = xy * e[0] + yy * e[1] + yz * e[2]
        sz = xz * e[0] + yz * e[1] + zz * e[2]
        ee = sx * e[0] + sy * e[1] + sz * e[2]
        ef = sx * f[0] + sy * f[1] + sz * f[2]
        sx = xx * f[0] + xy * f[1] + xz * f[2]
        sy = xy * f[0] + yy * f[1] + yz * f[2]
        sz = xz * f[0] + yz * f[1] + zz * f[2]
        ff = sx * f[0] + sy * f[1] + sz * f[2]
        mean = (ee + ff) / 2
        half = np.sqrt((ee - ff) * (ee - ff) / 4 + ef * ef)
        side = 1.0 if mean >= 0 else -1.0
        k1[v], k2[v] = mean + side * half, mean - side * half
        if side * (ee - ff) >= 0:
            a, b = k1[v] - ff, ef
        else:
            a, b = ef, k1[v] - ee
        length = np.sqrt(a * a + b * b)
        if length < 1e-20:
            a, b, length = 1.0, 0.0, 1.0
        a, b = a / length, b / length
        for d in range(3):
            d1[v, d] = a * e[d] + b * f[d]
            d2[v, d] = a * f[d] - b * e[d]
    return k1, k2, d1, d2


def chain(ends, first, places, used, line, starts):
    """Chain segments into lines; returns how many lines there are.

    ends : (2s,) point numbers, two for each segment;  first (p + 1,), places (2s,) : where in
    `ends` each point occurs;  used (s,) : False, becomes True
    line (2s,) becomes the points of one line after another, starts (s + 1,) where each starts.
    Works on lists, which plain Python reads quicker, as well as on arrays.
    """
    size, lines = 0, 0
    total = len(first) - 1
    for attempt in range(2 * total):  # lines from their loose ends, then what is closed
        start = attempt % total
        if attempt < total and (first[start + 1] - first[start]) % 2 == 0:
            continue
        going = True
        while going:
            here = start
            going = False
            searching = True
            while searching:
                searching = False
                for k in range(first[here], first[here + 1]):
                    place = places[k]
                    if not used[place // 2]:
                        used[place // 2] = True
                        if not going:
                            starts[lines] = size
                            lines += 1
                            line[size] = here
                            size += 1
                            going = True
                        here = ends[place ^ 1]
                        line[size] = here
                        size += 1
                        searching = True
                        break
    starts[lines] = size
    return lines
