"""How a person does things: parameters that choose among the variants of the actions.

Each action can be done in three other ways, to each side of the mean (facs_rig.baking.actions makes
them): between the two sculpts there are of it, with skin that follows more here and less there, and
more on one side of the face than on the other. What lies together in a face is moved by the same
flesh, so that a person has three parameters for each group of actions and not for each action.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .controls import CONTROL_NAMES, WHOLE

WAYS = {1: "shape", 2: "pull", 3: "lopsided"}  # number -> what differs

# Group -> its label and its actions; those share the parameters `{group}_action_1` and on.
GROUPS: dict[str, tuple[str, tuple[str, ...]]] = {
    "brow": ("Brow actions", ("frontalis", "medialis_frontalis", "outer_frontalis", "brow_furrow")),
    "eye": ("Eye actions", ("lid_raise", "squint", "outer_squint")),
    "nose": ("Nose actions", ("wince", "sneer", "nasolabial_deepen", "nostril_flare",
                              "nostril_compress")),
    "cheek": ("Cheek actions", ("cheek_puff", "cheek_suck")),
    "smile": ("Smile", ("smile",)),
    "corner": ("Mouth corner actions", ("frown", "grimace", "pucker")),
    "lip": ("Lip actions", ("lower_lip_depress", "shrug", "purse", "lip_loosen", "lip_loosen_upper",
                            "lip_loosen_lower", "lip_lock", "lip_lock_upper", "lip_lock_lower",
                            "lip_tighten", "lip_tighten_upper", "lip_tighten_lower")),
    "jaw": ("Jaw actions", ("jaw_open", "jaw_left", "jaw_right", "jaw_forward")),
}  # fmt: skip
GROUP_OF = {action: group for group, (_, actions) in GROUPS.items() for action in actions}
# Parameter -> its label.
TABLE = {
    f"{group}_action_{way}": f"{label}: {what}"
    for group, (label, _) in GROUPS.items()
    for way, what in WAYS.items()
}
SPREAD = 0.5  # of a parameter, where people are drawn by lot


def variant_name(control: str, way: int) -> str:
    """What the variant of a control is called that leads one of the WAYS."""
    return f"{control}_way_{way}"


# Parameter -> the variants that it brings.
_VARIANTS = {
    f"{group}_action_{way}": tuple(
        variant_name(name, way)
        for name, whole in zip(CONTROL_NAMES, WHOLE, strict=True)
        if GROUP_OF.get(CONTROL_NAMES[whole]) == group
    )
    for group in GROUPS
    for way in WAYS
}


def action_weights(identity: Mapping[str, float]) -> dict[str, float]:
    """How much of each variant a person has, by its name; those that are not named: nothing."""
    return {
        variant: float(identity[name])
        for name, variants in _VARIANTS.items()
        if identity.get(name)
        for variant in variants
    }


def drawn_actions(rng: np.random.Generator) -> dict[str, float]:
    """Identity parameters of somebody's ways to do things, some near the mean and some far off."""
    spread = SPREAD * rng.uniform(0.4, 1.4)
    values = np.clip(rng.normal(0, spread, len(TABLE)), -1, 1)
    return {name: round(float(value), 3) for name, value in zip(TABLE, values, strict=True)}
