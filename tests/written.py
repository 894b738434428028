"""The vertices of a written file in the order in which the face has them."""

from __future__ import annotations

from pathlib import Path

import numpy as np


def points_of(path: Path) -> np.ndarray:
    """(n, 3) vertices of an .obj, .ply or .glb.

    Readers cut the surface of an .obj apart where its texture has a seam, so that its lines are
    read here.
    """
    if path.suffix == ".obj":
        lines = (line.split() for line in path.read_text(encoding="utf-8").splitlines())
        return np.array([words[1:4] for words in lines if words[:1] == ["v"]], dtype=float)
    import trimesh

    mesh = trimesh.load(path, process=False, force="mesh", maintain_order=True)
    return np.asarray(mesh.vertices)
