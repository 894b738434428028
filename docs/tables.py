"""Keep the tables of docs/face.md true: they are made from the catalogue and the shipped head.

    python docs/tables.py            # write them anew
    python docs/tables.py --check    # only say whether they are true

They stand between lines such as `<!-- controls: made by docs/tables.py -->` and `<!-- end -->`.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from facs_rig import CONTROLS, IDENTITY, Control, load_rig
from facs_rig.anatomy import PART_NAMES

PAGE = Path(__file__).parent / "face.md"
REGIONS = {"upper": "Upper face", "mid": "Mid face", "lower": "Lower face"}
FOLDERS = {"": "Who", "head": "Head", "forehead": "Forehead", "eyes": "Eyes", "eyebrows": "Brows",
           "nose": "Nose", "mouth": "Mouth", "cheek": "Cheeks", "chin": "Chin and jaw",
           "ears": "Ears", "neck": "Neck"}  # fmt: skip


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
    out = ["| parameter | what it is | from | to | default |", "|---|---|---|---|---|"]
    for folder, title in FOLDERS.items():
        for f in (f for f in IDENTITY if f.low.split("/")[0] == folder):
            limits = f"{f.minimum:g} | {f.maximum:g} | {f.default:.3g}"
            out.append(f"| `{f.name}` | {title}: {f.label} | {limits} |")
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
        ("polygons (quads, and triangles where the mesh grows finer)", polygons),
        ("triangles", len(rig.triangles)),
        ("parts", ", ".join(PART_NAMES)),
        ("controls", len(CONTROLS)),
        ("shape keys that raise creases", creases),
        ("shape keys that keep lids and lips apart, and other correctives", helpers),
        ("identity parameters", len(IDENTITY)),
    )
    lines = [f"| {name} | {f'{n:,}' if isinstance(n, int) else n} |" for name, n in rows]
    return "\n".join(["| the shipped head | |", "|---|---|", *lines])


TABLES = {f.__name__: f for f in (controls, identity, numbers)}


def renewed(text: str) -> str:
    """The page with every table made anew; ValueError if a table's place is missing."""
    for name, make in TABLES.items():
        start = f"<!-- {name}: made by docs/tables.py -->"
        pattern = re.compile(re.escape(start) + r"\n.*?<!-- end -->", re.DOTALL)
        if len(pattern.findall(text)) != 1:
            raise ValueError(f"the page needs the lines '{start}' and '<!-- end -->' once")
        table = make()
        text = pattern.sub(lambda _, s=start, t=table: f"{s}\n\n{t}\n\n<!-- end -->", text)
    return text


def main() -> None:
    text = PAGE.read_text(encoding="utf-8")
    new = renewed(text)
    if "--check" in sys.argv[1:]:
        sys.exit(0 if new == text else "docs/face.md is out of date; run: python docs/tables.py")
    PAGE.write_text(new, encoding="utf-8")


if __name__ == "__main__":
    main()
