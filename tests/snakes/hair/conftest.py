"""A head with hair from a preset: where it lies, how it is drawn, and what a network says of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import pytest
from scipy import ndimage

from facs_rig import Camera, FaceParameters, load_rig, rasterise
from facs_rig.hair.follow import bind
from facs_rig.hair.presets import preset
from facs_rig.hair.shell import shell
from snakes.lines import HEAD

CELLS = 24  # to a head, as coarse as a network's


@dataclass(frozen=True, eq=False)
class Scene:
    """A posed face in front of a camera, and (h, w) bool where hair and head are on its page."""

    parameters: FaceParameters
    vertices: np.ndarray
    camera: Camera
    hair: np.ndarray
    head: np.ndarray

    @property
    def unit(self) -> float:
        return HEAD * self.camera.scale[0]

    def at(self, hair: np.ndarray | None = None):
        """What a network says that sees hair (h, w) bool, or this scene's, in coarse cells."""
        hair = self.hair if hair is None else hair
        soft = ndimage.gaussian_filter(hair.astype(float), 0.7 * self.unit / CELLS)

        def asked(region, points):
            if region != "hair":
                return np.full(len(points), 0.01)
            rows = np.clip(points[:, ::-1].T - 0.5, 0, np.array(soft.shape)[:, None] - 1)
            return ndimage.map_coordinates(soft, rows, order=1)

        return asked

    def drawn(self, how: str) -> np.ndarray:
        """(h, w) the page: lines around head and hair, the hair filled or not."""
        ink = outline(self.head, 1) | outline(self.hair, 2)
        return 1.0 - np.maximum(ink, self.hair if how == "black" else 0)


def outline(mask: np.ndarray, wide: int) -> np.ndarray:
    return mask & ~ndimage.binary_erosion(mask, iterations=wide, border_value=1)


def seen(cut, parameters, camera, vertices=None):
    """(h, w) bool twice: hair of a cut as a camera sees it, and the head without it."""
    rig = load_rig()
    vertices = rig.pose(parameters) if vertices is None else vertices
    head = rasterise(vertices, rig.triangles, camera).triangle >= 0
    if cut is None:
        return np.zeros_like(head), head
    mesh = shell(rig, parameters.identity, cut)
    points = bind(mesh.points, rig, parameters.identity).points(vertices)
    triangles = np.concatenate([rig.triangles, mesh.triangles + len(vertices)])
    buffers = rasterise(np.concatenate([vertices, points]), triangles, camera)
    return buffers.triangle >= len(rig.triangles), head


def overlap(a, b):
    return (a & b).sum() / max((a | b).sum(), 1)


@lru_cache
def scene(name: str | None, yaw: float = 0.0) -> Scene:
    """yaw : degrees"""
    rig = load_rig()
    parameters = FaceParameters(identity={"gender": 0.3}, head=(float(np.radians(yaw)), 0.0, 0.0))
    vertices = rig.pose(parameters)
    height, width = 330, 300
    camera = Camera.framing(vertices, width, height, margin=0.2)
    camera = replace(camera, centre=(camera.centre[0], camera.centre[1] - 10))
    hair, head = seen(preset(name) if name else None, parameters, camera, vertices)
    return Scene(parameters, vertices, camera, hair, head)


@pytest.fixture(scope="session")
def hairy():
    """scene(preset or None, degrees of yaw), and as attributes seen(), overlap() and outline()."""
    scene.seen, scene.overlap, scene.outline = seen, overlap, outline
    return scene
