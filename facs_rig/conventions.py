"""What other rigs call the face's actions: for each convention its keys, made of our controls.

One table, CONVENTIONS: a key's value is the sum of its controls, each at intensity / 5 times its
weight, within 0 to 1 (see facs_rig.retarget). Weights are never negative, so that more of an
action is never less of a key. What no control moves (where the eyes look, the tongue) is not in it.

- ARKit's 52 (VRM's "perfect sync" and MPFB2's face units have the same names): taken from the
  controls' own mixes in facs_rig.controls; MakeHuman's units in these are put into ARKit's words.
- MetaHuman: the curves of Epic's Facial Description Standard, by the action units they stand for.
- VRM 1.0 and 0.x: the presets of the specifications, which are whole expressions and vowels, so
  that only the gist comes through; VRoid Studio's `Fcl_` keys, which are a little finer.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from .controls import ARKIT_NAMES, CONTROL_NAMES, CONTROLS

Keys = Mapping[str, Mapping[str, float]]
SIDES = {"left": "L", "right": "R"}


@dataclass(frozen=True)
class Convention:
    """One way to name a face's shape keys.

    keys : name -> control -> weight      prefix : of all names, which a mesh may leave out
    """

    name: str
    label: str
    keys: Keys
    prefix: str = ""


def _sided(table: Keys) -> dict[str, dict[str, float]]:
    """A table with `{S}` in its names written out for L and R.

    A key of one side follows the action of both sides and its own side's version; a key of both
    follows each one-sided version by half.
    """
    out: dict[str, dict[str, float]] = {}
    for template, actions in table.items():
        for side, letter in SIDES.items() if "{S}" in template else (("", ""),):
            weights = out.setdefault(template.format(S=letter), {})
            for action, weight in actions.items():
                weights[action] = weight
                for part in (side,) if side else SIDES:
                    if f"{action}_{part}" in CONTROL_NAMES:
                        weights[f"{action}_{part}"] = weight if side else weight / 2
    return out


# --- ARKit ----------------------------------------------------------------------------------------

# What MakeHuman's units are in ARKit's words, both sides of a unit together. The weights are those
# of the least squares over the shipped head, rounded; but a smile counts as one, though ARKit's is
# twice as wide there. Flared and narrowed nostrils and the neck have no word.
_UNITS: Keys = {
    "eyebrows-{side}-up": {"browOuterUp{Side}": 0.4, "browInnerUp": 0.5},
    "eyebrows-{side}-inner-up": {"browInnerUp": 0.6},
    "eyebrows-{side}-extern-up": {"browOuterUp{Side}": 0.8},
    "eyebrows-{side}-down": {"browDown{Side}": 0.3},
    "close-{side}": {"eyeBlink{Side}": 1.0},
    "eye-{side}-slit": {"eyeSquint{Side}": 0.4},
    "nose-{side}-elevation": {"noseSneer{Side}": 0.3},
    "mouth-corner-puller": {"mouthSmile{Side}": 0.75},
    "mouth-upward-retraction": {"mouthUpperUp{Side}": 0.4},
}


def _in_arkit(blendshape: str) -> dict[str, float]:
    """ARKit's keys for one part of a control's mix (see facs_rig.controls), with their shares."""
    folder, _, name = blendshape.partition("/")
    name, _, half_side = name.partition("|")
    name, _, half_lips = name.partition("^")
    if folder == "arkit":
        return {name: (0.5 if half_side else 1.0) * (0.5 if half_lips else 1.0)}
    side = half_side or next((s for s in SIDES if f"-{s}" in name), "")
    words = _UNITS.get(name.replace(f"-{side}", "-{side}") if side else name, {})
    # A key without a side is moved by the left and the right unit together.
    return {key.format(Side=side.capitalize()): share if "{" in key else share / 2
            for key, share in words.items()}  # fmt: skip


def _arkit() -> dict[str, dict[str, float]]:
    sums: dict[str, dict[str, float]] = {}
    for control in CONTROLS:
        if min(weight for _, weight in control.mix) < 0:
            continue  # sucked cheeks are puffed ones backwards, which no key from 0 to 1 can say
        for blendshape, weight in control.mix:
            for key, share in _in_arkit(blendshape).items():
                weights = sums.setdefault(key, {})
                weights[control.name] = round(weights.get(control.name, 0) + weight * share, 3)
    return {key: sums[key] for key in ARKIT_NAMES if key in sums}


# --- MetaHuman ------------------------------------------------------------------------------------

_METAHUMAN_PREFIX = "CTRL_expressions_"
_METAHUMAN: Keys = {
    "browDown{S}": {"brow_furrow": 1.0, "wince": 0.2},
    "browLateral{S}": {"brow_furrow": 0.6},
    "browRaiseIn{S}": {"frontalis": 1.0, "medialis_frontalis": 1.0},
    "browRaiseOuter{S}": {"frontalis": 1.0, "outer_frontalis": 1.0},
    "eyeBlink{S}": {"blink": 1.0},
    "eyeCheekRaise{S}": {"outer_squint": 1.0, "smile": 0.4, "wince": 0.3},
    "eyeSquintInner{S}": {"squint": 1.0, "outer_squint": 0.2},
    "eyeWiden{S}": {"lid_raise": 1.0},
    "jawChinRaiseD{S}": {"shrug": 1.0},
    "jawChinRaiseU{S}": {"shrug": 0.4},
    "jawFwd": {"jaw_forward": 1.0},
    "jawLeft": {"jaw_left": 1.0},
    "jawOpen": {"jaw_open": 0.7},
    "jawRight": {"jaw_right": 1.0},
    "mouthCheekBlow{S}": {"cheek_puff": 1.0},
    "mouthCheekSuck{S}": {"cheek_suck": 1.0},
    "mouthCornerDepress{S}": {"frown": 1.0},
    "mouthCornerPull{S}": {"smile": 1.0},
    "mouthDimple{S}": {"pucker": 0.5},
    "mouthFunnelD{S}": {"lip_loosen": 1.0, "lip_loosen_lower": 1.0},
    "mouthFunnelU{S}": {"lip_loosen": 1.0, "lip_loosen_upper": 1.0},
    "mouthLipsPurseD{S}": {"purse": 1.0, "pucker": 0.6},
    "mouthLipsPurseU{S}": {"purse": 1.0, "pucker": 0.6},
    "mouthLowerLipDepress{S}": {"lower_lip_depress": 1.0, "grimace": 0.25},
    "mouthLowerLipRollIn{S}": {"lip_tighten": 1.0, "lip_tighten_lower": 1.0},
    "mouthPressD{S}": {"lip_lock": 1.0, "lip_lock_lower": 1.0},
    "mouthPressU{S}": {"lip_lock": 1.0, "lip_lock_upper": 1.0},
    "mouthStretch{S}": {"grimace": 1.0},
    "mouthUpperLipRaise{S}": {"sneer": 1.0},
    "mouthUpperLipRollIn{S}": {"lip_tighten": 1.0, "lip_tighten_upper": 1.0},
    "neckStretch{S}": {"grimace": 0.5},
    "noseNasolabialDeepen{S}": {"nasolabial_deepen": 1.0, "sneer": 0.3},
    "noseNostrilCompress{S}": {"nostril_compress": 1.0},
    "noseNostrilDilate{S}": {"nostril_flare": 1.0, "sneer": 0.4},
    "noseWrinkle{S}": {"wince": 1.0},
}

# --- VRM ------------------------------------------------------------------------------------------

_VOWELS: Keys = {
    "aa": {"jaw_open": 1.0},
    "ih": {"lower_lip_depress": 0.5},
    "ou": {"purse": 1.0, "pucker": 0.6},
    "ee": {"grimace": 0.6},
    "oh": {"lip_loosen": 1.0, "lip_loosen_upper": 0.5, "lip_loosen_lower": 0.5},
}
_BLINKS: Keys = {
    "blink": {"blink": 1.0},
    "blinkLeft": {"blink_left": 1.0},
    "blinkRight": {"blink_right": 1.0},
}
# The emotions by the action units that EMFACS gives them; `relaxed` has none.
_VRM: Keys = _sided(
    {
        "happy": {"smile": 1.0},
        "angry": {"brow_furrow": 1.0, "sneer": 0.4, "wince": 0.4},
        "sad": {"frown": 0.7, "medialis_frontalis": 0.5},
        "surprised": {"frontalis": 0.6, "lid_raise": 0.4},
        **_VOWELS,
    }
)
# Version 1.0 -> 0.x, which has no surprise.
_FORMERLY = {"happy": "joy", "angry": "angry", "sad": "sorrow", "aa": "a", "ih": "i", "ou": "u",
             "ee": "e", "oh": "o", "blink": "blink", "blinkLeft": "blink_l",
             "blinkRight": "blink_r"}  # fmt: skip
_VROID: Keys = _sided(
    {
        "Fcl_BRW_Angry": {"brow_furrow": 1.0, "wince": 0.2},
        "Fcl_BRW_Sorrow": {"medialis_frontalis": 1.0},
        "Fcl_BRW_Surprised": {"frontalis": 1.0, "outer_frontalis": 0.6},
        "Fcl_EYE_Surprised": {"lid_raise": 1.0},
        "Fcl_MTH_Fun": {"smile": 1.0},
        "Fcl_MTH_Down": {"frown": 1.0},
        **{f"Fcl_MTH_{_FORMERLY[name].upper()}": of for name, of in _VOWELS.items()},
    }
)
_VROID_BLINKS = {"Fcl_EYE_Close": "blink", "Fcl_EYE_Close_L": "blinkLeft",
                 "Fcl_EYE_Close_R": "blinkRight"}  # fmt: skip

# ours first: the order decides between conventions that explain a mesh equally well.
CONVENTIONS: dict[str, Convention] = {
    convention.name: convention
    for convention in (
        Convention("ours", "Sketch to Face", {name: {name: 1.0} for name in CONTROL_NAMES}),
        Convention("arkit", "ARKit", _arkit()),
        Convention(
            "metahuman",
            "MetaHuman",
            _sided({_METAHUMAN_PREFIX + name: of for name, of in _METAHUMAN.items()}),
            _METAHUMAN_PREFIX,
        ),
        Convention("vrm1", "VRM 1.0", {**_VRM, **_BLINKS}),
        Convention(
            "vrm0", "VRM 0.x", {old: {**_VRM, **_BLINKS}[new] for new, old in _FORMERLY.items()}
        ),
        Convention(
            "vroid",
            "VRoid",
            {**_VROID, **{name: _BLINKS[blink] for name, blink in _VROID_BLINKS.items()}},
        ),
    )
}
