"""What a drawing shows, as it is told: to the fit, to commands and to somebody who reads it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .finding import Face
from .mask import Mask
from .mouth import Mouth
from .plausible import HIDDEN, NO_NOSE

ANGLES = ("yaw", "pitch", "roll")
CLOSE = 0.02  # of the face's height: what counts as found
# For somebody whose drawing lies, by degrees clockwise that it was turned.
LAY = {
    90: "The drawing lies on its side: it was turned by 90° clockwise to be read.",
    180: "The drawing is upside down: it was turned by 180° to be read.",
    270: "The drawing lies on its side: it was turned by 90° anticlockwise to be read.",
}
# For somebody whose drawing shows no face, by what was found instead.
NONE_FOUND = (
    "No face was found in {name}; crop the picture to one drawn face, seen from the front or in "
    "three-quarter view, or say where in the picture the head is."
)
WHY = {
    NO_NOSE: "What is drawn in {name} has no nose, so it is taken for a sign such as a smiley, not "
    "for a face; draw the nose, or say where in the picture the head is.",
    HIDDEN: "Too little of a face is seen in {name}; draw it from the front or in three-quarter "
    "view (a profile hides half of it), or say where in the picture the head is.",
}
# For somebody who has several faces on the page.
OTHERS = "{} drawn on the page; the largest was read, crop the picture to read another."


@dataclass(frozen=True)
class Detection:
    """What a drawing shows. Mappings go by the names of controls, or of landmarks.

    probabilities : how probable it is that each control is active, calibrated, 0..1
    active : probability above the control's own threshold, after the rules of `conflicts`
    intensities : 0 if not active, else 1..5        head : yaw, pitch, roll in radians
    landmarks : name -> (u, v) pixels of the drawing; off the page if the face is cut off
    confidences : how probable it is that each landmark is within 2% of the face's height, 0..1
    faces : the face that was read and the others on the page, largest first; none if it is none
    face_probability : that there is a face, as the networks believe
    person : parameter of identity -> what the networks believe it is, and how far off that may be
    (standard deviation)
    turn : quarter turns anticlockwise, 0..3, by which the drawing was turned to be read; all pixels
    here are those of the turned one
    mask : where on the drawing face, hair and beard are, of networks that tell
    mouth : what a closer look at it says, of networks that take one
    trouble : one of `plausible`, why nothing can be read; empty if a face was found. Without one
    nothing is active
    """

    probabilities: dict[str, float]
    active: dict[str, bool]
    intensities: dict[str, float]
    head: tuple[float, float, float]
    landmarks: dict[str, tuple[float, float]]
    confidences: dict[str, float]
    faces: tuple[Face, ...]
    face_probability: float
    turn: int = 0
    trouble: str = ""
    person: dict[str, tuple[float, float]] = field(default_factory=dict)
    mask: Mask | None = field(default=None, compare=False)
    mouth: Mouth | None = field(default=None, compare=False)

    @property
    def clockwise(self) -> int:
        """Degrees clockwise by which the drawing was turned to be read: 0, 90, 180 or 270."""
        return (-90 * self.turn) % 360

    def how_it_lay(self) -> str:
        """One sentence about a drawing that was turned to be read; empty if it was not."""
        return LAY.get(self.clockwise, "")

    def no_face(self, name: str = "the drawing") -> str:
        """One sentence: why no face was read in `name`, and what to do; empty if one was."""
        return WHY.get(self.trouble, NONE_FOUND).format(name=name) if self.trouble else ""

    def expression(self) -> dict[str, float]:
        """The active controls at their intensity, ready for `FaceParameters(aus=...)`."""
        return {name: self.intensities[name] for name, active in self.active.items() if active}

    def left_out(self) -> str:
        """One sentence about the other faces on the page; empty if there are none."""
        others = len(self.faces) - 1
        if others < 1:
            return ""
        return OTHERS.format("Another face is" if others == 1 else f"{others} other faces are")

    def to_json(self) -> dict[str, Any]:
        """The expression and the head's angles in degrees, as commands and reports write them."""
        angles = np.degrees(self.head)
        return {
            "aus": {
                name: {
                    "probability": round(float(probability), 4),
                    "active": bool(self.active[name]),
                    "intensity": round(float(self.intensities[name]), 3),
                }
                for name, probability in self.probabilities.items()
            },
            "head": {n: round(float(a), 2) for n, a in zip(ANGLES, angles, strict=True)},
        } | self._person_to_json()

    def _person_to_json(self) -> dict[str, Any]:
        """Who is drawn, of networks that tell."""
        told = {
            name: {"value": round(value, 3), "spread": round(spread, 3)}
            for name, (value, spread) in self.person.items()
        }
        return {"person": told} if told else {}

    def faces_to_json(self, matrix: NDArray) -> list[dict[str, Any]]:
        """The faces with their boxes, left, top, right, bottom.

        matrix : (3, 3) from the pixels (u, v, 1) of this detection to those of the boxes; scaling,
        quarter turns and shifts
        """
        said = []
        for face in self.faces:
            corners = np.reshape(face.corners, (2, 2)) @ matrix[:2, :2].T + matrix[:2, 2]
            box = np.concatenate([corners.min(axis=0), corners.max(axis=0)])
            said.append({"box": box.round(2).tolist(), "probability": round(face.probability, 4)})
        return said
