"""The pictures of the heads of hair for docs/hair.md, and of drawings of them for dataset.md."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from addon.preview import paint
from addon.sheet import Picture, captioned, grid, seen_from
from dataset_gen.generate import make_sample
from facs_rig import Camera, FaceParameters, FaceRig, load_rig
from facs_rig.beard.mesh import beard_mesh
from facs_rig.beard.presets import PRESETS as BEARDS
from facs_rig.beard.presets import preset as beard_named
from facs_rig.hair.cut import Cut
from facs_rig.hair.mesh import hair_mesh
from facs_rig.hair.presets import PRESETS, preset

SIZE = 260  # pixels, a head's picture
VIEWS = (0.0, 40.0, 90.0, 180.0)  # degrees that the head is turned to its own left
PEOPLE: Mapping[str, Mapping[str, float]] = {
    "": {"gender": 0.2},
    "a child": {"age": -0.9},
    "comic": {"gender": 0.3, "eye_size": 1.9, "eye_opening": 1.7, "head_width": 1.2,
              "neck_girth": -1.8, "ear_size": 1.6, "nose_length": -0.6},
}  # fmt: skip
CHIN = np.array([[-0.115, -0.16, 0], [0.115, 0.05, 0]])
FRAME = np.array([[-0.17, -0.20, 0], [0.17, 0.20, 0]])  # metres that a picture shows


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


def drawn_hair(each: int = 2, seed: int = 0, columns: int = 6) -> Picture:
    """The first drawings of a data set that wear each preset, named, and how it is drawn."""
    found: dict[str, list[Picture]] = {name: [] for name in PRESETS}
    index = 0
    while min(map(len, found.values())) < each:
        drawing, record = make_sample(seed, index, hair=1.0)
        hair, index = record["hair"], index + 1
        if len(found[hair["preset"]]) < each:
            text = f"{hair['preset'].replace('_', ' ')}: {hair['finish']}"
            cell = np.repeat(drawing[:, :, None], 3, axis=2)
            found[hair["preset"]].append(captioned(cell, text, 15))
    return grid([cell for cells in found.values() for cell in cells], columns, gap=6)


def beards_of_all_kinds(size: int = SIZE) -> Picture:
    """Every preset of beards: from the front, in three quarters, and smiling with an open jaw."""
    rig, who = load_rig(), {"gender": 1.0}
    rest = rig.neutral(who)
    laughing = rig.pose(FaceParameters(aus={"smile": 4.0, "jaw_open": 4.0}, identity=who))
    camera = Camera.framing(CHIN, size, size, 0.0)
    blocks = []
    for name in BEARDS:
        beard = beard_mesh(rig, who, beard_named(name), detail=1.0)
        seen = [(rest, 0.0), (rest, 40.0), (laughing, 20.0)]
        row = [paint(rig, seen_from(face, yaw), camera, who, beard=beard) for face, yaw in seen]
        blocks.append(captioned(np.concatenate(row, axis=1), name.replace("_", " ")))
    return grid(blocks, 2, gap=8)


def picture(
    rig: FaceRig, identity: Mapping[str, float], cut: Cut, yaw: float, size: int
) -> Picture:
    """(size, w, 3) a person with a cut, turned by `yaw` degrees to its own left."""
    camera = Camera.framing(FRAME, round(0.85 * size), size, 0.0)
    hair = hair_mesh(rig, identity, cut, detail=1.0)
    return paint(rig, seen_from(rig.neutral(identity), yaw), camera, dict(identity), hair)
