"""The colours of a person: skin, lips, irises and brows, as numbers to set or to draw by lot.

The lightness of the skin follows the ten tones of the Monk Skin Tone Scale (Ellis Monk 2022,
skintone.google, CC BY 4.0); its hue is that of the default skin, with less colour toward both ends
of the scale, as CIELAB measurements of people have it (Xiao et al. 2017, "Characterising the
variations in ethnic skin colours", Skin Research and Technology 23).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Colour = tuple[float, float, float, float]

# name, label, least, most, default
ROWS: tuple[tuple[str, str, float, float, float], ...] = (
    ("skin_tone", "Skin tone (light to dark)", 0.0, 1.0, 0.35),
    ("skin_redness", "Skin redness (sallow to ruddy)", -1.0, 1.0, 0.0),
    ("skin_gloss", "Skin gloss (dull to oily)", -1.0, 1.0, 0.0),
    ("lip_colour", "Lip colour (pale to red)", -1.0, 1.0, 0.0),
    ("iris_colour", "Iris (brown, hazel, green, blue, grey)", 0.0, 1.0, 0.85),
    ("brow_colour", "Brow colour (blond to black)", 0.0, 1.0, 0.75),
    ("brow_grey", "Grey in the brows", 0.0, 1.0, 0.0),
)
DEFAULTS = {name: default for name, *_, default in ROWS}


@dataclass(frozen=True)
class Finish:
    """What a part is made of. colour : linear RGBA, 0..1      roughness : 0 mirror to 1 chalk"""

    colour: Colour
    roughness: float


# The default person's.
PLAIN: dict[str, Finish] = {
    "skin": Finish((0.86, 0.63, 0.52, 1.0), 0.55),
    "eyes": Finish((0.90, 0.89, 0.87, 1.0), 0.20),
    "iris": Finish((0.16, 0.24, 0.30, 1.0), 0.20),
    "pupil": Finish((0.01, 0.01, 0.01, 1.0), 0.15),
    "brows": Finish((0.085, 0.052, 0.036, 1.0), 0.70),
    "brow_skin": Finish((0.46, 0.31, 0.235, 1.0), 0.60),
    "teeth": Finish((0.86, 0.82, 0.74, 1.0), 0.30),
    "gums": Finish((0.52, 0.20, 0.19, 1.0), 0.35),
    "lips": Finish((0.66, 0.36, 0.32, 1.0), 0.40),
    "tongue": Finish((0.30, 0.08, 0.075, 1.0), 0.40),
    "mouth": Finish((0.10, 0.02, 0.02, 1.0), 0.45),
    "lashes": Finish((0.05, 0.035, 0.03, 1.0), 0.80),
}

# skin_tone -> CIELAB (D65). Lightness: Monk's tones 1 to 10 at ninths.
_TONES = np.array([
    (0.0, 93.5, 4.0, 7.5), (0.11, 91.5, 5.5, 9.0), (0.22, 89.5, 7.0, 11.0),
    (0.35, 85.6, 9.2, 13.0), (0.45, 76.5, 11.5, 18.5), (0.56, 59.0, 14.0, 23.0),
    (0.67, 45.0, 13.5, 20.5), (0.78, 33.0, 11.5, 15.5), (0.89, 22.5, 7.5, 9.0),
    (1.0, 15.0, 4.5, 5.0),
])  # fmt: skip
RUDDY, SALLOW = (8.0, -1.0), (-3.0, 5.0)  # CIELAB a and b at the two ends, of skin of lightness 85
# Linear RGB along the parameters: dark brown, brown, hazel, green, blue, the default, grey.
_IRISES = np.array([
    (0.0, 0.030, 0.014, 0.008), (0.22, 0.095, 0.040, 0.016), (0.42, 0.170, 0.100, 0.030),
    (0.56, 0.130, 0.170, 0.070), (0.72, 0.110, 0.220, 0.380), (0.85, 0.16, 0.24, 0.30),
    (1.0, 0.260, 0.300, 0.320),
])  # fmt: skip
_BROWS = np.array([
    (0.0, 0.420, 0.270, 0.120), (0.25, 0.240, 0.120, 0.045), (0.5, 0.160, 0.088, 0.045),
    (0.75, 0.085, 0.052, 0.036), (1.0, 0.012, 0.010, 0.010),
])  # fmt: skip
_GREY = np.array((0.55, 0.55, 0.54))
_RED_LIPS = np.array((0.42, 0.035, 0.045))
GLOSS = 0.25  # of the skin's roughness at either end
DARK_LIPS = 0.35  # share of the default lips' contrast that the darkest skin has


def colours_of(known: Mapping[str, float]) -> dict[str, Finish]:
    """Material -> what it is made of, for a person. known : ROWS' parameters by name."""
    value = {name: float(known.get(name, default)) for name, default in DEFAULTS.items()}
    if value == DEFAULTS:
        return PLAIN
    plain = {name: np.array(finish.colour[:3]) for name, finish in PLAIN.items()}
    skin = plain["skin"] * _skin(value) / _skin(DEFAULTS)
    iris = _between(_IRISES, value["iris_colour"])
    brows = _between(_BROWS, value["brow_colour"])
    brows = brows + value["brow_grey"] * (_GREY - brows)
    under = (plain["brow_skin"] - plain["brows"]) / (plain["skin"] - plain["brows"])
    gloss = PLAIN["skin"].roughness - GLOSS * value["skin_gloss"]
    found = {
        "skin": skin, "lips": _lips(skin, value), "iris": iris, "brows": brows,
        "brow_skin": brows + under * (skin - brows),
    }  # fmt: skip
    roughness = {"skin": gloss, "brow_skin": gloss + 0.05}
    out = dict(PLAIN)
    for name, colour in found.items():
        red, green, blue = np.clip(colour, 0, 1).tolist()
        out[name] = Finish((red, green, blue, 1.0), roughness.get(name, PLAIN[name].roughness))
    return out


def drawn_looks(
    rng: np.random.Generator, identity: Mapping[str, float] | None = None
) -> dict[str, float]:
    """The colours of somebody, by lot: as many as there are people, not one like the other.

    identity : who it is; shares of ethnicity move the middle of the skin's tone, and age greys
    """
    who = identity or {}
    shares = np.array([who.get(name, 1.0) for name in ("african", "asian", "caucasian")])
    shares = shares / shares.sum() if shares.sum() > 0 else np.full(3, 1 / 3)
    tone = float(np.clip(rng.normal(shares @ (0.72, 0.38, 0.27), 0.13), 0, 1))
    light = rng.random() < 0.75 * shares[2] * np.clip(1.6 - 3 * tone, 0, 1)  # eyes and hair
    iris = rng.uniform(0.4, 1.0) if light else rng.beta(1.3, 4) * 0.45
    brow = rng.uniform(0.0, 0.8) if light else rng.uniform(0.72, 1.0)
    grey = np.clip(rng.normal(1.4 * max(who.get("age", 0.0), 0.0) - 0.5, 0.25), 0, 1)
    drawn = {
        "skin_tone": tone,
        "skin_redness": np.clip(rng.normal(0, 0.4), -1, 1),
        "skin_gloss": np.clip(rng.normal(0, 0.35), -1, 1),
        "lip_colour": np.clip(rng.normal(0, 0.35), -1, 1),
        "iris_colour": iris,
        "brow_colour": brow,
        "brow_grey": grey,
    }
    return {name: round(float(number), 4) for name, number in drawn.items()}


def _skin(value: Mapping[str, float]) -> NDArray[np.float64]:
    """Linear RGB of a skin."""
    light, a, b = _between(_TONES, value["skin_tone"])
    red = value["skin_redness"]
    way = np.array(RUDDY if red > 0 else SALLOW) * abs(red) * (0.35 + 0.65 * light / 85)
    return _linear(light - 1.5 * max(red, 0), a + way[0], b + way[1])


def _lips(skin: NDArray, value: Mapping[str, float]) -> NDArray[np.float64]:
    """Linear RGB of the lips on a skin: their contrast fades as the skin gets darker."""
    plain = np.array(PLAIN["skin"].colour[:3])
    contrast = np.array(PLAIN["lips"].colour[:3]) / plain
    dark = 1 - np.clip(skin.mean() / plain.mean(), 0, 1)
    lips = skin * contrast ** (1 - (1 - DARK_LIPS) * dark)
    way = value["lip_colour"]
    if way > 0:
        return lips + 0.9 * way * (_RED_LIPS * (1 - 0.5 * dark) - lips)
    return lips - 0.75 * way * (skin * (0.97, 0.88, 0.9) - lips)


def _between(table: NDArray, at: float) -> NDArray[np.float64]:
    """(3,) a row of the table (k, 4) at a value of its first column, or between rows."""
    return np.array([np.interp(at, table[:, 0], column) for column in table[:, 1:].T])


def _linear(light: float, a: float, b: float) -> NDArray[np.float64]:
    """CIELAB (D65) as linear RGB of the sRGB primaries (CIE 15:2004, IEC 61966-2-1)."""
    y = (light + 16) / 116
    ratio = np.array([y + a / 500, y, y - b / 200])
    xyz = np.where(ratio > 6 / 29, ratio**3, 3 * (6 / 29) ** 2 * (ratio - 4 / 29))
    xyz = xyz * (0.95047, 1.0, 1.08883)
    primaries = np.array([(3.2406, -1.5372, -0.4986), (-0.9689, 1.8758, 0.0415),
                          (0.0557, -0.2040, 1.0570)])  # fmt: skip
    return np.clip(primaries @ xyz, 0.002, 1)
