"""An artist: which convention each feature is drawn by, and how it is exaggerated.

Artists are drawn by lot from four manners, each with its own odds for every convention; now and
then one borrows from another manner. What a convention cannot show is told (`hidden`).
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

import numpy as np

from facs_rig import CONTROL_NAMES
from facs_rig.common.errors import InputError
from facs_rig.parameters import nearest

from ..linework.style import Style

# portrait: somebody is drawn from life        comic: inked, expressive
# cartoon: few bold shapes                     naive: from memory, by hands without practice
MANNERS = {"portrait": 0.42, "comic": 0.21, "cartoon": 0.23, "naive": 0.14}
PENS = (0.8, 5.5)  # pixels, widths of a full line
BARES = 0.4  # how often a stretched or smiling mouth is drawn with clenched teeth
BORROWS = 0.08  # how often a convention is taken from another manner
BEARDLESS = -0.4  # `age` up to which nobody has a beard, 17 years (see facs_rig.macros)

# Of each manner: how much it exaggerates, how large and how tall its eyes are, the factor of its
# pen's width, how much room its pages have, the most that a line is off, in units, how large its
# mouths are, how far the brows of a face at rest are level, not as its bones have them (which looks
# stern in few lines), and the most that it overdoes an expression.
MUCH = {"portrait": 0.35, "comic": 0.8, "cartoon": 1.3, "naive": 1.0}
BIG = {"portrait": 1.1, "comic": 1.12, "cartoon": 1.2, "naive": 1.12}
TALL = {"portrait": 1.22, "comic": 1.3, "cartoon": 1.35, "naive": 1.3}
BOLD = {"portrait": (0.7, 1.15), "comic": (0.9, 1.5), "cartoon": (1.0, 2.5), "naive": (0.7, 1.15)}
ROOM = {
    "portrait": (0.95, 1.35),
    "comic": (1.0, 1.45),
    "cartoon": (1.05, 1.5),
    "naive": (1.05, 1.5),
}
LOOSE = {"portrait": 0.005, "comic": 0.008, "cartoon": 0.008, "naive": 0.02}
MOUTH = {"portrait": 1.0, "comic": 0.97, "cartoon": 0.85, "naive": 0.95}
LEVEL = {"portrait": (0.0, 0.5), "comic": (0.2, 1.0), "cartoon": (0.4, 1.3), "naive": (0.3, 1.2)}
OVERDO = {"portrait": 1.5, "comic": 2.5, "cartoon": 4.0, "naive": 3.0}

Odds = tuple[float, float, float, float]  # in the order of MANNERS
CONVENTIONS: dict[str, dict[str, Odds]] = {
    "eye": {"almond": (6, 3, 0.7, 3), "lids": (4, 3, 0.5, 0.5), "upper": (1, 2, 1, 0.6),
            "dot": (0, 0.3, 3.5, 1.5), "oval": (0, 0.5, 1.5, 0.4), "round": (0, 0.6, 2, 1.4)},
    "iris": {"ring": (2, 1.5, 1, 2), "black": (1, 2, 2, 1.5), "shine": (4, 2, 1, 0.6),
             "rays": (2, 0.3, 0, 0.3)},
    "fold": {"none": (1, 2, 4, 3), "line": (4, 2, 0.5, 1), "double": (1, 0.3, 0, 0)},
    "lashes": {"none": (3, 3, 4, 3), "ticks": (1, 0.5, 1, 2), "thick": (3, 2, 1, 0.3),
               "flick": (0.7, 1, 1, 0.4)},
    "brow": {"stroke": (0.6, 2, 3, 2), "taper": (1, 2, 1.5, 0.6), "shape": (1.5, 3, 1.5, 0.3),
             "outline": (0.3, 0.3, 0.3, 1), "hairs": (5, 0.8, 0, 1), "double": (0.5, 0.3, 0.3, 1),
             "none": (0.05, 0.1, 0.35, 0.15)},
    "nose": {"l": (0.4, 2, 2, 2), "u": (0.7, 0.7, 2, 2), "ball": (1, 0.6, 1, 0.6),
             "dots": (0.2, 0.3, 1, 1), "wings": (2, 1.2, 0.7, 0.8), "side": (0.6, 1, 1, 0.8),
             "hook": (0.4, 1.5, 2, 0.8), "full": (5, 1.2, 0.1, 0.8), "sides": (2, 0.5, 0.2, 2),
             "base": (1.2, 1.2, 0.7, 0.3), "none": (0, 0, 0.25, 0.1)},
    "mouth": {"line": (0.3, 1.5, 4, 2), "lower": (1.5, 2, 1, 1), "lips": (5, 1.5, 0.4, 3),
              "dark": (2, 1, 0.3, 0.3), "corners": (0.7, 1.5, 1.5, 0.4)},
    "open": {"outline": (1, 0.6, 1, 2), "black": (1.2, 2.5, 3, 1), "teeth": (3, 3, 2, 1.2),
             "tongue": (0.5, 1.5, 2, 0.8), "grid": (0.7, 0.6, 1, 2), "rows": (0.7, 1, 1, 1)},
    "ear": {"c": (0.7, 1.5, 2.5, 2.5), "inner": (2, 2, 2, 1), "full": (4, 1, 0.2, 0.3),
            "none": (0.3, 0.2, 0.6, 0.6)},
    "jaw": {"smooth": (4, 2, 3, 3), "v": (1, 1.5, 0.7, 0.8), "box": (0.8, 1.5, 1, 0.7),
            "round": (0.5, 0.6, 2, 2), "open": (2, 0.7, 0.2, 0.2)},
    "crease": {"none": (0.7, 0.7, 2.5, 2), "one": (2, 3, 2, 2), "two": (2, 2, 0.5, 0.6),
               "all": (2, 0.7, 0.1, 0.1)},
    "crow": {"none": (1, 1, 2, 2), "ticks": (1, 2, 1, 1), "curves": (2, 1, 0.1, 0.2)},
    "cheek": {"none": (1, 1.5, 4, 3), "short": (2, 1.5, 0.5, 0.7), "long": (2, 1, 0.3, 0.8)},
    "chin": {"none": (1, 1.5, 4, 3), "arc": (3, 1.5, 0.5, 0.7), "dimple": (0.5, 0.8, 0.2, 0.2)},
    "neck": {"lines": (3, 3, 4, 3), "muscle": (2, 0.7, 0, 0), "none": (0.3, 0.5, 0.7, 1.2)},
    "shade": {"none": (2, 4, 6, 5), "neck": (1.5, 1, 0.3, 0.3), "nose": (1, 0.6, 0.2, 0.5),
              "side": (1, 1, 0.3, 0.4), "full": (2.5, 0.7, 0.1, 0.2),
              "planes": (2.5, 0.7, 0.1, 0.3)},
    "clothes": {"none": (0.7, 1, 1.5, 2), "slope": (1.5, 1, 2, 1.5), "crew": (1, 1, 2, 1),
                "v": (1, 0.7, 0.4, 0.5), "shirt": (2, 1.5, 0.5, 0.6), "suit": (1.3, 1, 0.3, 0.2)},
    "finish": {"outline": (0.6, 1.2, 1.5, 2.5), "black": (1.2, 2.5, 3, 0.8),
               "strands": (6, 1.5, 0.3, 1.6), "hatch": (1.5, 0.8, 0.3, 0.8),
               "curls": (0.4, 0.3, 0.4, 0.8),
               "locks": (6, 3, 0.5, 0.8)},
}  # fmt: skip
# The cut of the hair: odds for a woman, and for a man.
CUTS: dict[str, tuple[float, float]] = {
    "bald": (0.15, 1.0), "receding": (0.05, 1.0), "crop": (0.3, 2.5), "short": (0.7, 3.0),
    "swept": (0.5, 2.2), "fringe": (1.0, 0.8), "bob": (2.5, 0.2), "long": (4.0, 0.35),
    "bun": (1.0, 0.1), "afro": (0.6, 0.5), "tufts": (0.3, 0.8), "tail": (1.0, 0.15),
    "rim": (0.02, 0.9), "quiff": (0.3, 1.2), "flat": (0.15, 0.6), "shorn": (0.25, 1.4),
}  # fmt: skip
# By what else artists tell a woman from a man: factors of a convention's odds.
TELLING: dict[str, dict[str, tuple[float, float]]] = {
    "lashes": {"none": (0.35, 1.8), "ticks": (2.0, 0.25), "thick": (1.6, 0.5), "flick": (2.0, 0.1)},
    "brow": {"stroke": (0.8, 1.2), "taper": (1.6, 0.6), "shape": (0.6, 1.5), "hairs": (0.8, 1.2)},
    "mouth": {"line": (0.5, 1.5), "lips": (1.5, 0.6), "dark": (2.0, 0.5)},
    "jaw": {"v": (1.3, 0.7), "box": (0.2, 2.0), "smooth": (1.2, 0.9)},
    "cheek": {"none": (1.4, 0.8), "long": (0.5, 1.4)},
    "chin": {"dimple": (0.3, 1.7)},
    "neck": {"muscle": (0.4, 1.5)},
    "clothes": {"shirt": (0.6, 1.4), "suit": (0.3, 1.7)},
}
BROW_SIZE, EYE_SIZE = (0.85, 1.15), (1.05, 0.96)  # of a woman's and a man's, as they are drawn
BEARDS = {"none": 5.0, "stubble": 0.45, "shadow": 0.35, "jawline": 0.2, "outline": 0.3,
          "hairs": 0.5, "full": 0.75, "black": 0.35, "goatee": 0.35, "circle": 0.35, "strip": 0.12,
          "patch": 0.08}  # fmt: skip
MOUSTACHES = {"none": 5.0, "line": 0.2, "hairs": 0.4, "black": 0.25, "pencil": 0.2, "brush": 0.3,
              "horseshoe": 0.15, "handlebar": 0.12, "halves": 0.2, "few": 0.18,
              "white": 0.1}  # fmt: skip
JOINED = ("full", "circle")  # beards that hardly anybody wears without a moustache
# Moustaches that go with a beard, of which most are; others with them are of two colours or ways.
FITTING = {
    "full": ("hairs", "brush", "horseshoe", "halves", "handlebar"),
    "circle": ("hairs", "brush", "horseshoe", "halves", "black"),
    "black": ("black", "brush", "handlebar"),
    "outline": ("white", "few", "handlebar"),
}
FITS = 0.8  # how often a moustache is one of those
GLASSES = {"none": 8.0, "round": 0.6, "square": 0.7, "half": 0.25, "dark": 0.12}
# How lips are drawn, above all shut ones, and teeth, where they are not drawn as `mouth` and `open`
# say, "plain" (see `lips`, `teeth`); and in each manner how many artists draw them so.
LIPPED = {"portrait": 0.8, "comic": 0.55, "cartoon": 0.12, "naive": 0.25}
LIPS = {"plain": 0.0, "contour": 1.3, "shaded": 1.5, "dark": 0.8, "upper": 0.7, "line": 1.0,
        "wedge": 0.6}  # fmt: skip
TEETH = {"plain": 0.5, "row": 1.5, "edge": 1.3, "ticks": 0.8, "grey": 0.7, "gums": 0.3,
         "sliver": 0.4}  # fmt: skip
HATS = {"none": 12.0, "cap": 0.32, "skullcap": 0.2, "brim": 0.27, "beanie": 0.42, "band": 0.1,
        "headband": 0.12, "wreath": 0.12, "bow": 0.15, "scarf": 0.15, "veil": 0.15, "bandana": 0.12,
        "tall": 0.15, "wrap": 0.25, "hood": 0.13, "helmet": 0.1, "flat": 0.1}  # fmt: skip
BANDS = ("band", "headband", "wreath", "bow")  # they leave most of the hair to be seen

# Mouths that comics draw as one bold shape, larger than the sitter's own: how often open ones are,
# and by which. Their width in widths of the sitter's, their height in their own width, how far they
# are shifted aside, in the same, their tilt in radians, and the factor of the pen's width.
GRINNING = {"portrait": 0.0, "comic": 0.2, "cartoon": 0.35, "naive": 0.1}
GRINS = {"none": 0.0, "oval": 1.0, "box": 1.2, "bean": 1.0, "trapezoid": 0.8, "crescent": 1.0}
GRIN_WIDE, GRIN_TALL, GRIN_ASIDE, GRIN_TILT = (0.85, 1.9), (0.26, 0.7), 0.12, 0.06
GRIN_BOLD = (0.8, 2.6)

# Controls whose names begin so cannot be seen where a feature is drawn by this convention.
HIDES: dict[tuple[str, str], tuple[str, ...]] = {
    ("eye", "dot"): ("squint", "lid_raise"),
    ("eye", "upper"): ("squint",),
    ("brow", "none"): ("outer_frontalis",),
    ("nose", "l"): ("nostril_",), ("nose", "u"): ("nostril_",),
    ("nose", "side"): ("nostril_",), ("nose", "hook"): ("nostril_",),
    ("nose", "none"): ("nostril_", "wince"), ("nose", "dots"): ("nostril_flare",),
    ("mouth", "line"): ("lip_tighten", "lip_lock", "lip_loosen"),
    ("mouth", "corners"): ("lip_tighten", "lip_lock", "lip_loosen"),
    ("mouth", "lower"): ("lip_tighten_upper", "lip_lock_upper"),
    ("lips", "line"): ("lip_tighten", "lip_lock", "lip_loosen"),
    ("crease", "none"): ("nasolabial_deepen", "cheek_suck"),
    ("crow", "none"): ("outer_squint",),
    ("jaw", "round"): ("cheek_suck", "cheek_puff", "jaw_forward"),
    ("jaw", "box"): ("cheek_suck", "cheek_puff"), ("jaw", "open"): ("cheek_suck", "cheek_puff"),
    ("glasses", "dark"): ("squint", "outer_squint", "blink", "lid_raise"),
    ("beard", "black"): ("shrug", "cheek_suck", "cheek_puff"),
    ("beard", "hairs"): ("shrug", "cheek_suck"),
    ("beard", "full"): ("shrug", "cheek_suck", "cheek_puff"),
    ("beard", "circle"): ("shrug",),
    ("moustache", "brush"): ("lip_loosen_upper", "lip_tighten_upper", "lip_lock_upper"),
    ("moustache", "black"): ("lip_loosen_upper", "lip_tighten_upper", "lip_lock_upper"),
}  # fmt: skip


@dataclass(frozen=True)
class Artist:
    """How one artist draws. Lengths are shares of the face's unit, sizes factors of the face's own.

    manner, eye to finish : of MANNERS and CONVENTIONS        cut, beard, moustache, glasses, hat :
    of CUTS and so on        bold : factor of the pen's width        loose : how far lines are off
    room : how much larger than the face's own frame the page is
    eyes, eye_tall, iris_size, brow_size, nose_size, mouth_size, ear_size, jaw_size : factors
    eye_shift, brow_shift, nose_shift, mouth_shift : (across, down) of the unit
    wide, tall : factors of the whole head        freckles, earring : whether there are any
    overdo : how many times as far as the face's own its brows and mouth go in an expression
    level : how much of their slope brows at rest are drawn without
    bares : whether who smiles or stretches the mouth shows clenched teeth
    lips, teeth : of LIPS and TEETH, by which they are drawn instead
    grin : of GRINS, by which shape open mouths are drawn; the rest of it: see GRINNING
    volume : how far hair stands off the skull    reach : how far it falls, in units
    parting : where hair parts, -1 to 1, from the picture's left to its right
    hair_tone : how dark hair in locks is drawn, from 0, lines alone, to 1, nearly black
    """

    manner: str = "portrait"
    eye: str = "almond"
    iris: str = "shine"
    fold: str = "line"
    lashes: str = "none"
    brow: str = "taper"
    nose: str = "wings"
    mouth: str = "lips"
    open: str = "teeth"
    ear: str = "inner"
    jaw: str = "smooth"
    crease: str = "two"
    crow: str = "ticks"
    cheek: str = "none"
    chin: str = "none"
    neck: str = "lines"
    shade: str = "none"
    clothes: str = "none"
    finish: str = "outline"
    cut: str = "short"
    beard: str = "none"
    moustache: str = "none"
    glasses: str = "none"
    hat: str = "none"
    freckles: bool = False
    bares: bool = False
    lips: str = "plain"
    teeth: str = "plain"
    grin: str = "none"
    grin_wide: float = 1.2
    grin_tall: float = 0.4
    grin_aside: float = 0.0
    grin_tilt: float = 0.0
    grin_bold: float = 1.0
    earring: bool = False
    bold: float = 1.0
    loose: float = 0.0
    room: float = 1.3
    overdo: float = 1.0
    level: float = 0.0
    eyes: float = 1.0
    eye_tall: float = 1.2
    iris_size: float = 1.0
    brow_size: float = 1.0
    nose_size: float = 1.0
    mouth_size: float = 1.0
    ear_size: float = 1.0
    jaw_size: float = 1.0
    eye_shift: tuple[float, float] = (0.0, 0.0)
    brow_shift: tuple[float, float] = (0.0, 0.0)
    nose_shift: tuple[float, float] = (0.0, 0.0)
    mouth_shift: tuple[float, float] = (0.0, 0.0)
    wide: float = 1.0
    tall: float = 1.0
    volume: float = 0.12
    reach: float = 1.5
    parting: float = 0.0
    hair_tone: float = 0.5

    def __post_init__(self) -> None:
        tables: dict[str, Mapping] = {"manner": MANNERS, **CONVENTIONS, **EXTRAS}
        for name, table in tables.items():
            value = getattr(self, name)
            if value not in table:
                hint = nearest(str(value), tuple(table)) or f"; choose from: {', '.join(table)}"
                raise InputError(f"no artist draws the {name} as '{value}'{hint}")

    @property
    def crowned(self) -> bool:
        """Whether the hat hides the skull and the hair on it."""
        return self.hat not in ("none", *BANDS)

    @property
    def hidden(self) -> tuple[str, ...]:
        """The controls that these conventions cannot show, in the order of the catalogue."""
        stems = [s for (name, how), hides in HIDES.items() if getattr(self, name) == how
                 for s in hides]  # fmt: skip
        return tuple(name for name in CONTROL_NAMES if any(_is(name, stem) for stem in stems))

    def styled(self, style: Style) -> Style:
        """The style in which this artist's lines are drawn: nothing that was meant is left out, and
        there is no graphite, which knows the skull and neither hair nor hat as drawn."""
        width = float(np.clip(style.width * self.bold, *PENS))
        return replace(style, width=round(width, 4), dropout=0.0, layers=(), graphite=0.0)

    def to_json(self) -> dict:
        """All fields, as JSON knows them."""
        return {name: list(v) if isinstance(v, tuple) else v for name, v in asdict(self).items()}

    @classmethod
    def from_json(cls, stored: Mapping) -> Artist:
        """The artist of `to_json`; InputError for a field that no artist has."""
        known = tuple(field.name for field in fields(cls))
        for name in stored:
            if name not in known:
                raise InputError(f"an artist has no '{name}'{nearest(name, known)}")
        values: dict = {n: tuple(v) if isinstance(v, list) else v for n, v in stored.items()}
        return cls(**values)


EXTRAS: dict[str, Mapping] = {"cut": CUTS, "beard": BEARDS, "moustache": MOUSTACHES,
                              "glasses": GLASSES, "hat": HATS, "grin": GRINS, "lips": LIPS,
                              "teeth": TEETH}  # fmt: skip


def _is(name: str, stem: str) -> bool:
    """Whether a control is this one, one of its sides, or of a family that ends in _."""
    return name == stem or name.startswith(stem if stem.endswith("_") else f"{stem}_")


def sample_artist(
    rng: np.random.Generator,
    identity: Mapping[str, float],
    manner: str | None = None,
    worn: float = 1.0,
    grins: float | None = None,
    finish: str | None = None,
) -> Artist:
    """A random artist for a sitter: whom beards and hats become is decided by `identity`.

    manner : of MANNERS, else by their odds. Raises InputError for another name.
    worn : times as often as usual somebody has a beard, a moustache or a hat rather than none
    grins : how many draw open mouths as one bold shape, else as many as are usual in their manner
    finish : in which hair is drawn, else by lot
    """
    if manner is not None and manner not in MANNERS:
        raise InputError(f"there is no manner '{manner}'; choose from: {', '.join(MANNERS)}")
    order = tuple(MANNERS)
    manner = manner or lot(rng, MANNERS)
    man = float(identity.get("gender", 0.5))
    chosen: dict[str, Any] = {}
    for name, table in CONVENTIONS.items():
        of = order.index(manner if rng.random() > BORROWS else lot(rng, MANNERS))
        telling = TELLING.get(name, {})
        chosen[name] = lot(
            rng,
            {
                how: odds[of] * _of_sex(man, telling.get(how, (1.0, 1.0)))
                for how, odds in table.items()
            },
        )
    age = float(identity.get("age", 0.0))
    old = max(age, 0.0)
    cuts = {cut: (1 - man) * woman + man * odds for cut, (woman, odds) in CUTS.items()}
    cuts["receding"] *= 0.4 + 2 * old
    for cut in ("bald", "rim"):
        cuts[cut] *= 0.4 + 1.5 * old
    bearded = rng.random() < np.clip(1.6 * man - 0.8, 0, 1) and age > BEARDLESS
    beard, moustache = _grown(rng, worn) if bearded else ("none", "none")
    # How much is exaggerated: a portrait hardly, a cartoon much.
    much, big = MUCH[manner], BIG[manner]

    def near(middle: float, spread: float) -> float:
        return round(float(np.clip(middle * np.exp(much * spread * rng.normal()), 0.55, 1.9)), 3)

    def within(low: float, high: float, digits: int) -> float:
        return round(float(rng.uniform(low, high)), digits)

    def shift(across: float, along: float) -> tuple[float, float]:
        a, b = np.clip(much * rng.normal(0, (across, along)), -0.06, 0.06)
        return round(float(a), 4), round(float(b), 4)

    cut = lot(rng, cuts)
    reach = rng.uniform(0.65, 1.15) if cut == "bob" else rng.uniform(1.2, 2.3)
    artist = Artist(
        manner=manner, **chosen, cut=cut,
        beard=beard, moustache=moustache,
        glasses=lot(rng, GLASSES), hat=lot(rng, _more(HATS, worn)),
        bares=bool(rng.random() < BARES), freckles=bool(rng.random() < 0.04),
        earring=bool(rng.random() < 0.1 * (1 - man) + 0.01),
        bold=within(*BOLD[manner], 3), loose=round(LOOSE[manner] * within(0.1, 1.0, 3), 5),
        room=within(*ROOM[manner], 3), overdo=within(1.0, OVERDO[manner], 3),
        level=within(*LEVEL[manner], 3),
        eyes=near(big * _of_sex(man, EYE_SIZE), 0.1), eye_tall=near(TALL[manner], 0.1),
        iris_size=near(0.98, 0.1),
        brow_size=near(1.12 * _of_sex(man, BROW_SIZE), 0.22),
        nose_size=near(1.0 / big**0.6, 0.12), mouth_size=near(MOUTH[manner], 0.16),
        ear_size=near(1.0, 0.15), jaw_size=near(1.0, 0.05),
        eye_shift=shift(0.012, 0.025), brow_shift=shift(0.01, 0.025), nose_shift=shift(0.015, 0.03),
        mouth_shift=shift(0.015, 0.025), wide=near(1.0, 0.045), tall=near(1.0, 0.045),
        volume=within(0.06, 0.38, 3), reach=round(float(reach), 3),
        parting=round(float(np.clip(rng.normal(0, 0.35), -0.8, 0.8)), 3),
        hair_tone=within(0.0, 1.0, 3),
    )  # fmt: skip
    artist = artist if finish is None else replace(artist, finish=finish)
    artist = _grinning(artist, rng, GRINNING[manner] if grins is None else grins)
    return _lipped(artist, rng)


def _grinning(artist: Artist, rng: np.random.Generator, share: float) -> Artist:
    """The artist, which so many of are given a shape for open mouths; not over a beard's lines."""
    # By a generator of its own, so that all others draw as they did.
    own = np.random.default_rng(copy.deepcopy(rng).integers(2**63))
    if own.random() >= share or (artist.beard, artist.moustache) != ("none", "none"):
        return artist
    wide, tall, bold = (
        round(float(own.uniform(*of)), 3) for of in (GRIN_WIDE, GRIN_TALL, GRIN_BOLD)
    )
    aside, tilt = (round(float(of * own.normal()), 4) for of in (GRIN_ASIDE / 2, GRIN_TILT))
    return replace(artist, grin=lot(own, GRINS), grin_wide=wide, grin_tall=tall, grin_aside=aside,
                   grin_tilt=tilt, grin_bold=bold)  # fmt: skip


def _lipped(artist: Artist, rng: np.random.Generator) -> Artist:
    """The artist, by lot with lips and teeth of their own."""
    own = np.random.default_rng([copy.deepcopy(rng).integers(2**63), 1])  # see `_grinning`
    if own.random() >= LIPPED[artist.manner]:
        return artist
    return replace(artist, lips=lot(own, LIPS), teeth=lot(own, TEETH))


def _grown(rng: np.random.Generator, worn: float) -> tuple[str, str]:
    """A man's beard and moustache, either of which may be none."""
    beard, moustache = (lot(rng, _more(table, worn)) for table in (BEARDS, MOUSTACHES))
    if beard in JOINED and moustache == "none":
        moustache = lot(rng, {**MOUSTACHES, "none": 0.1})
    if moustache != "none" and beard in FITTING and rng.random() < FITS:
        moustache = lot(rng, {name: MOUSTACHES[name] for name in FITTING[beard]})
    return beard, moustache


def _more(odds: Mapping[str, float], times: float) -> dict[str, float]:
    """Odds of which `none` is so many times as rare."""
    return {**odds, "none": odds["none"] / times}


def _of_sex(man: float, factors: tuple[float, float]) -> float:
    """What lies between a woman's and a man's factor; man : 0 to 1."""
    woman, mans = factors
    return float(woman ** (1 - man) * mans**man)


def lot(rng: np.random.Generator, odds: Mapping[str, float]) -> str:
    """One of the names, by its odds."""
    left = rng.random() * sum(odds.values())
    for name, share in odds.items():
        left -= share
        if left < 0:
            return name
    return name  # rounding left a last bit over
