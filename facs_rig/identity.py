"""The table of identity parameters: who the face is, as against what it does.

`gender` runs from 0 (female) to 1 (male), `age` from -1 (a child of six) over 0 (25 years) to 1
(90 years; see `macros.years`), `weight` and `muscle` from -1 to 1, and the three ethnicities are
shares that are normalised to one. `age_shows` is how much of its years an old face shows: sagging
lids, jowls, thin lips, long ears; `sex_shows` and `weight_shows` are the same of sex and weight.
All three are 1 by default, and 0 in faces of the first version (see `EARLIER`). `wrinkles` makes
the creases of the expression deeper or, at -1, takes them away; age deepens them too. All features
run from -1 to 1 with 0 for the plain face; they are MakeHuman's modelling targets, mirrored pairs
as one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import actions, folds
from .common.errors import InputError
from .looks import ROWS
from .macros import BROW_DETAILS, macro_targets, macro_weights
from .macros import ETHNICITIES as ETHNICITIES
from .parameters import nearest


@dataclass(frozen=True)
class Feature:
    """One parameter; `low` and `high` name the targets at its two ends (features only).

    `reach` is how much of these targets -1 and 1 mean, where the whole is no longer a face.
    `style` is the range beyond the human one, of stylised people, where there is one.
    `group` is what parameters without targets belong to.
    """

    name: str
    label: str
    minimum: float
    maximum: float
    default: float
    low: str = ""
    high: str = ""
    reach: tuple[float, float] = (1.0, 1.0)
    style: tuple[float, float] | None = None
    group: str = ""

    @property
    def part(self) -> str:
        """What of a person it belongs to: the folder of its targets, or its group."""
        return self.low.split("/")[0] or self.group

    @property
    def span(self) -> tuple[float, float]:
        """The least and the largest value that it may have."""
        return self.style or (self.minimum, self.maximum)


_REACH = {
    "head_width": (0.75, 0.75), "head_height": (0.75, 0.7), "head_shape": (0.8, 0.8),
    "head_round": (0.7, 0.7), "forehead_height": (0.7, 0.45), "forehead_slope": (0.8, 0.6),
    "temple": (0.5, 0.8), "brow_depth": (0.8, 0.4), "brow_angle": (0.6, 0.8),
    "nose_depth": (0.45, 0.8), "nose_tip": (0.5, 0.8), "mouth_height": (0.8, 0.8),
    "asym_eyes": (0.6, 0.6), "asym_jaw": (0.8, 0.8),
    "cheekbones": (0.8, 0.7), "cheek_volume": (0.8, 0.7), "chin_height": (0.8, 0.6),
}  # fmt: skip

# How far stylised people go. Eyes are 2.5 times as large at 3, a nose is a third as wide at -3;
# what a step beyond 1 or -1 does is said by the fields of facs_rig.baking.warps.
_STYLE = {
    "head_width": (-3, 3), "head_height": (-3, 3), "head_shape": (-3, 3),
    "forehead_height": (-2, 3), "eye_size": (-1.6, 3), "eye_spacing": (-2, 3),
    "eye_height": (-2.5, 2.5), "eye_opening": (-1, 2), "brow_height": (-2, 3),
    "nose_length": (-2, 3), "nose_width": (-3, 4), "nose_depth": (-3, 4), "nose_tip_width": (-2, 3),
    "mouth_width": (-2.5, 2.5), "mouth_height": (-2, 2), "upper_lip": (-2, 3), "lower_lip": (-2, 3),
    "cheek_volume": (-2, 3), "chin_height": (-2, 3), "chin_width": (-2.5, 3),
    "chin_forward": (-2, 3), "jaw_width": (-2.5, 3.5), "ear_size": (-2.5, 3),
    "neck_girth": (-3, 3),
}  # fmt: skip


def _feature(name: str, label: str, folder: str, stem: str, low: str, high: str) -> Feature:
    path = f"{folder}/{stem}-" if stem else f"{folder}/"
    reach, style = _REACH.get(name, (1.0, 1.0)), _STYLE.get(name)
    return Feature(name, label, -1.0, 1.0, 0.0, path + low, path + high, reach, style)


PEOPLE: tuple[Feature, ...] = (
    Feature("gender", "Gender (female to male)", 0.0, 1.0, 0.5),
    Feature("age", "Age (six to ninety)", -1.0, 1.0, 0.0),
    Feature("weight", "Weight", -1.0, 1.0, 0.0),
    Feature("muscle", "Muscle", -1.0, 1.0, 0.0),
    Feature("age_shows", "How much age shows", 0.0, 1.0, 1.0),
    Feature("sex_shows", "How much sex shows", 0.0, 1.0, 1.0),
    Feature("weight_shows", "How much weight shows", 0.0, 1.0, 1.0),
    Feature("african", "African share", 0.0, 1.0, 1 / 3),
    Feature("asian", "Asian share", 0.0, 1.0, 1 / 3),
    Feature("caucasian", "Caucasian share", 0.0, 1.0, 1 / 3),
    Feature("wrinkles", "Depth of creases", -1.0, 1.0, 0.0),
)

FEATURES: tuple[Feature, ...] = (
    _feature("head_width", "Head width", "head", "head-scale-horiz", "decr", "incr"),
    _feature("head_height", "Head height", "head", "head-scale-vert", "decr", "incr"),
    _feature("head_depth", "Head depth", "head", "head-scale-depth", "decr", "incr"),
    _feature("head_fat", "Face fullness", "head", "head-fat", "decr", "incr"),
    _feature("head_shape", "Head shape (triangle down to up)", "head", "",
             "head-invertedtriangular", "head-triangular"),
    _feature("head_round", "Head shape (square to round)", "head", "", "head-square", "head-round"),
    _feature("forehead_height", "Forehead height", "forehead", "forehead-scale-vert",
             "decr", "incr"),
    _feature("forehead_slope", "Forehead (back to forward)", "forehead", "forehead-trans",
             "backward", "forward"),
    _feature("temple", "Temples", "forehead", "forehead-temple", "decr", "incr"),
    _feature("eye_size", "Eye size", "eyes", "{s}-eye-scale", "decr", "incr"),
    _feature("eye_spacing", "Eye spacing", "eyes", "{s}-eye-trans", "in", "out"),
    _feature("eye_height", "Eye height", "eyes", "{s}-eye-trans", "down", "up"),
    _feature("eye_slant", "Eye slant (outer corner)", "eyes", "{s}-eye-corner2", "down", "up"),
    _feature("eye_inner_corner", "Inner eye corner", "eyes", "{s}-eye-corner1", "down", "up"),
    _feature("eye_opening", "Eye opening", "eyes", "{s}-eye-height2", "decr", "incr"),
    _feature("eye_depth", "Eye depth", "eyes", "{s}-eye-push2", "in", "out"),
    _feature("eye_fold", "Eye fold", "eyes", "{s}-eye-eyefold", "up", "down"),
    _feature("eye_bag", "Eye bags", "eyes", "{s}-eye-bag", "decr", "incr"),
    _feature("brow_height", "Brow height", "eyebrows", "eyebrows-trans", "down", "up"),
    _feature("brow_angle", "Brow angle", "eyebrows", "eyebrows-angle", "down", "up"),
    _feature("brow_depth", "Brow ridge", "eyebrows", "eyebrows-trans", "backward", "forward"),
    _feature("nose_length", "Nose length", "nose", "nose-scale-vert", "decr", "incr"),
    _feature("nose_height", "Nose position", "nose", "nose-trans", "down", "up"),
    _feature("nose_width", "Nose width", "nose", "nose-scale-horiz", "decr", "incr"),
    _feature("nose_bridge", "Nose bridge width", "nose", "nose-width1", "decr", "incr"),
    _feature("nose_depth", "Nose depth", "nose", "nose-scale-depth", "decr", "incr"),
    _feature("nose_hump", "Nose hump", "nose", "nose-hump", "decr", "incr"),
    _feature("nose_tip", "Nose tip (down to up)", "nose", "nose-point", "down", "up"),
    _feature("nose_tip_width", "Nose tip width", "nose", "nose-point-width", "decr", "incr"),
    _feature("nostril_width", "Nostril width", "nose", "nose-nostrils-width", "decr", "incr"),
    _feature("mouth_width", "Mouth width", "mouth", "mouth-scale-horiz", "decr", "incr"),
    _feature("mouth_height", "Mouth position", "mouth", "mouth-trans", "down", "up"),
    _feature("mouth_angle", "Mouth corners", "mouth", "mouth-angles", "down", "up"),
    _feature("upper_lip", "Upper lip fullness", "mouth", "mouth-upperlip-height", "decr", "incr"),
    _feature("lower_lip", "Lower lip fullness", "mouth", "mouth-lowerlip-height", "decr", "incr"),
    _feature("lip_volume", "Lip volume", "mouth", "mouth-lowerlip-volume", "decr", "incr"),
    _feature("cupids_bow", "Cupid's bow", "mouth", "mouth-cupidsbow", "decr", "incr"),
    _feature("cheekbones", "Cheekbones", "cheek", "{s}-cheek-bones", "decr", "incr"),
    _feature("cheek_volume", "Cheek volume", "cheek", "{s}-cheek-volume", "decr", "incr"),
    _feature("cheek_hollow", "Cheek hollows", "cheek", "{s}-cheek-inner", "incr", "decr"),
    _feature("chin_height", "Chin height", "chin", "chin-height", "decr", "incr"),
    _feature("chin_width", "Chin width", "chin", "chin-width", "decr", "incr"),
    _feature("chin_forward", "Chin (back to forward)", "chin", "chin-prominent", "decr", "incr"),
    _feature("jaw_width", "Jaw width", "chin", "chin-bones", "decr", "incr"),
    _feature("jaw_drop", "Jaw height", "chin", "chin-jaw-drop", "decr", "incr"),
    _feature("ear_size", "Ear size", "ears", "{s}-ear-scale", "decr", "incr"),
    _feature("ear_wing", "Ears standing out", "ears", "{s}-ear-wing", "decr", "incr"),
    _feature("neck_girth", "Neck girth", "neck", "measure-neck-circ", "decr", "incr"),
    _feature("neck_length", "Neck length", "neck", "neck-scale-vert", "decr", "incr"),
)  # fmt: skip

# How a person does things (see facs_rig.actions).
ACTIONS = tuple(
    Feature(name, label, -1.0, 1.0, 0.0, group="actions") for name, label in actions.TABLE.items()
)

# Which creases a person has (see facs_rig.folds).
CREASES = (
    *(Feature(f"{family}_{trait}", f"{label}: {what}", -1.0, 1.0, 0.0, group="creases")
      for family, (label, _) in folds.FAMILIES.items() for trait, what in folds.TRAITS.items()),
    Feature(folds.SEED, "Crease pattern", 0.0, float(folds.SEEDS), 0.0, group="creases"),
)  # fmt: skip

LOOKS = tuple(Feature(*row, group="colours") for row in ROWS)  # colours, which move nothing

# What makes the left unlike the right: to the face's own left, or higher there, is above 0.
ASYMMETRY: tuple[Feature, ...] = (
    _feature("asym_brows", "Higher brow (right or left)", "asym", "asym-brown-1", "l", "r"),
    _feature("asym_eyes", "Higher eye (right or left)", "asym", "asym-eye-2", "l", "r"),
    _feature("asym_cheeks", "Higher cheek (right or left)", "asym", "asym-cheek-2", "r", "l"),
    _feature("asym_nose", "Nose aside (right or left)", "asym", "asym-nose-1", "r", "l"),
    _feature("asym_nostrils", "Higher nostril (right or left)", "asym", "asym-nose-2", "r", "l"),
    _feature("asym_mouth", "Higher corner of the mouth (right or left)", "asym", "asym-mouth-1",
             "l", "r"),
    _feature("asym_lips", "Mouth aside (right or left)", "asym", "asym-mouth-2", "r", "l"),
    _feature("asym_jaw", "Jaw aside (right or left)", "asym", "asym-jaw-3", "r", "l"),
    _feature("asym_ears", "Higher ear (right or left)", "asym", "asym-ear-1", "r", "l"),
)  # fmt: skip

# Shapes of the brows as hairs, over those that age and sex give them (see `macros.brow_weights`).
BROWS: tuple[Feature, ...] = (
    Feature("brow_thickness", "Thickness of brows", -1.0, 1.0, 0.0, group="eyebrows"),
    Feature("brow_density", "Density of brows", -1.0, 1.0, 0.0, group="eyebrows"),
    Feature("brow_bushiness", "Bushy brows", 0.0, 1.0, 0.0, group="eyebrows"),
    Feature("brow_arch", "Brows (straight to arched)", -1.0, 1.0, 0.0, group="eyebrows"),
    Feature("brow_length", "Length of brows", -1.0, 1.0, 0.0, group="eyebrows"),
)

IDENTITY: tuple[Feature, ...] = (
    *PEOPLE,
    *FEATURES,
    *ASYMMETRY,
    *BROWS,
    *ACTIONS,
    *CREASES,
    *LOOKS,
)
BY_NAME = {f.name: f for f in IDENTITY}
# What faces of version 1 mean where they say nothing: they showed none of this.
EARLIER = {"age_shows": 0.0, "sex_shows": 0.0, "weight_shows": 0.0}

# What moves the fine skin itself: name -> its weight for a person, given all parameters.
DETAILS: dict[str, Callable[[Mapping[str, float]], float]] = {
    **BROW_DETAILS,
    **folds.REST_FOLDS,
}

STYLED = tuple(f for f in FEATURES if f.style)


def _ends(features: tuple[Feature, ...]) -> tuple[str, ...]:
    return tuple(f"{f.name} {end}" for f in features for end in ("low", "high"))


# A name for each weight of `target_weights`, for Blender's shape keys: macro targets, the two
# ends of asymmetries and features, what is stylised of these; that moves the cage; and details of
# the fine skin.
_MACRO = tuple(name.split("/")[-1] for name in macro_targets())
_STYLED = tuple(f"{f.name} stylised" for f in STYLED)
CAGE_KEYS = (*_MACRO, *_ends(ASYMMETRY), *_ends(FEATURES), *_STYLED)
IDENTITY_KEYS = (*CAGE_KEYS, *DETAILS)
CAGE_TARGETS = len(CAGE_KEYS)
STYLES = slice(CAGE_TARGETS - len(STYLED), CAGE_TARGETS)
ENDS = slice(STYLES.start - 2 * len(FEATURES), STYLES.start)
_DEFAULTS = {f.name: f.default for f in IDENTITY}


def crease_gain(identity: Mapping[str, float]) -> float:
    """How deep the expression's creases are: 1 in the plain young face, deeper with age."""
    return folds.crease_gain(check_identity(identity))


def check_identity(identity: Mapping[str, float]) -> dict[str, float]:
    """All identity parameters by name, defaults filled in; InputError for what cannot be."""
    known = dict(_DEFAULTS)
    for name, value in identity.items():
        if name not in known:
            hint = nearest(str(name), tuple(known)) or "; `sketch2face rig --list` shows them all"
            raise InputError(f"there is no identity parameter '{name}'{hint}")
        feature = BY_NAME[name]
        least, most = feature.span
        if not least <= value <= most:
            raise InputError(f"{name} = {value} is outside {least:g} to {most:g}")
        known[name] = float(value)
    return known


def target_weights(identity: Mapping[str, float]) -> NDArray[np.float64]:
    """Weights of all identity targets, in the order of IDENTITY_KEYS."""
    p = check_identity(identity)
    asymmetry, values = (np.array([p[f.name] for f in table]) for table in (ASYMMETRY, FEATURES))
    human = np.clip(values, -1, 1)
    styles = (values - human)[_STYLED_AT]
    if styles.any():
        styles = _with_room(styles, p)
    ends = (_two_ends(part) for part in (asymmetry, human))
    return np.concatenate([macro_weights(p), *ends, styles, detail_weights(p)])


def detail_weights(known: Mapping[str, float]) -> NDArray[np.float64]:
    """Weights of DETAILS. known : all parameters by name, as `check_identity` gives them"""
    return np.array([weight(known) for weight in DETAILS.values()], dtype=float)


_STYLED_AT = np.array([FEATURES.index(f) for f in STYLED], dtype=int)


def _two_ends(values: NDArray) -> NDArray[np.float64]:
    """(2k,) how far values (k,) are below 0 and above it, in turn."""
    return np.stack([np.maximum(-values, 0), np.maximum(values, 0)], axis=1).ravel()


# What brings the eyeballs nearer to each other, in millimetres for each step: of stylised features
# upward, of people's downward; and how much nearer they may come with a nose between them.
_NARROWER = {"eye_spacing": -6.0, "head_width": -3.3, "eye_size": 1.7}
_NARROW = {"eye_spacing": 3.4, "head_width": 4.4}
_ROOM = 10.0


def _with_room(styles: NDArray, known: Mapping[str, float]) -> NDArray[np.float64]:
    """Steps (styles,) beyond the human range of which none pushes the eyes into each other."""
    steps = dict(zip((f.name for f in STYLED), styles.tolist(), strict=True))
    nearer = {name: max(_NARROWER[name] * steps[name], 0.0) for name in _NARROWER}
    room = _ROOM - sum(mm * min(max(-known[name], 0.0), 1.0) for name, mm in _NARROW.items())
    given = sum(nearer[name] for name in _NARROW)
    most = max(room - nearer["eye_size"], 0.0)
    share = min(1.0, most / given) if given > 0 else 1.0
    held = {name: steps[name] * share for name in _NARROW if nearer[name] > 0}
    return np.array([held.get(f.name, step) for f, step in zip(STYLED, styles, strict=True)])
