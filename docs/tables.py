"""Keep the tables of docs/ true: of the face, from the catalogue and the shipped head; of the data
set, from the sampler itself.

    python docs/tables.py            # write them anew
    python docs/tables.py --check    # only say whether they are true

They stand between lines such as `<!-- controls: made by docs/tables.py -->` and `<!-- end -->`.
"""

from __future__ import annotations

import re
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray

from dataset_gen.generate import SIZE
from dataset_gen.hairdo import FINISHES, HAIR, WORN
from dataset_gen.linework.lines import DETAILS, KINDS
from dataset_gen.linework.style import Style
from dataset_gen.samples import hairdo_of
from dataset_gen.sampling import Sample, sample_face, sample_rng, second_rng
from dataset_gen.styles import HAIR as OLD_CUTS
from dataset_gen.styles import LAYER_ODDS, LOOKS, PAPERS
from facs_rig import (
    CONTROL_NAMES,
    CONTROLS,
    FULL_INTENSITY,
    IDENTITY,
    TWELVE,
    Control,
    folds,
    load_rig,
)
from facs_rig.actions import TABLE as OWN_WAYS
from facs_rig.anatomy import PART_NAMES
from facs_rig.common.errors import InputError
from facs_rig.conventions import CONVENTIONS
from facs_rig.identity import ETHNICITIES, FEATURES
from facs_rig.macros import years
from facs_rig.parameters import ANGLES, intensities
from facs_rig.retarget import retarget, unshown
from facs_rig.stylised import is_stylised
from snakes import LINE_TWEAKABLES, LINES_ALONE
from snakes.tweakables import describe

SCHEMES = ("people", "thesis")  # the others do as people does, but for who the people are
DOCS = Path(__file__).parent
REGIONS = {"upper": "Upper face", "mid": "Mid face", "lower": "Lower face"}
FOLDERS = {"": "Who", "head": "Head", "forehead": "Forehead", "eyes": "Eyes", "eyebrows": "Brows",
           "nose": "Nose", "mouth": "Mouth", "cheek": "Cheeks", "chin": "Chin and jaw",
           "ears": "Ears", "neck": "Neck", "asym": "Left and right", "actions": "Own ways",
           "colours": "Colours"}  # fmt: skip


def controls() -> str:
    """The 47 controls, a table for each third of the face."""
    out = []
    for region, title in REGIONS.items():
        mine = [c for c in CONTROLS if c.region == region]
        out.append(f"### {title}: {len(mine)}\n")
        out.append("| control | label | AU | muscle | what it looks like | made of | creases |")
        out.append("|---|---|---|---|---|---|---|")
        for c in mine:
            creases = ", ".join(name.replace("_", " ") for name in c.creases)
            cells = (f"`{c.name}`", c.label, " + ".join(c.aus), c.muscle, c.signature,
                     made_of(c), creases)  # fmt: skip
            out.append(f"| {' | '.join(cells)} |")
        out.append("")
    return "\n".join(out).rstrip()


def made_of(control: Control) -> str:
    """A control's mix: both sides as one, and a side in a word where there is a whole."""
    action = control.name.removesuffix("_left").removesuffix("_right")
    if control.side != "both" and any(c.name == action for c in CONTROLS):
        return f"the {control.side} of `{action}`"
    parts: dict[str, float] = {}
    for name, weight in control.mix:
        plain = re.sub(r"\|(left|right)$", "", name)
        if control.side == "both":
            plain = re.sub(r"(Left|Right)(?=\^|$)", "", plain).replace("-left-", "-")
            plain = plain.replace("-right-", "-")
        parts[plain.split("/")[-1].replace("^", ", ")] = weight
    return "; ".join(f"{name} {weight:g}" for name, weight in parts.items())


def identity() -> str:
    """The identity's parameters, grouped by the part of the head."""
    out = [
        "| parameter | what it is | from | to | default | stylised |",
        "|---|---|---|---|---|---|",
    ]
    for folder, title in FOLDERS.items():
        for f in (f for f in IDENTITY if f.part == folder):
            limits = f"{f.minimum:g} | {f.maximum:g} | {f.default:.3g}"
            far = f"{f.style[0]:g} to {f.style[1]:g}" if f.style else ""
            out.append(f"| `{f.name}` | {title}: {f.label} | {limits} | {far} |")
    out.append(f"| `{folds.SEED}` | Creases: Crease pattern | 0 | {folds.SEEDS} | 0 |  |")
    for family, (label, _) in folds.FAMILIES.items():
        names = ", ".join(f"`{family}_{trait}`" for trait in folds.TRAITS)
        out.append(f"| {names} | Creases: {label} | -1 | 1 | 0 |  |")
    return "\n".join(out)


def one_for_both(keys: Iterable[str]) -> dict[str, str]:
    """Key of a convention -> its name without the side, where both sides have it."""
    keys = set(keys)
    out = {}
    for key in keys:
        stem = re.sub(r"_?(Left|Right|L|R)$", "", key)
        pairs = ((f"{stem}{a}", f"{stem}{b}") for a, b in (("Left", "Right"), ("L", "R")))
        out[key] = stem if any(keys.issuperset(pair) for pair in pairs) else key
    return out


def conventions() -> str:
    """How much of the face each convention of other rigs has words for."""
    out = [
        "| convention | keys that are set | of our 47 controls | no key for |",
        "|---|---|---|---|",
    ]
    for c in CONVENTIONS.values():
        lost = unshown({name: 1.0 for name in CONTROL_NAMES}, c, c.keys)
        names = ", ".join(f"`{name}`" for name in lost)
        if len(lost) > 8:
            names = "most that is no emotion, vowel or blink"
        out.append(f"| {c.label} | {len(c.keys)} | {len(CONTROL_NAMES) - len(lost)} | {names} |")
    return "\n".join(out)


def tweakables() -> str:
    """What an artist can tweak, in the order of the panel; which method looks at it."""
    out = ["| tweakable | as it comes | what it does | method |", "|---|---|---|---|"]
    for name, kind, default, about in describe():
        if name == "mirror":  # it stands in the panel above
            continue
        if kind is bool:
            value = "on" if default else "off"
        else:
            value = default if kind is str else f"{default:g} {about['unit']}".strip()
        both = "both" if name in LINE_TWEAKABLES else "Thesis"
        method = "By Lines" if name in LINES_ALONE else both
        out.append(f"| {about['label']} | {value} | {about['help']} | {method} |")
    return "\n".join(out)


def words() -> str:
    """What each action is in other rigs' words: keys and their values at intensity 5."""
    shown = [CONVENTIONS[name] for name in ("arkit", "metahuman", "vrm1", "vroid")]
    out = [f"| control | {' | '.join(c.label for c in shown)} |", "|---|" + "---|" * len(shown)]
    for control in CONTROLS:
        if control.side != "both" and control.name not in ("jaw_left", "jaw_right"):
            continue
        cells = []
        for c in shown:
            short = one_for_both(c.keys) if control.side == "both" else {key: key for key in c.keys}
            values = retarget({control.name: FULL_INTENSITY}, c.name)
            active = {short[key].removeprefix(c.prefix): v for key, v in values.items() if v}
            strongest = sorted(active.items(), key=lambda item: -item[1])
            cells.append("; ".join(f"{key} {value:.2g}" for key, value in strongest))
        out.append(f"| `{control.name}` | {' | '.join(cells)} |")
    return "\n".join(out)


def numbers() -> str:
    """How large the shipped head is."""
    rig = load_rig()
    starts = rig.polygon_starts
    polygons = int((starts < len(rig.polygon_vertices)).sum())
    creases = sum("crease" in key.name for key in rig.keys)
    helpers = len(rig.keys) - len(CONTROLS) - creases
    rows = (
        ("vertices", rig.n_vertices),
        ("polygons (quads, and triangles at the tips of hairs)", polygons),
        ("triangles", len(rig.triangles)),
        ("parts", ", ".join(PART_NAMES)),
        ("controls", len(CONTROLS)),
        ("shape keys that raise creases", creases),
        ("shape keys that keep lids and lips apart, and other correctives", helpers),
        ("identity parameters", len(IDENTITY)),
    )
    lines = [f"| {name} | {f'{n:,}' if isinstance(n, int) else n} |" for name, n in rows]
    return "\n".join(["| the shipped head | |", "|---|---|", *lines])


# --- the data set ---------------------------------------------------------------------------------

COUNT = 2000  # samples of each scheme that the figures are taken from
POINTS = (5, 25, 50, 75, 95)  # percentiles


@cache
def drawn(scheme: str) -> tuple[Sample, ...]:
    """The first COUNT samples of seed 0, without their drawings."""
    points = load_rig().neutral()[::500]
    # How a head is framed shows in none of the figures, and posing it would take most of the time.
    rig = SimpleNamespace(extent=lambda parameters: points)
    return tuple(sample_face(rig, sample_rng(0, k), SIZE, scheme) for k in range(COUNT))


def everything() -> tuple[Sample, ...]:
    """The samples of both schemes: for what they draw alike."""
    return sum((drawn(scheme) for scheme in SCHEMES), ())


def strengths(samples: Sequence[Sample]) -> NDArray[np.float32]:
    """(n, 47) intensities in the catalogue's order."""
    return np.array([intensities(sample.parameters.aus) for sample in samples])


def degrees(samples: Sequence[Sample], part: str) -> NDArray[np.float64]:
    """(n, 3) yaw, pitch, roll of head or neck; (n, 2) yaw, pitch of the gaze."""
    return np.degrees([getattr(sample.parameters, part) for sample in samples])


def identities(samples: Sequence[Sample], name: str) -> NDArray[np.float64]:
    """(n,) values of one parameter of the identity; a feature's is 0 where it is plain."""
    return np.array([sample.parameters.identity.get(name, 0.0) for sample in samples])


def percent(chosen: NDArray | Iterable[bool]) -> str:
    """The share of what is true, such as `12 %`."""
    return f"{100 * np.mean(list(chosen)):.0f} %"


def middle(values: NDArray, form: str = ".0f") -> str:
    """Median and, in brackets, what nine in ten lie between."""
    low, half, high = (f"{v:{form}}" for v in np.percentile(values, (5, 50, 95)))
    return f"{half} ({low} to {high})"


def sampled_actions() -> str:
    """How many actions a drawing has, and how strong, in each scheme."""
    ours = [name in TWELVE for name in CONTROL_NAMES]
    columns = []
    for scheme in SCHEMES:
        values = strengths(drawn(scheme))
        active = values > 0
        of = {c.name: active[:, k].sum() / active.sum() for k, c in enumerate(CONTROLS)}

        def share(what: str, where: str, of: dict[str, float] = of) -> str:
            names = [c.name for c in CONTROLS if getattr(c, what) == where]
            return f"{100 * sum(of[name] for name in names):.0f} %"

        columns.append(
            {
                "actions in a drawing": middle(active.sum(axis=1)),
                "of the twelve detected ones": middle(active[:, ours].sum(axis=1)),
                "drawings without any action": percent(~active.any(axis=1)),
                "strength of an action": middle(values[active], ".1f"),
                f"stronger than {FULL_INTENSITY:g}": percent(values[active] > FULL_INTENSITY),
                "both sides, left alone, right alone": ", ".join(
                    share("side", side) for side in ("both", "left", "right")
                ),
                "upper, mid, lower face": ", ".join(share("region", name) for name in REGIONS),
            }
        )
    rows = [f"| {what} | {' | '.join(c[what] for c in columns)} |" for what in columns[0]]
    return "\n".join([f"| | {' | '.join(SCHEMES)} |", "|---|---|---|", *rows])


def sampled_controls() -> str:
    """In how many drawings each of the detected controls is active, and the others."""
    values = [strengths(drawn(scheme)) > 0 for scheme in SCHEMES]
    cells = [
        f"`{name}` | {' | '.join(percent(v[:, CONTROL_NAMES.index(name)]) for v in values)}"
        for name in TWELVE
    ]
    rest = [k for k, name in enumerate(CONTROL_NAMES) if name not in TWELVE]
    ends = [f"{min(shares):.0f} to {max(shares):.0f} %"
            for shares in (100 * v[:, rest].mean(axis=0) for v in values)]  # fmt: skip
    heading = f"active in | {' | '.join(SCHEMES)}"
    half = len(cells) // 2
    rows = [f"| {a} | {b} |" for a, b in zip(cells[:half], cells[half:], strict=True)]
    last = f"| each of the other {len(rest)} | {' | '.join(ends)} | | | |"
    return "\n".join([f"| {heading} | {heading} |", "|---|---|---|---|---|---|", *rows, last])


def spread(rows: Iterable[tuple[str, NDArray]], form: str, what: str) -> str:
    """A table of percentiles, a row for each name and its values (n,)."""
    heading = " | ".join("median" if p == 50 else f"{p} %" for p in POINTS)
    out = [f"| {what} | {heading} | farthest |", "|---|" + "---|" * (len(POINTS) + 1)]
    for name, values in rows:
        ends = max(values.min(), values.max(), key=abs)
        cells = [f"{v + 0.0:{form}}" for v in (*np.percentile(values, POINTS).round(4), ends)]
        out.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(out).replace("| -0 |", "| 0 |").replace("| -0.00 |", "| 0.00 |")


def sampled_angles() -> str:
    """Percentiles of the angles, and of the gaze where the eyes look aside."""
    rows = []
    for part in ("head", "neck", "gaze"):
        values = degrees(everything(), part)
        if part == "gaze":
            values = values[values.any(axis=1)]
        for name, column in zip(ANGLES, values.T, strict=False):
            rows.append((f"{part}, {name}", column))
    return spread(rows, ".0f", "degrees")


def sampled_people() -> str:
    """Percentiles of who is drawn."""
    samples = drawn("people")
    rows = [("`gender`", identities(samples, "gender"))]
    rows.append(("years, of `age`", np.array([years(x) for x in identities(samples, "age")])))
    rows += [(f"`{name}`", identities(samples, name)) for name in ("weight", "muscle")]
    rows += [(f"`{name}`", identities(samples, name)) for name in ETHNICITIES]
    rows.append(("the largest of the three shares", np.max([v for _, v in rows[-3:]], axis=0)))
    for what, chosen in (("stylised", True), ("not stylised", False)):
        some = [s for s in samples if is_stylised(s.parameters.identity) == chosen]
        features = np.array([identities(some, f.name) for f in FEATURES])
        rows.append((f"a feature that is not plain, of people {what}", features[features != 0]))
    table = spread(rows, ".2f", "parameter")
    count = (features != 0).sum(axis=0)
    return f"{table}\n\nOf the {len(FEATURES)} features {middle(count)} are not plain."


def sampled_faces() -> str:
    """What kinds of people there are, and how many do and crease in which way."""
    who = [sample.parameters.identity for sample in drawn("people")]
    old = np.array([years(person["age"]) for person in who])
    man = np.array([person["gender"] for person in who])
    tone = np.array([person["skin_tone"] for person in who])

    def parts(values: NDArray, ends: Sequence[float], names: Sequence[str]) -> str:
        count = np.histogram(values, ends)[0] / len(values)
        return ", ".join(f"{name} {100 * x:.0f} %" for name, x in zip(names, count, strict=True))

    none = np.array([person["wrinkles"] == -1 for person in who])
    depths = [f"{family}_depth" for family in folds.FAMILIES]
    lacking = np.array([[person.get(depth, 0.0) == -1 for depth in depths] for person in who])
    some = ~none & lacking.any(axis=1)
    own = np.array([any(name in person for name in OWN_WAYS) for person in who])
    stylised = np.array([is_stylised(person) for person in who])
    rows = {
        "years": parts(old, (6, 12, 18, 30, 45, 60, 75, 90.01),
                       ("6 to 11", "12 to 17", "18 to 29", "30 to 44", "45 to 59", "60 to 74",
                        "75 to 90")),
        "sex": parts(man, (0, 1 / 3, 2 / 3, 1.01), ("women", "in between", "men")),
        "skin": parts(tone, (0, 1 / 3, 2 / 3, 1.01), ("light", "in between", "dark")),
        "without any crease": percent(none),
        "with creases of some groups alone": f"{percent(some)}, "
        f"{middle((~lacking[some]).sum(axis=1))} of {len(folds.FAMILIES)} groups",
        "with creases of their own of all groups": percent(~none & ~some),
        "who do everything in ways of their own": percent(own),
        "stylised": percent(stylised),
    }  # fmt: skip
    return "\n".join(["| people | |", "|---|---|", *(f"| {a} | {b} |" for a, b in rows.items())])


def paper_of(style: Style) -> str:
    """Which of PAPERS a style was drawn with."""
    if style.shadow:
        return "photo"
    if style.noise:
        return "scan"
    return "toned" if style.paper < 1 else "white"


def sampled_pages() -> str:
    """What a face is drawn with and on."""
    samples = everything()
    styles = [sample.style for sample in samples]
    layers = [set(style.layers) for style in styles]

    def shares(values: Iterable[str], order: Iterable[str]) -> str:
        count = Counter(values)
        total = count.total()
        return ", ".join(f"{name} {100 * count[name] / total:.0f} %" for name in order)

    far = np.array([sample.camera.distance for sample in samples])
    hair = [layer & {*OLD_CUTS} for layer in layers]
    rows = {
        "level of detail": shares((DETAILS[sample.detail] for sample in samples), DETAILS),
        "look": shares((style.look for style in styles), LOOKS),
        "paper": shares((paper_of(style) for style in styles), PAPERS),
        "layers": ", ".join(f"{a} {percent(a in layer for layer in layers)}" for a in LAYER_ODDS),
        "simple cuts, with `--hair 0` and in older schemes": f"{percent(map(bool, hair))} ("
        + ", ".join(f"{a.removeprefix('hair_')} {percent(a in h for h in hair)}" for a in OLD_CUTS)
        + ")",
        "hatching; graphite; construction lines": "; ".join(
            percent(getattr(s, name) > 0 for s in styles)
            for name in ("hatching", "graphite", "construction")
        ),
        "width of a full line, pixels": middle(np.array([s.width for s in styles]), ".1f"),
        "perspective": f"{percent(np.isfinite(far))}, from {middle(far[np.isfinite(far)], '.1f')} "
        "metres; the others orthographic",
    }
    return "\n".join(["| | |", "|---|---|", *(f"| {a} | {b} |" for a, b in rows.items())])


def sampled_hair() -> str:
    """Who wears which head of hair, and how it is drawn."""
    samples = drawn("people")
    worn = [hairdo_of(sample, HAIR, second_rng(0, k)) for k, sample in enumerate(samples)]
    man = np.array([sample.parameters.identity["gender"] for sample in samples])
    groups = [man < 1 / 3, (man >= 1 / 3) & (man < 2 / 3), man >= 2 / 3]
    names = np.array([hairdo.preset if hairdo else "none" for hairdo in worn])
    rows = ["| of | women | in between | men |", "|---|---|---|---|"]
    for name in ("none", *WORN):
        shares = [f"{100 * np.mean(names[group] == name):.0f} %" for group in groups]
        rows.append(f"| {name.replace('_', ' ')} | {' | '.join(shares)} |")
    finish = [hairdo.finish for hairdo in worn if hairdo]
    ways = ", ".join(f"{way} {percent(f == way for f in finish)}" for way in (*FINISHES, "curls"))
    return "\n".join(rows) + f"\n\nOf the hair {ways}."


def sampled_kinds() -> str:
    """Which kinds of lines drawings have, at each level of detail."""
    out = [f"| kinds of lines | {' | '.join(SCHEMES)} |", "|---|---|---|"]
    counts = [Counter(sample.kinds for sample in drawn(scheme)) for scheme in SCHEMES]
    for kinds in sorted(set().union(*counts), key=lambda k: (len(k), [KINDS.index(n) for n in k])):
        shares = [f"{100 * count[kinds] / COUNT:.0f} %" for count in counts]
        out.append(f"| {' + '.join(kinds)} | {' | '.join(shares)} |")
    return "\n".join(out)


# --- the pages ------------------------------------------------------------------------------------

TABLES = {
    "manual/any_rig.md": (conventions,),
    "manual/fit.md": (tweakables,),
    "face.md": (controls, words, identity, numbers),
    "dataset.md": (sampled_actions, sampled_controls, sampled_angles, sampled_people, sampled_faces,
                   sampled_hair, sampled_kinds, sampled_pages),
}  # fmt: skip


def renewed(page: str, text: str) -> str:
    """A page of TABLES with every table made anew; ValueError if a table's place is missing."""
    for make in TABLES[page]:
        start = f"<!-- {make.__name__}: made by docs/tables.py -->"
        pattern = re.compile(re.escape(start) + r"\n.*?<!-- end -->", re.DOTALL)
        if len(pattern.findall(text)) != 1:
            raise InputError(f"{page} needs the lines '{start}' and '<!-- end -->' once")
        table = make()
        text = pattern.sub(lambda _, s=start, t=table: f"{s}\n\n{t}\n\n<!-- end -->", text)
    return text


def main() -> None:
    for page in TABLES:
        path = DOCS / page
        text = path.read_text(encoding="utf-8")
        new = renewed(page, text)
        if "--check" not in sys.argv[1:]:
            path.write_text(new, encoding="utf-8")
        elif new != text:
            sys.exit(f"docs/{page} is out of date; run: python docs/tables.py")


if __name__ == "__main__":
    main()
