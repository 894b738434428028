"""What moves the baked head: its controls' own movements, lids, lips, jaw, and creases, as keys."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..controls import CONTROLS, WHOLE, Control
from ..keys import Key
from ..mesh import vertex_normals
from .corners import stiffen_corners
from .creases import Skin, default_creases, rest_folds, single_grooves, skin_of
from .eyes import lids_of_controls
from .lids import lid_deltas, lid_keys
from .lips import Mouth, lip_keys
from .makehuman import JOINTS, Source
from .mesh import Mesh
from .mouth import Frames, Jaw, stiffen, turn_skin
from .strands import Hairs, carry_hairs
from .variants import Variant


def read_controls(source: Source, mouth: Mouth) -> NDArray[np.float64]:
    """(47, M, 3) metres that each control's mix moves the cage at intensity 5."""
    return np.stack([source.mixed(control.mix, mouth.masks) for control in CONTROLS])


def move_mouth(
    moves: NDArray,
    opening: NDArray,
    wide: NDArray,
    source: Source,
    cage: NDArray,
    frames: Frames,
    jaw: Jaw,
) -> None:
    """Give displacements (k, M, 3) of the cage the mouth's parts, the jaw's hinge and sound corners
    of the mouth, in place; opening : see `stiffen`;  wide : see `stiffen_corners`."""
    m = source.size
    stiffen(moves, opening, source, frames, jaw)
    turn_skin(moves[:, :m], opening, cage, jaw)
    shut = opening == 0
    lips = moves[shut, :m]
    stiffen_corners(lips, cage, source.is_part("skin"), wide[shut])
    moves[shut, :m] = lips


def opening_of(controls: Sequence[Control]) -> NDArray[np.float64]:
    """(k,) how far controls open the jaw at intensity 5, in ARKit's jawOpen."""
    return np.array([
        sum(weight / (2 if "|" in entry else 1)
            for entry, weight in control.mix if entry.partition("|")[0] == "arkit/jawOpen")
        for control in controls
    ])  # fmt: skip


def expression(
    source: Source,
    plain: NDArray,
    mesh: Mesh,
    controls: NDArray,
    fields: dict,
    mouth: Mouth,
) -> tuple[list[Key], NDArray, NDArray]:
    """Keys of controls, lids and lips, what they move the cage by (keys, M, 3), and the cage of
    each control alone at intensity 5 (47, m, 3). Takes the lids out of `controls`, in place."""
    m = source.size
    keys = [Key(c.name, f"{c.name}*0.2") for c in CONTROLS]
    skin = mesh.matrix[mesh.skin]
    shares = {side: lids_of_controls(side, controls, skin, plain, field)
              for side, field in fields.items()}  # fmt: skip
    for field in fields.values():
        controls[:, :m] *= 1 - field.rim[:, None]
    active = plain[:m] + controls[:, :m]
    moves = [controls[:, :m]]
    for side, field in fields.items():
        upper, lower = shares[side]
        deltas = lid_deltas(plain[:m], field)
        moves.append(deltas)
        keys += lid_keys(side, upper, lower)
        for k, control in enumerate(CONTROLS):
            active[k] += lower.get(control.name, 0.0) * deltas[0]
            active[k] += upper.get(control.name, 0.0) * deltas[1]
    keys += lip_keys(controls[:, :m], mouth)
    moves.append(mouth.apart)
    joints = ((0, 0), (0, len(plain) - m), (0, 0))
    return keys, np.pad(np.concatenate(moves), joints), active


@dataclass(frozen=True)
class Creased:
    """keys of the creases and their displacements (keys, n, 3); people's variants of them; what an
    old face has at rest, name -> (n, 3)"""

    keys: list[Key]
    moves: NDArray[np.float64]
    variants: list[Variant]
    rest: dict[str, NDArray[np.float64]]


def raise_creases(
    plain: NDArray, m: int, mesh: Mesh, active: NDArray, hairs: tuple[Hairs, ...], mirror: NDArray
) -> Creased:
    """The creases, hairs carried along. active : (47, m, 3) the cage of each control at intensity 5

    Both sides of a control are creased on the face of the symmetric one, so that they add up to it,
    and the right is the left's mirror image: what is kept of them is the left.
    """
    triangles = mesh.triangles
    origin = plain[m + JOINTS.index("head")]
    eyes_middle = plain[m + 2 : m + 4].mean(axis=0) - origin

    def skin_on(cage: NDArray) -> Skin:
        face = mesh.matrix @ cage - origin
        return skin_of(face, vertex_normals(face, triangles), triangles, mesh.skin, eyes_middle)

    def carried(groove: NDArray) -> NDArray:
        carry_hairs(groove, hairs)
        return groove

    def mirrored(groove: NDArray) -> NDArray:
        return groove[mirror] * [-1, 1, 1]

    keys: list[Key] = []
    moves: dict[str, NDArray] = {}
    variants: list[Variant] = []
    for control, whole in zip(CONTROLS, WHOLE, strict=True):
        if not control.creases:
            continue
        key = Key(f"{control.name}_creases", f"{control.name}*0.2*crease_gain")
        keys.append(key)
        if control is not CONTROLS[whole]:
            stem = f"{CONTROLS[whole].name}_creases"
            half = [v for v in variants if v.parent == stem and v.name.endswith(control.side)]
            variants += [replace(v, parent=key.name) for v in half]
            moves[key.name] = moves[f"{stem} {control.side}"]
            continue
        skin = skin_on(active[whole])
        left = carried(default_creases(control, skin))
        sides = {"left": left, "right": mirrored(left)}
        moves |= {key.name: left + sides["right"]}
        moves |= {f"{key.name} {side}": move for side, move in sides.items()}
        for name, groove in single_grooves(control, skin):
            own = carried(groove)
            variants += [
                Variant(f"{name} {side}", key.name, own, mirrored=side == "right") for side in sides
            ]
    rest: dict[str, NDArray] = {}
    for name, fold in rest_folds(skin_on(plain[:m])).items():
        own = carried(fold)
        rest |= {f"rest {name} left": own, f"rest {name} right": mirrored(own)}
    return Creased(keys, np.stack([moves[key.name] for key in keys]), variants, rest)
