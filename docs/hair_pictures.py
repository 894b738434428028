"""The pictures of the heads of hair for docs/face.md."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from addon.preview import AMBIENT, LAMPS, PAPER
from addon.sheet import Picture, captioned, grid, seen_from
from facs_rig import Camera, FaceRig, load_rig, rasterise
from facs_rig.hair.cut import Cut
from facs_rig.hair.locks import hair
from facs_rig.hair.presets import PRESETS, preset
from facs_rig.looks import colours_of
from facs_rig.mesh import vertex_normals
from facs_rig.paint import painted, srgb
from facs_rig.raster import barycentric

SIZE = 260  # pixels, a head's picture
FINER = 2
VIEWS = (0.0, 40.0, 90.0, 180.0)  # degrees that the head is turned to its own left
PEOPLE: Mapping[str, Mapping[str, float]] = {
    "": {"gender": 0.2},
    "a child": {"age": -0.9},
    "comic": {"gender": 0.3, "eye_size": 1.9, "eye_opening": 1.7, "head_width": 1.2,
              "neck_girth": -1.8, "ear_size": 1.6, "nose_length": -0.6},
}  # fmt: skip
GLOSS, NARROW = 0.9, 40.0  # strength of the strands' highlight, and how narrow it is
TONES = 0.20  # how much lighter or darker locks are than the hair
STREAKS = 0.16  # and single hairs


def heads_of_hair(
    names: tuple[str, ...] = tuple(PRESETS), people: Mapping[str, Mapping[str, float]] = PEOPLE,
    size: int = SIZE, views: tuple[float, ...] = VIEWS, columns: int = 2,
) -> Picture:  # fmt: skip
    """Every preset on people, lit: from the front, in three quarters, from the side and behind."""
    rig = load_rig()
    blocks = []
    for name in names:
        for who, identity in people.items():
            row = [picture(rig, identity, preset(name), yaw, size) for yaw in views]
            text = name.replace("_", " ") + (f", {who}" if who else "")
            blocks.append(captioned(np.concatenate(row, axis=1), text))
    return grid(blocks, columns, gap=8)


def picture(
    rig: FaceRig,
    identity: Mapping[str, float],
    cut: Cut,
    yaw: float,
    size: int,
    detail: float = 1.0,
) -> Picture:
    """(size, w, 3) a person with a cut, turned by `yaw` degrees to its own left."""
    under, locks = hair(rig, identity, cut, np.random.default_rng(1), detail)
    face = rig.neutral(identity)
    parts: list[tuple[NDArray, NDArray]] = [(face, rig.triangles), (under.points, under.triangles)]
    parts.append((locks.points, locks.triangles))
    normals = [vertex_normals(*part) for part in parts]
    parts[2] = (locks.points, np.concatenate([locks.triangles, locks.triangles[:, ::-1]]))
    palette = colours_of(dict(identity) | {"brow_colour": cut.colour})
    plain = np.array(palette["brows"].colour[:3])
    dark = np.full(len(under.points), 0.65)
    dark[under.inner] = 0.15
    colours: list[NDArray] = [
        painted(rig).colours(palette)[:, :3],
        dark[:, None] * plain,
        (1 + TONES * locks.tone)[:, None] * plain,
    ]
    strands: list[NDArray] = [np.zeros_like(face), _strands(under), _locks_ahead(locks)]
    vertices = [part for part, _ in parts]
    points, normal, strand = (
        seen_from(np.concatenate(some), yaw) for some in (vertices, normals, strands)
    )
    firsts = np.cumsum([0, *(len(part) for part, _ in parts)])
    triangles = np.concatenate([t + n for (_, t), n in zip(parts, firsts, strict=False)])
    box = np.array([[-0.17, -0.18, 0], [0.17, 0.225, 0]])
    camera = Camera.framing(box, round(0.85 * size) * FINER, size * FINER, 0.0)
    owner = np.cumsum(locks.uv[:, 1] < np.roll(locks.uv[:, 1], 1))
    hairs: list[NDArray] = [
        np.zeros(len(face)),
        300 * under.uv[:, 0],
        11 * owner + 9 * locks.uv[:, 0],
    ]
    return _lit(
        points, triangles, camera, np.concatenate(colours), normal, strand, np.concatenate(hairs)
    )


def _strands(under) -> NDArray[np.float64]:
    """(n, 3) the direction of the hair at the points of a shell."""
    out = np.zeros((len(under.points), 3))
    for at in (under.outer, under.inner):
        out[at] = np.gradient(under.points[at], axis=1)
    for ring in under.tails:
        out[ring] = np.gradient(under.points[ring], axis=0)
    return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-9)


def _locks_ahead(locks) -> NDArray[np.float64]:
    out = np.zeros((len(locks.points), 3))
    pair = locks.quads[:, [0, 1]], locks.quads[:, [3, 2]]
    ahead = locks.points[pair[1]] - locks.points[pair[0]]
    for at in pair:
        out[at] += ahead
    return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-9)


def _lit(
    points: NDArray, triangles: NDArray, camera: Camera, colours: NDArray, normals: NDArray,
    strands: NDArray, hairs: NDArray,
) -> Picture:  # fmt: skip
    """A picture of a mesh with linear colours (n, 3) under two soft lamps.

    hairs : (n,) number of the single hair that lies there, which is lighter or darker. Where
    `strands` (n, 3) are not 0, hair shines along them (Kajiya and Kay 1989, "Rendering Fur with
    Three Dimensional Textures").
    """
    buffers = rasterise(points, triangles, camera)
    v, u = np.nonzero(buffers.triangle >= 0)
    owner = buffers.triangle[v, u]
    weights = barycentric(points, triangles, camera, owner, u + 0.5, v + 0.5)

    def at_pixels(values: NDArray) -> NDArray:
        return np.einsum("kc,kcd->kd", weights, values[triangles[owner]])

    def unit(vectors: NDArray) -> NDArray:
        return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-9)

    normal, strand = unit(at_pixels(normals)), at_pixels(strands)
    is_hair = np.linalg.norm(strand, axis=1) > 0.5
    light, shine = np.full(len(normal), AMBIENT), np.zeros(len(normal))
    for direction, strength in LAMPS:
        toward = np.array(direction) / np.linalg.norm(direction)
        facing = np.clip(normal @ toward, 0, 1)
        light += strength * facing
        half = unit((toward + [0, 0, 1])[None])[0]
        across = np.sqrt(np.clip(1 - (unit(strand) @ half) ** 2, 0, 1))
        shine += strength * np.where(is_hair, across**NARROW, 0) * facing**0.5
    linear = at_pixels(colours)
    tones = np.random.default_rng(0).normal(0, STREAKS, 997)
    number = at_pixels(hairs[:, None])[:, 0]
    streak = np.interp(number % 996, np.arange(997), tones)
    linear = linear * np.exp(np.where(is_hair, streak, 0))[:, None]
    linear = linear * np.clip(light, 0, 1.1)[:, None]
    linear += GLOSS * shine[:, None] * (0.25 * at_pixels(colours) + 0.02)
    image = np.full((camera.height, camera.width, 3), float(PAPER))
    image[v, u] = 255 * srgb(np.clip(linear, 0, 1))
    blocks = image.reshape(camera.height // FINER, FINER, camera.width // FINER, FINER, 3)
    return np.clip(blocks.mean(axis=(1, 3)), 0, 255).astype(np.uint8)
