"""The sliders of Blender's face: properties, and the shape keys that follow them.

Each control is a property of the mesh object (0 to 10), beside where the eyes look and two figures
of the identity. A driver on each key computes its value from these properties with the rig's own
expression, so that properties can be keyframed, driven and seen in the Graph Editor.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from functools import lru_cache

import bpy
import numpy as np
from numpy.typing import NDArray

from facs_rig.blender.armature import drive, to_blender
from facs_rig.blender.arrays import BULK, write_key, write_places
from facs_rig.blender.steps import Steps
from facs_rig.controls import ARKIT_NAMES, CONTROL_NAMES, CONTROLS, FULL_INTENSITY, MAX_INTENSITY
from facs_rig.fitted_keys import FITTED, FITTED_REGIONS, FittedKey, offsets_at
from facs_rig.identity import IDENTITY_KEYS
from facs_rig.keys import LONGEST, PROPERTIES, abbreviated
from facs_rig.parameters import FaceParameters
from facs_rig.rig import FaceRig

BASIS = "Basis"
GAZE = ("gaze_yaw", "gaze_pitch")
WIDEST = 10.0  # the largest value that Blender lets a shape key have

# name -> (least, most, where a slider begins and ends, tooltip)
_OTHERS = {
    "gaze_yaw": (-60.0, 60.0, -35.0, 35.0, "Both eyes to the face's own left, degrees"),
    "gaze_pitch": (-60.0, 60.0, -35.0, 35.0, "Both eyes down, degrees"),
    "crease_gain": (0.0, 4.0, 0.0, 3.0, "How deep the creases of the expression are"),
    "lid_rest": (-2.0, 2.0, -1.0, 1.0, "How far this person's lids are closed at rest"),
}


def add_properties(face: bpy.types.Object, rig: FaceRig, parameters: FaceParameters) -> None:
    """Give the mesh object its sliders, set to `parameters`."""
    yaw, pitch = np.degrees(parameters.gaze)
    values = {"gaze_yaw": yaw, "gaze_pitch": pitch, **rig.scalars(parameters.identity)}
    for control in CONTROLS:
        _property(face, control.name, parameters.aus.get(control.name, 0.0), 0.0,
                  (0.0, MAX_INTENSITY, 0.0, MAX_INTENSITY), _tooltip(control))  # fmt: skip
    for name in PROPERTIES:
        *limits, text = _OTHERS[name]
        default = 1.0 if name == "crease_gain" else 0.0
        _property(face, name, values[name], default, limits, text)


def _tooltip(control) -> str:
    text = control.signature[:1].upper() + control.signature[1:]
    return f"{text} (AU {', '.join(control.aus)}, {control.muscle}); 5 is fully natural"


def _property(face, name: str, value: float, default: float, limits, description: str) -> None:
    face[name] = float(value)
    least, most, first, last = limits
    face.id_properties_ui(name).update(
        min=least, max=most, soft_min=first, soft_max=last, step=10.0, precision=2,
        default=default, description=description,
    )  # fmt: skip
    face.property_overridable_library_set(f'["{name}"]', True)  # or an override forgets it


def add_keys(
    face: bpy.types.Object,
    rig: FaceRig,
    neutral: NDArray[np.float32],
    identity: Mapping[str, float],
    offsets: NDArray | None,
    fitted: Sequence[FittedKey],
    *,
    identity_keys: bool,
    arkit: bool,
) -> Steps[None]:
    """All shape keys, in this order: Basis, rig.keys, the identity's, ARKit's, the fitted ones.

    Pauses after each. The drivers come last, as long as nothing evaluates them.
    neutral : (n, 3) metres, Blender's axes
    offsets, fitted : (n, 3) metres, core axes, and what of them goes with actions
    identity : whose keys the rig's are
    """
    face.shape_key_add(name=BASIS, from_mix=False)
    face.data.shape_keys.name = face.data.name
    yield
    moves = rig.key_deltas_of(identity)
    yield
    for key, delta in zip(rig.keys, moves, strict=True):
        block = add_key(face, key.name, moved(neutral, delta), -WIDEST, WIDEST)
        if key.name in CONTROL_NAMES:
            block.slider_min, block.slider_max = 0.0, MAX_INTENSITY / FULL_INTENSITY
        yield
    if identity_keys:
        for name, delta in zip(IDENTITY_KEYS, rig.identity_deltas, strict=True):
            add_key(face, name, moved(neutral, delta), -WIDEST, WIDEST)
            yield
    if arkit:
        for name, delta in zip(ARKIT_NAMES, rig.arkit_deltas_of(identity), strict=True):
            add_key(face, name, moved(neutral, delta), 0.0, 1.0)
            yield
    if offsets is not None:
        add_fitted(face, neutral, offsets, fitted)
        yield
    write_places(face.data, neutral)
    for key in rig.keys:
        _drive_key(face, key.name, key.expression)
        yield
    for shown in fitted:
        _drive_key(face, shown.name, shown.expression)
        yield


def moved(points: NDArray[np.float32], deltas: NDArray) -> NDArray[np.float32]:
    """Points (n, 3) in Blender's axes moved by deltas (n, 3) in core axes."""
    return points + to_blender(deltas)


def add_fitted(
    face: bpy.types.Object,
    neutral: NDArray[np.float32],
    offsets: NDArray,
    fitted: Sequence[FittedKey],
) -> None:
    """The key of what the fitted offsets have at rest, fully on, and those that go with actions,
    which nothing drives yet."""
    add_key(face, FITTED, moved(neutral, offsets_at(offsets, fitted, {})), 0.0, 2.0).value = 1.0
    for key in fitted:
        add_key(face, key.name, moved(neutral, key.offsets), 0.0, 2.0)


def replace_fitted(
    face: bpy.types.Object, neutral: NDArray[np.float32], fitted: Sequence[FittedKey]
) -> None:
    """Other keys that go with actions, with their drivers, in the place of those that it has."""
    keys = face.data.shape_keys
    for name in FITTED_REGIONS.values():
        if name in keys.key_blocks:
            keys.driver_remove(f'key_blocks["{name}"].value')
            for part in [part for part in face.keys() if part.startswith(f"{name}_part_")]:
                face.driver_remove(f'["{part}"]')
                del face[part]
            face.shape_key_remove(keys.key_blocks[name])
    for key in fitted:
        add_key(face, key.name, moved(neutral, key.offsets), 0.0, 2.0)
    write_places(face.data, neutral)  # see `add_key`
    for key in fitted:
        _drive_key(face, key.name, key.expression)


def add_key(
    face: bpy.types.Object, name: str, points: NDArray[np.float32], least: float, most: float
) -> bpy.types.ShapeKey:
    """A shape key (n, 3) at rest, and where its slider ends. RuntimeError if the name is taken.

    A new key is a copy of the mesh's own vertices. Before 4.1 these are written ten times as
    quickly as a key is, so that the key is made of them there; `add_keys` puts them back.
    """
    if not BULK:
        write_places(face.data, points)
    block = face.shape_key_add(name=name, from_mix=False)
    if block.name != name:
        raise RuntimeError(f"Blender calls the shape key '{name}' '{block.name}'")
    if BULK:
        write_key(block, points)
    block.slider_min, block.slider_max = least, most
    block.value = 0.0  # from Blender 5.0 keys begin at 1
    return block


def _drive_key(face: bpy.types.Object, name: str, expression: str) -> None:
    """Drive a key by its expression over the face's properties and earlier keys.

    Parts of long expressions are properties of the face, not of the keys: Blender's glTF exporter
    writes the values of driven keys only while nothing but shape keys is driven there.
    """
    keys = face.data.shape_keys
    *parts, whole = driver_texts(name, expression)
    cut = {part for part, *_ in parts}

    def drive_by(fcurve: bpy.types.FCurve, text: str, names: tuple[tuple[str, str], ...]) -> None:
        drive(fcurve, text, {short: source(long) for short, long in names})

    def source(variable: str) -> tuple[bpy.types.ID, str]:
        if variable in CONTROL_NAMES or variable in PROPERTIES or variable in cut:
            return face, f'["{variable}"]'
        return keys, f'key_blocks["{variable}"].value'

    for part, text, names in parts:
        face[part] = 0.0
        drive_by(face.driver_add(f'["{part}"]'), text, names)
    _, text, names = whole
    drive_by(keys.key_blocks[name].driver_add("value"), text, names)


@lru_cache(maxsize=512)
def driver_texts(
    name: str, expression: str
) -> tuple[tuple[str, str, tuple[tuple[str, str], ...]], ...]:
    """`in_parts` as drivers have it: (name, text with short names, (short, long) names) each."""
    out = []
    for part, text in in_parts(name, expression):
        short, names = abbreviated(text)
        out.append((part, short, tuple(names.items())))
    return tuple(out)


def in_parts(name: str, expression: str) -> list[tuple[str, str]]:
    """An expression as (name, expression) pairs that are short enough for drivers, itself last.

    A driver has room for LONGEST characters. The longest sum in a longer expression is cut in
    two, and its first half becomes a variable `name_part_1` and so on. Raises RuntimeError if the
    expression is long for another reason.
    """
    parts: list[tuple[str, str]] = []
    while len(abbreviated(expression)[0]) > LONGEST:
        tree = ast.parse(expression, mode="eval")
        sums = [node for node in ast.walk(tree) if isinstance(node, ast.BinOp) and _is_sum(node)]
        longest = max(sums, key=lambda node: len(_terms(node)), default=None)
        if longest is None or len(terms := _terms(longest)) < 3:
            raise RuntimeError(f"the expression of '{name}' is too long for Blender")
        part = f"{name}_part_{len(parts) + 1}"
        half = len(terms) // 2
        parts += in_parts(part, _text(_sum_of(terms[:half])))
        rest = _sum_of(terms[half:])
        longest.left, longest.op, longest.right = ast.Name(part, ast.Load()), ast.Add(), rest
        expression = _text(tree)
    return [*parts, (name, expression)]


def _is_sum(node: ast.AST) -> bool:
    return isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub)


def _terms(node: ast.expr) -> list[ast.expr]:
    """The terms of a sum; those that are subtracted with their sign."""
    if not isinstance(node, ast.BinOp) or not _is_sum(node):
        return [node]
    right: ast.expr = node.right
    if isinstance(node.op, ast.Sub):
        right = ast.UnaryOp(ast.USub(), right)
    return [*_terms(node.left), right]


def _sum_of(terms: list[ast.expr]) -> ast.expr:
    total = terms[0]
    for term in terms[1:]:
        if isinstance(term, ast.UnaryOp) and isinstance(term.op, ast.USub):
            total = ast.BinOp(total, ast.Sub(), term.operand)
        else:
            total = ast.BinOp(total, ast.Add(), term)
    return total


def _text(tree: ast.AST) -> str:
    return ast.unparse(tree).replace(" ", "")
