"""How hair looks in pictures: strands that shine across, each a little lighter or darker."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from facs_rig.beard.mesh import BeardMesh
from facs_rig.hair.mesh import HairMesh, strands

GLOSS, NARROW = 0.9, 40.0  # strength of the strands' highlight, and how narrow it is
STREAKS = 0.16  # how much lighter or darker single hairs are
TONES = 997  # different hairs


def hair_light(
    mesh: HairMesh | BeardMesh,
    points: NDArray,
    normals: NDArray,
    at_pixels: Callable[[NDArray], NDArray],
    lamps: tuple[tuple[tuple[float, float, float], float], ...],
    ambient: float,
) -> NDArray[np.float64]:
    """(k, 3) linear colours of pixels that show hair (Kajiya and Kay 1989, "Rendering Fur with
    Three Dimensional Textures").

    points : (n, 3) the mesh's, as it is seen      normals : (k, 3) unit, of the pixels
    at_pixels : values (n, c) of the mesh's points -> (k, c) of the pixels
    """
    strand = at_pixels(strands(points, mesh.quads, mesh.uv))
    strand /= np.maximum(np.linalg.norm(strand, axis=1, keepdims=True), 1e-9)
    facing_us = np.where(normals[:, 2:] < 0, -1.0, 1.0)  # ribbons have no back
    light, shine = np.full(len(normals), ambient), np.zeros(len(normals))
    for direction, strength in lamps:
        toward = np.array(direction) / np.linalg.norm(direction)
        facing = np.clip((normals * facing_us) @ toward, 0, 1)
        light += strength * facing
        half = toward + (0, 0, 1)
        across = 1 - (strand @ (half / np.linalg.norm(half))) ** 2
        shine += strength * np.clip(across, 0, 1) ** (NARROW / 2) * np.sqrt(facing)
    tones = np.random.default_rng(0).normal(0, STREAKS, TONES)
    number = at_pixels(mesh.grain[:, None])[:, 0]
    streak = np.exp(np.interp(number % (TONES - 1), np.arange(TONES), tones))
    shade = at_pixels(mesh.shade[:, None]) * np.array(mesh.colour)
    linear = shade * (streak * np.clip(light, 0, 1.1))[:, None]
    return linear + GLOSS * shine[:, None] * (0.25 * shade + 0.02)
