"""The catalogue of the 47 FACS controls: one table that everything else reads.

Names, muscles and action units (AUs) follow the thesis' table of face actions; where it has no
row (outer brow, winks, nose and cheek actions, left and right versions) they come from the FACS
manual (Ekman, Friesen, Hager 2002). Every control runs from 0 to 10, where 5 is a full natural
activation.

A control's `mix` names the blendshapes that it is made of, with their weights at intensity 5:
`units/...` are MakeHuman's expression units, `arkit/...` the ARKit-named ones, `lids/...` are
turned by facs_rig.baking.lids. Controls of both
sides are the sum of their left and right versions, so that those add up to the symmetric one.
"""

from __future__ import annotations

from dataclasses import dataclass

MAX_INTENSITY = 10.0
FULL_INTENSITY = 5.0
REGIONS = ("upper", "mid", "lower")

Mix = tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Control:
    """One FACS control. `creases` names the crease curves (facs_rig.baking.creases) it raises."""

    name: str
    label: str
    region: str  # of REGIONS
    aus: tuple[str, ...]
    muscle: str
    side: str  # both, left, right: the face's own
    signature: str
    mix: Mix
    creases: tuple[str, ...] = ()


def _side(mix: Mix, side: str) -> Mix:
    """The mix of one side: `{Side}` and `{side}` stand for Left/Right and left/right.

    A blendshape without a side is cut down the middle: its half is written `name|left`.
    """
    out = []
    for name, weight in mix:
        if "{" in name:
            out.append((name.format(Side=side.capitalize(), side=side), weight))
        else:
            out.append((f"{name}|{side}", weight))
    return tuple(out)


def both_sides(mix: Mix) -> Mix:
    """The mix of both sides together."""
    return _side(mix, "left") + _side(mix, "right")


def _both(
    name, label, region, aus, muscle, signature, mix, creases=(), sides=False
) -> list[Control]:
    """A symmetric control and, if wanted, its left and right versions."""
    halves = {s: _side(mix, s) for s in ("left", "right")}
    symmetric = halves["left"] + halves["right"]
    made = [Control(name, label, region, aus, muscle, "both", signature, symmetric, tuple(creases))]
    if sides:
        for s in ("left", "right"):
            made.append(
                Control(
                    f"{name}_{s}",
                    f"{label} {s}",
                    region,
                    tuple(a + s[0].upper() for a in aus),
                    muscle,
                    s,
                    signature,
                    halves[s],
                    tuple(creases),
                )
            )
    return made


def _one(name, label, region, aus, muscle, signature, mix, creases=(), side="both") -> Control:
    return Control(name, label, region, aus, muscle, side, signature, tuple(mix), tuple(creases))


_BROW_UP = (("units/eyebrows-{side}-up", 0.8), ("units/eyebrows-{side}-inner-up", 0.35),
            ("arkit/browOuterUp{Side}", 0.6))  # fmt: skip
_BLINK = (("lids/close-{side}", 1.0),)
_SMILE = (("units/mouth-corner-puller", 0.75), ("arkit/mouthSmile{Side}", 0.25),
          ("arkit/cheekSquint{Side}", 0.4))  # fmt: skip
_GRIMACE = (("arkit/mouthStretch{Side}", 1.1), ("units/neck-platysma", 0.5),
            ("arkit/mouthLowerDown{Side}", 0.25))  # fmt: skip
_WINCE = (("arkit/noseSneer{Side}", 0.95), ("units/nose-{side}-elevation", 0.5),
          ("arkit/browDown{Side}", 0.2), ("arkit/cheekSquint{Side}", 0.3))  # fmt: skip
_SNEER = (("arkit/mouthUpperUp{Side}", 0.55), ("units/nose-{side}-dilatation", 0.4),
          ("units/mouth-upward-retraction", 0.25))  # fmt: skip

CONTROLS: tuple[Control, ...] = (
    # upper face: 12
    *_both("frontalis", "Brow raise", "upper", ("1", "2"), "Frontalis",
           "worry lines across the whole forehead", _BROW_UP, ["worry"], sides=True),
    *_both("medialis_frontalis", "Inner brow raise", "upper", ("1",), "Frontalis, pars medialis",
           "worry lines in the centre of the forehead, brows and lines in a subtle V",
           (("units/eyebrows-{side}-inner-up", 1.0), ("arkit/browInnerUp", 0.5)), ["worry_centre"]),
    *_both("outer_frontalis", "Outer brow raise", "upper", ("2",), "Frontalis, pars lateralis",
           "outer brows raised", (("arkit/browOuterUp{Side}", 0.9),
           ("units/eyebrows-{side}-extern-up", 0.4)), ["worry_side"]),
    *_both("brow_furrow", "Brow furrow", "upper", ("4",), "Corrugator",
           "brows lowered and drawn together, glabella lines",
           (("arkit/browDown{Side}", 0.9), ("units/eyebrows-{side}-down", 0.35)), ["glabella"]),
    *_both("lid_raise", "Upper lid raise", "upper", ("5",), "Levator palpebrae superioris",
           "eyes wide open", (("arkit/eyeWide{Side}", 1.0),)),
    *_both("squint", "Squint", "upper", ("6", "44"), "Orbicularis oculi",
           "eyes narrowed, crow's feet going down", (("arkit/eyeSquint{Side}", 0.75),
           ("units/eye-{side}-slit", 0.45)), ["crow_down", "under_eye"]),
    *_both("outer_squint", "Outer squint", "upper", ("6",), "Orbicularis oculi, pars orbitalis",
           "cheeks raised, crow's feet going up", (("arkit/cheekSquint{Side}", 0.9),
           ("arkit/eyeSquint{Side}", 0.2)), ["crow_up"]),
    *_both("blink", "Blink", "upper", ("45",), "Levator palpebrae superioris, relaxed",
           "eyes closed", _BLINK, sides=True),
    # mid face: 11
    *_both("wince", "Wince", "mid", ("9",), "Levator labii superioris alaeque nasi",
           "nose wrinkled, bunny lines, nasal folds", _WINCE, ["bunny", "nasal"], sides=True),
    *_both("sneer", "Sneer", "mid", ("10",), "Levator labii superioris",
           "upper lip raised into a wavy line, nasolabial folds", _SNEER, ["nasolabial"],
           sides=True),
    *_both("nasolabial_deepen", "Nasolabial deepener", "mid", ("11",), "Zygomatic minor",
           "nasolabial folds deepened in their middle", (("arkit/mouthUpperUp{Side}", 0.25),
           ("arkit/cheekSquint{Side}", 0.35)), ["nasolabial"]),
    *_both("cheek_puff", "Cheek puff", "mid", ("34",), "Orbicularis oris, buccinator relaxed",
           "cheeks blown up", (("arkit/cheekPuff", 1.0),)),
    *_both("cheek_suck", "Cheek suck", "mid", ("35",), "Buccinator",
           "cheeks drawn in", (("arkit/cheekPuff", -0.6), ("arkit/mouthPucker", 0.2))),
    *_both("nostril_flare", "Nostril flare", "mid", ("38",), "Nasalis, pars alaris",
           "nostrils widened", (("units/nose-{side}-dilatation", 1.7),)),
    *_both("nostril_compress", "Nostril compress", "mid", ("39",), "Nasalis, pars transversa",
           "nostrils narrowed", (("units/nose-compression", 1.6),)),
    # lower face: 24
    *_both("smile", "Smile", "lower", ("12",), "Zygomatic major",
           "mouth corners pulled up and back", _SMILE, ["smile_fold"], sides=True),
    *_both("pucker", "Pucker", "lower", ("14",), "Buccinator",
           "lip corners pinched and drawn inwards", (("arkit/mouthDimple{Side}", 0.3),
           ("arkit/mouthPucker", 0.8)), ["corner_pinch"]),
    *_both("frown", "Frown", "lower", ("15",), "Triangularis",
           "mouth corners turned down", (("arkit/mouthFrown{Side}", 1.0),), ["marionette"]),
    *_both("lower_lip_depress", "Lower lip depress", "lower", ("16",), "Depressor labii inferioris",
           "lower lip lowered, the mouth of an s", (("arkit/mouthLowerDown{Side}", 1.0),)),
    *_both("shrug", "Shrug", "lower", ("17",), "Mentalis",
           "lower lip squashed up, chin boss", (("arkit/mouthShrugLower", 0.9),
           ("arkit/mouthShrugUpper", 0.3)), ["chin_boss"]),
    *_both("purse", "Purse", "lower", ("18",), "Orbicularis oris",
           "lips pursed for a kiss", (("arkit/mouthPucker", 1.0),), ["lip_radial"]),
    *_both("grimace", "Grimace", "lower", ("20",), "Risorius, platysma",
           "mouth stretched sideways, lower lip tight", _GRIMACE, ["corner_fold"], sides=True),
    *_both("lip_loosen", "Lip loosen", "lower", ("22a",), "Orbicularis oris",
           "lips funnelled, the mouth of a sh", (("arkit/mouthFunnel", 1.0),)),
    *_both("lip_loosen_upper", "Upper lip loosen", "lower", ("22b",), "Orbicularis oris",
           "upper lip funnelled", (("arkit/mouthFunnel^upper", 1.0),)),
    *_both("lip_loosen_lower", "Lower lip loosen", "lower", ("22c",), "Orbicularis oris",
           "lower lip funnelled", (("arkit/mouthFunnel^lower", 1.0),)),
    *_both("lip_lock", "Lip lock", "lower", ("24a",), "Orbicularis oris",
           "lips pressed together", (("arkit/mouthPress{Side}", 0.6),
           ("arkit/mouthRollUpper", 0.35), ("arkit/mouthRollLower", 0.35))),
    *_both("lip_lock_upper", "Upper lip lock", "lower", ("24b",), "Orbicularis oris",
           "upper lip pressed down", (("arkit/mouthPress{Side}^upper", 0.3),
           ("arkit/mouthRollUpper", 0.55))),
    *_both("lip_lock_lower", "Lower lip lock", "lower", ("24c",), "Orbicularis oris",
           "lower lip pressed up", (("arkit/mouthRollLower", 0.55),
           ("arkit/mouthShrugLower", 0.3))),
    *_both("jaw_open", "Jaw open", "lower", ("26a",), "Digastric, masseter relaxed",
           "mouth open", (("arkit/jawOpen", 0.7),)),
    _one("jaw_left", "Jaw left", "lower", ("26b",), "Temporalis, masseter",
         "jaw moved to the face's left", (("arkit/jawLeft", 1.8),), side="left"),
    _one("jaw_right", "Jaw right", "lower", ("26c",), "Temporalis, masseter",
         "jaw moved to the face's right", (("arkit/jawRight", 1.8),), side="right"),
    _one("jaw_forward", "Jaw forward", "lower", ("26d",), "Lateral pterygoid",
         "jaw pushed forward", (("arkit/jawForward", 1.3),)),
    *_both("lip_tighten", "Lip tighten", "lower", ("28a",), "Orbicularis oris",
           "both lips rolled in", (("arkit/mouthRollUpper", 1.0), ("arkit/mouthRollLower", 1.0))),
    *_both("lip_tighten_upper", "Upper lip tighten", "lower", ("28b",), "Orbicularis oris",
           "upper lip rolled in", (("arkit/mouthRollUpper", 1.0),)),
    *_both("lip_tighten_lower", "Lower lip tighten", "lower", ("28c",), "Orbicularis oris",
           "lower lip rolled in", (("arkit/mouthRollLower", 1.0),)),
)  # fmt: skip

CONTROL_NAMES: tuple[str, ...] = tuple(c.name for c in CONTROLS)


def _whole() -> tuple[int, ...]:
    stems = [name.removesuffix("_left").removesuffix("_right") for name in CONTROL_NAMES]
    return tuple(
        CONTROL_NAMES.index(stem) if stem in CONTROL_NAMES else k for k, stem in enumerate(stems)
    )


# For each control the number of the symmetric one that it is a side of, or its own.
WHOLE: tuple[int, ...] = _whole()

# The twelve that the thesis' classifiers see, in its order.
TWELVE: tuple[str, ...] = (
    "frontalis", "medialis_frontalis", "brow_furrow", "grimace", "grimace_left", "grimace_right",
    "sneer", "wince", "squint", "outer_squint", "smile", "pucker",
)  # fmt: skip

# The 52 blendshapes of Apple's ARKit, whose names live-capture tools send.
ARKIT_NAMES: tuple[str, ...] = (
    "browDownLeft", "browDownRight", "browInnerUp", "browOuterUpLeft", "browOuterUpRight",
    "cheekPuff", "cheekSquintLeft", "cheekSquintRight", "eyeBlinkLeft", "eyeBlinkRight",
    "eyeLookDownLeft", "eyeLookDownRight", "eyeLookInLeft", "eyeLookInRight", "eyeLookOutLeft",
    "eyeLookOutRight", "eyeLookUpLeft", "eyeLookUpRight", "eyeSquintLeft", "eyeSquintRight",
    "eyeWideLeft", "eyeWideRight", "jawForward", "jawLeft", "jawOpen", "jawRight", "mouthClose",
    "mouthDimpleLeft", "mouthDimpleRight", "mouthFrownLeft", "mouthFrownRight", "mouthFunnel",
    "mouthLeft", "mouthLowerDownLeft", "mouthLowerDownRight", "mouthPressLeft",
    "mouthPressRight", "mouthPucker", "mouthRight", "mouthRollLower", "mouthRollUpper",
    "mouthShrugLower", "mouthShrugUpper", "mouthSmileLeft", "mouthSmileRight",
    "mouthStretchLeft", "mouthStretchRight", "mouthUpperUpLeft", "mouthUpperUpRight",
    "noseSneerLeft", "noseSneerRight", "tongueOut",
)  # fmt: skip
