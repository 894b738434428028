"""Keep the tables of docs/detectors.md true: from the shipped weights' own description, and from
what `sketch2face evaluate --json` wrote into docs/detectors.jsonl.

    python docs/detector_tables.py            # write them anew
    python docs/detector_tables.py --check    # only say whether they are true

docs/detectors.jsonl holds a line for each test set, of the detector and of the GoogLeNets, in any
order. Figures of networks other than those that ship are shown, and said to be of earlier ones.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from classifiers.runtime import WEIGHTS, read_description
from classifiers.training.evaluate import number
from facs_rig import CONTROLS, TWELVE
from facs_rig.common.errors import InputError

DOCS = Path(__file__).parent
PAGE, RESULTS = DOCS / "detectors.md", DOCS / "detectors.jsonl"
NONE = "Nothing has been measured yet."
FEWEST = 30  # drawings of a group that say something about it
Result = dict[str, Any]


def measured(networks: str) -> list[Result]:
    """The results of "detector" or "googlenet", in the order of the file."""
    if not RESULTS.exists():
        return []
    lines = [json.loads(line) for line in RESULTS.read_text(encoding="utf-8").splitlines()]
    return [line for line in lines if line["model"]["networks"] == networks]


def name_of(result: Result) -> str:
    return Path(result["data"]).name


def figure(value: float | None, form: str = ".3f") -> str:
    return "" if value is None else f"{number(value):{form}}"


def pair(figures: dict[str, float | None]) -> str:
    """Balanced accuracy / AUC; nothing where neither could be measured."""
    if figures["balanced_accuracy"] is None:
        return ""
    return f"{figure(figures['balanced_accuracy'])} / {figure(figures['auc'])}"


def whole(value: float | None, form: str = ".1f") -> str:
    """A share as percent."""
    return "" if value is None else f"{100 * value:{form}} %"


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [f"| {' | '.join(head)} |", "|---|" + "---|" * (len(head) - 1)]
    return "\n".join(lines + [f"| {' | '.join(row)} |" for row in rows])


def sets() -> str:
    """A row for each test set: the twelve, all units, and what is not of units."""
    rows = []
    for result in measured("detector") + measured("googlenet"):
        twelve, every = result["mean_of_the_twelve"], result["mean"]
        baseline = result["model"]["networks"] == "googlenet"
        rows.append(
            (
                name_of(result) + (", GoogLeNets" if baseline else ""),
                f"{result['drawings']}",
                f"{figure(twelve['balanced_accuracy'])} / {figure(every['balanced_accuracy'])}",
                f"{figure(twelve['auc'])} / {figure(every['auc'])}",
                f"{figure(twelve['f1'])} / {figure(every['f1'])}",
                figure(every["ece"]),
                figure(every["intensity_error"], ".2f"),
                figure(result["false_alarms_at_rest"], ".2f"),
                *angles(result),
                figure(result["landmark_confidence_ece"]),
                whole(result["seen_as_face"]),
                f"{result['median_ms']:.1f}",
            )
        )
    if not rows:
        return NONE
    units = {len(result["units"]) for result in measured("detector")}
    head = ("test set", "drawings", "balanced accuracy", "AUC", "F1", "ECE", "intensity",
            "false alarms", "angles", "landmarks", "their ECE", "seen", "ms")  # fmt: skip
    told = f"Two figures: mean of the twelve / of all {' or '.join(map(str, sorted(units)))} units."
    return f"{told}{earlier()}\n\n{table(head, rows)}"


def angles(result: Result) -> tuple[str, str]:
    """Mean error of the angles, and of the landmarks as a share of the face's height."""
    mean = result["angle_error_deg"]["mean"]
    return ("" if mean is None else f"{mean:.1f}°", whole(result["landmark_error"]))


def earlier() -> str:
    """A sentence, if the figures are not of the weights that ship."""
    shipped = read_description(WEIGHTS)["sha256"]
    same = all(result["model"]["sha256"] == shipped for result in measured("detector"))
    return "" if same else " **These are figures of earlier weights than those that ship now.**"


def units() -> str:
    """A row for each unit, balanced accuracy and AUC on each test set; beside the baseline's."""
    ours, theirs = measured("detector"), {name_of(r): r for r in measured("googlenet")}
    if not ours:
        return NONE
    head = ["unit", "AU"]
    for result in ours:
        head.append(name_of(result))
        if name_of(result) in theirs:
            head.append(f"{name_of(result)}, GoogLeNet")
    known = ours[0]["units"]
    controls = {control.name: control for control in CONTROLS}
    order = [name for name in TWELVE if name in known]
    order += [name for name in known if name not in TWELVE]

    def cell(result: Result | None, name: str) -> str:
        unit = (result or {"units": {}})["units"].get(name)
        return pair(unit) if unit else ""

    rows = []
    for name in order:
        row = [f"`{name}`", " + ".join(controls[name].aus)]
        for result in ours:
            row.append(cell(result, name))
            if name_of(result) in theirs:
                row.append(cell(theirs[name_of(result)], name))
        rows.append(row)
    return f"Balanced accuracy / AUC.\n\n{table(head, rows)}"


def splits() -> str:
    """Where the detector is weak: what `--split` found, a column for each test set."""
    ours = measured("detector")
    groups: dict[tuple[str, str], dict[str, Result]] = {}
    for result in ours:
        for key, parts in result.get("splits", {}).items():
            for group, part in parts.items():
                if part["drawings"] < FEWEST:
                    continue
                groups.setdefault((key, group), {})[name_of(result)] = part
    if not groups:
        return NONE
    names = [name_of(result) for result in ours]
    rows = [
        (f"{key}: {group}", *(pair(found[n]["mean_of_the_twelve"]) if n in found else ""
                              for n in names))
        for (key, group), found in groups.items()
    ]  # fmt: skip
    rows = [row for row in rows if any(row[1:])]
    told = f"Balanced accuracy / AUC, mean of the twelve; of groups of {FEWEST} drawings or more."
    return f"{told}\n\n{table(('', *names), rows)}"


def card() -> str:
    """What the shipped weights are and what they were made of, as they say themselves."""
    model = read_description(WEIGHTS)
    training, data = model["training"], model["data"]
    size = (WEIGHTS / model["weights"]).stat().st_size
    seeds = ", ".join(map(str, data["seeds"]))

    def counted(key: str) -> str:
        return ", ".join(f"{name} {count}" for name, count in data.get(key, {}).items())

    rows = [
        ("networks", f"{len(model['aus'])} units, {len(model['landmarks'])} landmarks, crops of "
         f"{model['size']} x {model['size']} px, {size / 1e6:.1f} MB"),
        ("SHA-256 of the weights", f"`{model['sha256'][:16]}…`"),
        ("drawings", f"{data['drawings']}, of them a tenth held out ({data['held_out']})"),
        ("engines; schemes", f"{counted('engines')}; {counted('schemes') or 'not recorded'}"),
        ("seeds of the drawings", seeds),
        ("looks left out", training["config"].get("unseen") or "none"),
        ("training", f"{training['minutes']:.0f} minutes, {training['images']} images, "
         f"seed {training['config']['seed']}"),
        ("trunk", training["trunk"]),
        ("ONNX Runtime against torch", f"{model['figures']['onnx_minus_torch']:.1e} at most"),
        ("pages without a face taken for one",
         whole(model["figures"]["faceless_seen_as_face"])),
    ]  # fmt: skip
    for kind, words in (("clean", "as generated"), ("drawn_over", "drawn over")):
        found = model["figures"][kind]
        mean = found.get("mean_of_the_twelve", found["mean"])
        yaw, places = found["angle_error_deg"]["yaw"], whole(found["landmark_error"])
        rows.append(
            (
                f"{found['drawings']} held-out drawings, {words}",
                f"the twelve: balanced accuracy {figure(mean['balanced_accuracy'])}, AUC "
                f"{figure(mean['auc'])}, F1 {figure(mean['f1'])}, ECE {figure(mean['ece'])}; yaw "
                f"{yaw:.1f}°; landmarks {places}",
            )
        )
    return table(("", ""), rows)


TABLES = (sets, units, splits, card)


def renewed(text: str) -> str:
    """The page with every table made anew; ValueError if a table's place is missing."""
    for make in TABLES:
        start = f"<!-- {make.__name__}: made by docs/detector_tables.py -->"
        pattern = re.compile(re.escape(start) + r"\n.*?<!-- end -->", re.DOTALL)
        if len(pattern.findall(text)) != 1:
            raise InputError(f"{PAGE.name} needs the lines '{start}' and '<!-- end -->' once")
        made = f"{start}\n\n{make()}\n\n<!-- end -->"
        text = pattern.sub(lambda _, made=made: made, text)
    return text


def main() -> None:
    text = PAGE.read_text(encoding="utf-8")
    new = renewed(text)
    if "--check" not in sys.argv[1:]:
        PAGE.write_text(new, encoding="utf-8")
    elif new != text:
        sys.exit("docs/detectors.md is out of date; run: python docs/detector_tables.py")


if __name__ == "__main__":
    main()
