"""Stylised people: a dozen to start from, and random ones around and between them.

Each is an identity like any other, with features beyond their human range (see `Feature.style`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from .common.errors import InputError
from .identity import BY_NAME, ETHNICITIES, FEATURES, IDENTITY, STYLED
from .parameters import nearest

JITTER = 0.25  # standard deviation, in steps, of a random person's own features
VARIED = 0.5  # share of the features that it varies


@dataclass(frozen=True)
class Preset:
    """A stylised person to start from: identity parameters by name, the others plain; and what is
    special about it, in a few words."""

    name: str
    label: str
    about: str
    identity: dict[str, float]


def _only(who: str) -> dict[str, float]:
    return {name: float(name == who) for name in ETHNICITIES}


PRESETS: tuple[Preset, ...] = (
    Preset("comic", "Comic", "Large eyes, a round nose, a broad mouth", {
        "eye_size": 1.9, "eye_opening": 1.7, "nose_length": -0.6, "nose_width": -0.5,
        "nose_tip_width": 2.2, "mouth_width": 1.2, "head_width": 1.2, "brow_height": 1.6,
        "ear_size": 1.6, "jaw_width": -0.6, "neck_girth": -1.8,
    }),
    Preset("manga", "Manga", "Very large, open eyes over a small nose, mouth and chin", {
        "gender": 0.1, **_only("asian"), "eye_size": 2.2, "eye_opening": 2.0, "eye_height": -1.0,
        "nose_width": -1.8, "nose_depth": -1.8, "nose_length": -0.6, "mouth_width": -0.8,
        "chin_width": -1.5, "chin_height": 0.4, "upper_lip": -1.0, "lower_lip": -1.0,
        "neck_girth": -2.0, "forehead_height": 0.8, "brow_height": 1.5, "eye_bag": -1.0,
        "wrinkles": -0.7,
    }),
    Preset("chibi", "Chibi", "A broad head that is nearly all eyes", {
        "gender": 0.1, "eye_size": 2.6, "eye_opening": 2.0, "eye_height": -0.8, "nose_width": -2.0,
        "nose_depth": -2.2, "nose_length": -0.6, "mouth_width": -0.8, "chin_width": -0.8,
        "jaw_width": 0.5, "head_width": 1.8, "head_height": -0.3, "cheek_volume": 1.0,
        "neck_girth": -3.0, "forehead_height": 1.2, "lower_lip": -1.0, "upper_lip": -1.0,
        "ear_size": -1.2, "brow_height": 1.8, "wrinkles": -1.0,
    }),
    Preset("baby_face", "Baby face", "Round cheeks, a high forehead, eyes far down", {
        "gender": 0.4, "eye_size": 1.6, "eye_opening": 1.6, "eye_height": -1.2, "eye_spacing": 0.7,
        "nose_length": -0.8, "nose_width": 0.2, "nose_depth": -1.5, "nose_bridge": 0.5,
        "cheek_volume": 1.8, "head_width": 1.4, "head_height": -0.4, "chin_height": -0.6,
        "jaw_width": -0.3, "mouth_width": -0.8, "forehead_height": 1.3, "neck_girth": -2.3,
        "head_fat": 0.9, "brow_height": 0.9, "head_shape": -0.6, "wrinkles": -0.8,
    }),
    Preset("elegant", "Elegant", "A long, narrow head on a slender neck", {
        "gender": 0.0, **_only("caucasian"), "head_height": 1.7, "head_width": -1.1,
        "neck_girth": -2.4, "eye_size": 1.4, "eye_spacing": 0.6, "nose_width": -1.6,
        "nose_length": 1.2, "chin_width": -1.5, "jaw_width": -1.2, "upper_lip": 1.2,
        "lower_lip": 1.3, "mouth_width": -0.6, "cheekbones": 0.8, "neck_length": 0.7,
        "brow_height": 1.2,
    }),
    Preset("elf", "Elf", "Slanted eyes, a pointed chin, large ears", {
        "gender": 0.3, "eye_size": 1.6, "eye_slant": 1.0, "chin_width": -1.8, "head_shape": -1.5,
        "ear_size": 2.6, "ear_wing": 0.6, "nose_width": -1.5, "nose_tip": 0.8, "mouth_width": -0.3,
        "cheekbones": 0.8, "neck_girth": -1.8,
    }),
    Preset("hero", "Comic hero", "A jaw as broad as the skull, on a bull's neck", {
        "gender": 1.0, **_only("caucasian"), "jaw_width": 2.8, "chin_width": 1.8,
        "chin_forward": 1.6, "chin_height": 1.3, "neck_girth": 2.5, "head_width": 0.3,
        "brow_depth": 1.0, "eye_size": -0.2, "brow_height": -1.3, "nose_width": 0.2,
        "head_shape": 1.2,
    }),
    Preset("brute", "Brute", "All jaw and nose, little above the brows", {
        "gender": 1.0, **_only("caucasian"), "head_shape": 3.0, "jaw_width": 3.0,
        "neck_girth": 3.0, "eye_size": -1.3, "brow_height": -1.3, "brow_depth": 1.0,
        "forehead_height": -1.8, "nose_width": 2.0, "nose_tip_width": 1.3, "chin_width": 2.0,
        "chin_forward": 1.6, "ear_size": -1.2, "mouth_width": 1.4,
    }),
    Preset("caricature", "Caricature", "Nose, chin and ears of an old man, drawn large", {
        "gender": 1.0, "age": 0.5, "nose_length": 1.8, "nose_depth": 2.0, "nose_width": 1.4,
        "chin_forward": 2.0, "chin_height": 1.5, "ear_size": 2.6, "forehead_height": 0.6,
        "eye_size": -0.8, "mouth_width": 1.4, "neck_girth": -1.8, "head_width": -1.0,
        "brow_depth": 0.8,
    }),
    Preset("big_nose", "Big nose", "A nose that comes before everything else", {
        "gender": 1.0, "nose_width": 3.2, "nose_depth": 2.6, "nose_tip_width": 2.4,
        "nose_length": 1.2, "eye_spacing": 0.3, "eye_size": 1.2, "eye_opening": 1.3,
        "chin_height": -1.0, "mouth_width": 1.3, "head_height": -0.5, "cheek_volume": 0.8,
    }),
    Preset("long_face", "Long face", "Everything drawn out downward", {
        "gender": 1.0, "head_height": 2.4, "head_width": -1.2, "chin_height": 1.8,
        "nose_length": 1.7, "mouth_width": -0.6, "eye_opening": -0.7, "ear_size": 0.5,
    }),
    Preset("egg_head", "Egg head", "A great skull over a small face", {
        "gender": 0.7, "forehead_height": 3.0, "head_shape": -2.4, "chin_width": -1.5,
        "eye_size": -0.3, "nose_length": 0.4, "mouth_width": -1.0, "jaw_width": -1.0,
        "neck_girth": -2.8, "ear_size": 0.8, "head_width": 1.2,
    }),
    Preset("puppet", "Puppet", "A broad head, round eyes, a ball for a nose", {
        "head_width": 1.9, "head_height": -1.1, "mouth_width": 1.8, "nose_tip_width": 2.6,
        "nose_length": -0.6, "eye_size": 1.6, "eye_opening": 2.0, "eye_spacing": 0.8,
        "eye_height": 0.6, "jaw_width": 1.4, "neck_girth": -2.5, "head_shape": 1.1,
        "cheek_volume": 0.8,
    }),
    Preset("witch", "Witch", "A hooked nose that meets the chin", {
        "gender": 0.0, "age": 1.0, "nose_length": 2.1, "nose_depth": 2.6, "nose_hump": 1.0,
        "nose_tip": -1.0, "nose_width": -1.0, "chin_forward": 3.0, "chin_height": 1.6,
        "chin_width": -2.0, "cheek_hollow": 1.0, "cheekbones": 1.0, "eye_size": 0.6,
        "mouth_width": 1.0, "upper_lip": -1.0, "lower_lip": -0.6, "head_width": -1.3,
        "brow_angle": 1.0,
    }),
)  # fmt: skip
PRESET_NAMES = tuple(preset.name for preset in PRESETS)


def preset(name: str) -> dict[str, float]:
    """The identity of a stylised person to start from; InputError for a name that is none."""
    for one in PRESETS:
        if one.name == name:
            return dict(one.identity)
    hint = nearest(name, PRESET_NAMES) or f"; choose one of {', '.join(PRESET_NAMES)}"
    raise InputError(f"there is no stylised person '{name}'{hint}")


def is_stylised(identity: Mapping[str, float]) -> bool:
    """Whether any feature is beyond what people have."""
    return any(not f.minimum <= identity.get(f.name, f.default) <= f.maximum for f in STYLED)


def drawn_style(rng: np.random.Generator) -> dict[str, float]:
    """A random stylised person: two presets mixed, more or less strongly, and features of its own.

    The same generator gives the same person.
    """
    first, second = (PRESETS[k].identity for k in rng.choice(len(PRESETS), 2, replace=False))
    share, strength = rng.beta(0.5, 0.5), rng.uniform(0.6, 1.1)
    out = {}
    for parameter in IDENTITY:
        name = parameter.name
        if name not in first and name not in second:
            continue
        plain = parameter.default
        a, b = (who.get(name, plain) - plain for who in (first, second))
        out[name] = plain + ((1 - share) * a + share * b) * strength
    for feature in FEATURES:
        if rng.random() < VARIED:
            out[feature.name] = out.get(feature.name, 0.0) + rng.normal(0, JITTER)
    return {
        name: round(float(np.clip(value, *BY_NAME[name].span)), 4) for name, value in out.items()
    }
