"""Action units on drawings, as a benchmark: named test sets, and any method's answers to them.

Every set is drawn anew from its seed, none of which anything here was trained on, and known by a
fingerprint of its drawings and labels. A method answers with a probability of each control for each
drawing, in a file of JSON lines; a probability of a half and more is a yes, unless the line says
itself what it decides. What a method does not know it leaves out, and it does not count.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dataset_gen.generate import generate
from facs_rig import CONTROL_NAMES, TWELVE
from facs_rig.common.errors import InputError
from facs_rig.parameters import nearest

from . import shards
from .evaluate import unit_figures
from .readings import Answers, Reader, pages_of, stacked
from .targets import encode

COUNT = 1000  # drawings of a set
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class TestSet:
    """What is drawn for it: a scheme of people and actions, an engine, a seed; and why."""

    scheme: str
    engine: str
    seed: int
    about: str


SETS = {
    "fresh": TestSet("sparse", "contours", 91001, "our engine, adults who crease and act alike"),
    "people": TestSet("people", "contours", 91002, "from six to ninety, creases and ways of their "
                      "own, some stylised"),
    "smooth": TestSet("smooth", "contours", 91003, "nobody creases: shape alone tells"),
    "conventions": TestSet("people", "conventions", 91004, "the same people drawn by conventions"),
    "thesis": TestSet("thesis", "contours", 91005, "every action at a random 0 to 5, as in 2018"),
    "freestyle": TestSet("sparse", "freestyle", 91006, "another engine, Blender's Freestyle"),
}  # fmt: skip


def check_names(names: Iterable[str]) -> None:
    """InputError for a set that there is not."""
    for name in names:
        if name not in SETS:
            hint = nearest(name, tuple(SETS)) or f"; choose from: {', '.join(SETS)}"
            raise InputError(f"there is no test set '{name}'{hint}")


def drawn(
    name: str, folder: Path, count: int, jobs: int, progress: Progress | None
) -> shards.DataSet:
    """The first `count` drawings of a set, in `folder`/NAME-COUNT; what is there is used again.

    Raises InputError for a folder that holds something else.
    """
    check_names([name])
    chosen, place = SETS[name], folder / f"{name}-{count}"
    generate(
        count, place, seed=chosen.seed, engine=chosen.engine, scheme=chosen.scheme, jobs=jobs,
        resume=place.exists(), progress=progress,
    )  # fmt: skip
    return shards.load(place)


def fingerprint(data: shards.DataSet) -> str:
    """Of all drawings and their labels, 12 hex digits: the same for all who drew the same set."""
    digest = hashlib.sha256()
    for drawing, record in zip(data.drawings, data.records, strict=True):
        digest.update(np.ascontiguousarray(drawing).tobytes())
        digest.update(json.dumps(record["aus"], sort_keys=True).encode())
    return digest.hexdigest()[:12]


def answers_of(
    reader: Reader, data: shards.DataSet, progress: Progress | None = None
) -> list[dict[str, Any]]:
    """What a detector answers to each drawing: control -> probability and active."""
    said = []
    for page in pages_of(data.drawings):
        probability, active, *_ = reader.row(page)
        told = zip(reader.aus, probability, active, strict=True)
        said.append({n: {"probability": float(p), "active": bool(a)} for n, p, a in told})
        if progress:
            progress(len(said), len(data))
    return said


def read_answers(path: Path) -> dict[str, dict[int, dict[str, Any]]]:
    """set -> number of the drawing -> its answers, from a file of JSON lines.

    A line is {"set": NAME, "index": N, "aus": {CONTROL: PROBABILITY, ...}}, where in place of a
    probability may stand {"probability": P, "active": true or false}.

    Raises InputError, with the number of the line, for anything else.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        raise InputError(f"{path} cannot be read as a file of JSON lines.") from None
    found: dict[str, dict[int, dict[str, Any]]] = {}
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            entry = _checked(json.loads(line))
        except (ValueError, RecursionError) as error:
            reason = str(error) if isinstance(error, InputError) else "it is no JSON object"
            raise InputError(f"{path}, line {number}: {reason}.") from None
        drawings = found.setdefault(entry["set"], {})
        if entry["index"] in drawings:
            raise InputError(
                f"{path}, line {number}: drawing {entry['index']} of {entry['set']} is answered "
                "twice."
            )
        drawings[entry["index"]] = entry["aus"]
    if not found:
        raise InputError(f"{path} holds no answers: a line is "
                         '{"set": "fresh", "index": 0, "aus": {"smile": 0.9}}.')  # fmt: skip
    return found


def _checked(entry: Any) -> dict[str, Any]:
    if not isinstance(entry, dict) or not {"set", "index", "aus"} <= set(entry):
        raise InputError('a line needs "set", "index" and "aus"')
    check_names([str(entry["set"])])
    index = entry["index"]
    if isinstance(index, bool) or not isinstance(index, int) or index < 0:
        raise InputError(f"index {index!r} is not the number of a drawing")
    if not isinstance(entry["aus"], dict):
        raise InputError('"aus" tells the probability of each control')
    for name, said in entry["aus"].items():
        if name not in CONTROL_NAMES:
            raise InputError(f"there is no control '{name}'{nearest(name, CONTROL_NAMES)}")
        value = said.get("probability") if isinstance(said, dict) else said
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= 1:
            raise InputError(f"the probability of {name} must lie between 0 and 1, not {value!r}")
    return entry


def figures(said: Mapping[int, Mapping[str, Any]], data: shards.DataSet) -> dict[str, Any]:
    """Figures of the answers to a set, as `evaluate.unit_figures` gives them.

    said : number of the drawing -> control -> probability, or with what is decided. Controls that
    no drawing has an answer for are left out. Raises InputError if some drawings have none, or some
    controls only now and then: what is hard must not be left out.
    """
    names = tuple(name for name in CONTROL_NAMES if any(name in a for a in said.values()))
    missing = [k for k in range(len(data)) if k not in said]
    if missing:
        raise InputError(f"drawing {missing[0]} has no answer, and {len(missing) - 1} more.")
    rows = [said[k] for k in range(len(data))]
    for k, row in enumerate(rows):
        if lacking := [name for name in names if name not in row]:
            raise InputError(f"drawing {k} has no answer for {lacking[0]}, which others have.")
    if not names:
        raise InputError("no control is answered for.")
    truth = encode(data.records, names, tuple(data.records[0]["landmarks"]))
    return unit_figures(names, _as_answers(rows, names), truth)


def _as_answers(rows: Iterable[Mapping[str, Any]], names: tuple[str, ...]) -> Answers:
    def row(told: Mapping[str, Any]) -> tuple:
        said = [told[n] if isinstance(told[n], dict) else {"probability": told[n]} for n in names]
        probability = [one["probability"] for one in said]
        active = [bool(one.get("active", one["probability"] >= 0.5)) for one in said]
        nan = float("nan")
        return probability, active, [nan] * len(names), (nan,) * 3, ((nan,) * 2,), (nan,), nan, ()

    return stacked([row(told) for told in rows])


def table(results: Mapping[str, Mapping[str, Any]]) -> str:
    """Of one method in Markdown: the means of each set, then each control in each set.

    results : set -> its figures, with `drawings` and `fingerprint`
    """
    lines = [
        "| set | drawings | fingerprint | AUC of the twelve | balanced accuracy | F1 "
        "| AUC of all | balanced accuracy | F1 |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    keys = ("auc", "balanced_accuracy", "f1")
    for name, result in results.items():
        cells = [
            _three(result[which][key]) for which in ("mean_of_the_twelve", "mean") for key in keys
        ]
        head = [name, str(result["drawings"]), f"`{result['fingerprint']}`"]
        lines.append("| " + " | ".join(head + cells) + " |")
    known = {unit for result in results.values() for unit in result["units"]}
    order = [*TWELVE, *(unit for unit in CONTROL_NAMES if unit not in TWELVE)]
    lines += ["", "AUC / balanced accuracy / F1", "", f"| control | {' | '.join(results)} |"]
    lines.append("|---" * (len(results) + 1) + "|")
    for unit in (unit for unit in order if unit in known):
        told = [result["units"].get(unit) for result in results.values()]
        cells = [" / ".join(_three(t[key]) for key in keys) if t else "" for t in told]
        lines.append(f"| `{unit}` | {' | '.join(cells)} |")
    return "\n".join(lines)


def _three(value: float) -> str:
    return "" if value is None or math.isnan(value) else f"{value:.3f}"
