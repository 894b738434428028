"""Where the artist says that things are in the sketch: the head's box, and pins on landmarks.

Both are taken as they are given where they can be meant. A place off the page, a head of one pixel
or two pins that no face can have are refused in a sentence, before anything is drawn in their size.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from addon.drawing import Drawing
from facs_rig import LANDMARKS, Camera, FaceParameters, FaceRig
from facs_rig.common.box import Box
from facs_rig.common.errors import InputError
from snakes import HEAD, align, head_box
from snakes.alignment import HEADS

Places = Mapping[str, tuple[float, float]]

SMALLEST = 32  # px of the drawing: a head of fewer has no features left
ON_PAGE = 0.5  # of a head's box; the crown or the neck may be cut off
SLIMMEST = 3.0  # times as long as wide, or as wide as long
LEAST_INK = 2e-4  # share of the box, as of a page
FARTHEST = 0.5  # heads around the head that was found, where its pins may be
APART = 0.25  # heads between a pin and its place on the fitted face


def head_in(drawing: Drawing, text: Box | str | None) -> Box | None:
    """The part of `drawing.image` that 'left,top,right,bottom' names, in pixels of the picture
    that was handed in; None where the head is looked for.

    Raises InputError, one sentence, for a text that is no box or a box that holds no head.
    """
    if text is None:
        return None
    box = _box(drawing, text)
    left, top, right, bottom = box
    (height, width), (su, sv) = drawing.image.shape, drawing.scale
    wide, high = box.width, box.height
    said = f"{HEADS} '{text}'"
    if min(wide, high) < SMALLEST:
        raise InputError(
            f"{said} is too small: a face needs at least "
            f"{SMALLEST * su:.0f}×{SMALLEST * sv:.0f} pixels of this sketch."
        )
    across = max(min(right, width) - max(left, 0), 0)
    down = max(min(bottom, height) - max(top, 0), 0)
    if across / wide * (down / high) < ON_PAGE:
        raise InputError(
            f"{said} lies mostly outside the sketch, which has {drawing.size[0]}×"
            f"{drawing.size[1]} pixels."
        )
    if max(wide / high, high / wide) > SLIMMEST:
        raise InputError(
            f"{said} is no head's: it is {wide * su:.0f} pixels wide and {high * sv:.0f} high."
        )
    inside = drawing.image[
        int(max(top, 0)) : int(np.ceil(bottom)), int(max(left, 0)) : int(np.ceil(right))
    ]
    if float((inside < 0.5).mean()) < LEAST_INK:
        raise InputError(f"There is nothing drawn in the head's box '{text}'.")
    return box


def pins_in(drawing: Drawing, pins: Places) -> dict[str, tuple[float, float]]:
    """Pins in pixels of `drawing.image`; theirs are of the picture handed in."""
    places = {name: drawing.to_image(place) for name, place in pins.items()}
    return {name: (float(u), float(v)) for name, (u, v) in places.items()}


def camera_for(
    drawing: Drawing,
    rig: FaceRig,
    parameters: FaceParameters,
    box: Box | str | None,
    landmarks: Places,
    pins: Places,
) -> Camera:
    """The camera that lays a posed face over the drawn one: by the head's box where it is given,
    otherwise by the landmarks that were found, and by the pins.

    box, pins : in pixels of the picture that was handed in      landmarks : of `drawing.image`
    Raises InputError, one sentence, where no head can be.
    """
    pinned = pins_in(drawing, pins)
    if box is None:
        found = align(drawing.image, rig, parameters, landmarks)
    else:
        found = align(drawing.image, rig, parameters, box=_box(drawing, box))
    near = head_box(rig.pose(parameters), found) if pinned else None
    if near is None:
        return found
    _check_near(drawing, near, pinned)
    if box is not None:
        return found
    try:
        return align(drawing.image, rig, parameters, {**landmarks, **pinned})
    except InputError:
        raise apart(pins) from None


def check_pins(rig: FaceRig, vertices: NDArray, camera: Camera, pins: Places) -> None:
    """InputError if a fitted face (n, 3) could not bring its landmarks to their pins.

    pins : pixels of the camera
    """
    if not pins:
        return
    rows = rig.landmarks[[LANDMARKS.index(name) for name in pins]]
    there = camera.project(vertices[rows])[:, :2]
    off = np.linalg.norm(there - np.array(list(pins.values())), axis=1)
    if off.max() > APART * HEAD * camera.scale[0]:
        raise apart(pins)


def apart(pins: Places) -> InputError:
    """What to say where no face can have all its pins."""
    names = ", ".join([*pins][:4]) + (", …" if len(pins) > 4 else "")
    if len(pins) == 1:
        return InputError(
            f"No face of this sketch can have its {names} where it is pinned; move the pin, or "
            "say where in the picture the head is."
        )
    return InputError(
        f"No face can have all of {names} where they are pinned; move or take away those that "
        "are not in their place."
    )


def _check_near(drawing: Drawing, box: Box, pins: Places) -> None:
    """InputError if a pin is not on the page, or far from the head; pixels of the drawing."""
    height, width = drawing.image.shape
    left, top, right, bottom = box.grown(FARTHEST)
    for name, (u, v) in pins.items():
        at = "{:g},{:g}".format(*drawing.to_input((u, v)))
        if not (0 <= u <= width and 0 <= v <= height):
            raise InputError(
                f"The pin of {name} at {at} lies outside the sketch, which has "
                f"{drawing.size[0]}×{drawing.size[1]} pixels."
            )
        if not (left <= u <= right and top <= v <= bottom):
            raise InputError(
                f"The pin of {name} at {at} is far from the head that was found; move it, or say "
                "where in the picture the head is."
            )


def _box(drawing: Drawing, text: Box | str) -> Box:
    """The head's box in pixels of `drawing.image`."""
    box = Box.parse(text, HEADS) if isinstance(text, str) else text.checked(HEADS)
    left, top, right, bottom = box
    return Box.around(drawing.to_image([(left, top), (right, bottom)]))
