"""The picture of stylised people for docs/face.md."""

from __future__ import annotations

import numpy as np

from addon.sheet import KINDS, Picture, captioned, face_picture, grid
from facs_rig import Camera, FaceParameters, load_rig
from facs_rig.stylised import PRESETS

SIZE = 168  # pixels, a face's picture
NECK = 0.11  # metres below the head's joint where the pictures end
DOING: tuple[dict[str, float], ...] = (
    {},
    {"smile": 5.0, "outer_squint": 3.0},
    {"jaw_open": 6.0, "brow_furrow": 5.0, "sneer": 3.0},
    {"blink": 5.0},
)


def stylised_people() -> Picture:
    """Every preset at rest, smiling, shouting and with closed eyes; shaded, and drawn below."""
    rig = load_rig()
    blocks = []
    for preset in PRESETS:
        rest = rig.neutral(preset.identity)
        camera = Camera.framing(rest[rest[:, 1] > -NECK], SIZE, SIZE, 0.03)
        faces = [FaceParameters(aus, preset.identity) for aus in DOING]
        rows = [
            np.concatenate([face_picture(rig, face, camera, kind) for face in faces], axis=1)
            for kind in KINDS
        ]
        blocks.append(captioned(np.concatenate(rows), preset.label))
    return grid(blocks, 2, gap=12)
