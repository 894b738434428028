"""How well the detector does on folders of shards: `sketch2face evaluate --data DIR`.

Each folder is a test set of its own. Without one the figures that were measured when the weights
were made are shown. With `--baseline` the networks of `train --baseline` are measured instead.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from facs_rig import TWELVE
from facs_rig.macros import years

from ..detection import ANGLES, CLOSE
from ..detector import Detector, Reading
from ..labels import PERSON
from . import metrics, shards
from .readings import Answers, DetectorReader, Reader, pages_of, stacked
from .targets import Targets, encode

UNIT_FIGURES = ("yes", "accuracy", "balanced_accuracy", "f1", "auc", "ece", "intensity_error")
MEANS = {"mean": "mean", "mean_of_the_twelve": "mean of the twelve"}

YAWS = (0, 10, 25, np.inf)
# What `--split` can tell apart: a drawing's group, from its record.
SPLITS: dict[str, Callable[[Mapping[str, Any]], str]] = {
    "engine": lambda record: str(record.get("engine")),
    "scheme": lambda record: str(record.get("scheme")),
    "look": lambda record: str(record.get("style", {}).get("look")),
    "kinds": lambda record: " + ".join(record.get("kinds", ("unknown",))),
    "detail": lambda record: str(record.get("detail")),
    "yaw": lambda record: band(abs(record["head"]["yaw"]), YAWS, "°"),
    "actions": lambda record: how_many(sum(v > 0 for v in record["aus"].values())),
}
# `--split strength`: how well actions of a strength are told from drawings without them. Labels end
# at a full natural activation, so that what was drawn with more counts to the last.
STRENGTHS = (1, 2, 3.5, np.inf)
STRENGTH = "strength"

Progress = Callable[[int, int], object]


def mean(values: Iterable[float]) -> float:
    """Of those that are known; nan if none is."""
    known = [value for value in values if not np.isnan(value)]
    return float(np.mean(known)) if known else float("nan")


def unit_figures(aus: Sequence[str], answers: Answers, targets: Targets) -> dict[str, Any]:
    """Figures of each unit (`UNIT_FIGURES`), their means over all and over the twelve of TWELVE.

    Per unit: share of yes, accuracy, balanced accuracy, F1, AUC, calibration error (ECE), mean
    intensity error where it is active. Undecided drawings (targets of nan) do not count.
    """
    units = {}
    for k, name in enumerate(aus):
        truth = targets.active[:, k]
        probability = answers.probability[:, k]
        yes = truth == 1
        off = np.abs(answers.intensity[:, k] - targets.intensity[:, k])[yes]
        units[name] = {
            "yes": mean(truth),
            **metrics.rates(truth, answers.active[:, k]),
            "auc": metrics.auc(truth, probability),
            "ece": metrics.calibration_error(truth, probability),
            "intensity_error": float(off.mean()) if len(off) else float("nan"),
        }
    twelve = [unit for name, unit in units.items() if name in TWELVE]
    return {
        "mean": {key: mean(unit[key] for unit in units.values()) for key in UNIT_FIGURES},
        "mean_of_the_twelve": {key: mean(unit[key] for unit in twelve) for key in UNIT_FIGURES},
        "units": units,
    }


def scores(aus: Sequence[str], answers: Answers, targets: Targets) -> dict[str, Any]:
    """All figures of n answers against their targets (landmarks in pixels of the same pages).

    Those of the units; how many units are called active where none is; mean angle errors in
    degrees; mean distance of the landmarks, as a share of the face's height, and the calibration
    error of their confidences; share of drawings seen as a face.
    """
    rest = (targets.active == 0).all(axis=1)
    angles = np.degrees(np.abs(answers.angles - targets.angles)).mean(axis=0)
    landmark_error = confidence_ece = float("nan")
    if not np.isnan(answers.landmarks).all():
        height = np.ptp(targets.landmarks[..., 1], axis=1)[:, None]
        off = np.hypot(*np.moveaxis(answers.landmarks - targets.landmarks, -1, 0)) / height
        landmark_error = float(off.mean())
        close = (off <= CLOSE).astype(float).ravel()
        confidence_ece = metrics.calibration_error(close, answers.confidence.ravel())
    return {
        "drawings": len(targets),
        **unit_figures(aus, answers, targets),
        "false_alarms_at_rest": mean(answers.active[rest].sum(axis=1)),
        "angle_error_deg": dict(zip((*ANGLES, "mean"), (*angles, angles.mean()), strict=True)),
        "landmark_error": landmark_error,
        "landmark_confidence_ece": confidence_ece,
        "seen_as_face": mean(np.where(np.isnan(answers.face), np.nan, answers.face > 0.5)),
    } | person_figures(answers.person, targets.person)


def person_figures(told: NDArray, truth: NDArray) -> dict[str, Any]:
    """Who was drawn, (n, p) as told and in truth; nothing if nothing is told.

    How well men are told from women (AUC), how far off ages are in years, and the mean correlation
    of the other parameters that vary.
    """
    if not told.size or np.isnan(truth).all():
        return {}
    columns = {name: k for k, name in enumerate(PERSON)}
    man, age = columns["gender"], columns["age"]
    known = ~np.isnan(truth[:, age])
    off = [
        abs(years(a) - years(b)) for a, b in zip(told[known, age], truth[known, age], strict=True)
    ]
    sexes = np.where(np.isnan(truth[:, man]), np.nan, truth[:, man] > 0.5)
    likeness = [
        float(np.corrcoef(told[known, k], truth[known, k])[0, 1])
        for k in range(len(PERSON))
        if k not in (man, age) and np.ptp(truth[known, k]) > 0 and np.ptp(told[known, k]) > 0
    ]
    return {
        "person": {
            "sex_auc": metrics.auc(sexes, told[:, man]),
            "age_error_years": mean(off),
            "likeness": mean(likeness),
        }
    }


def figures(detector: Detector, readings: Sequence[Reading], targets: Targets) -> dict[str, Any]:
    """`scores` of a detector's readings."""
    reader = DetectorReader(detector)
    return scores(detector.aus, stacked([reader.answer(r) for r in readings]), targets)


def band(value: float, edges: Sequence[float], unit: str = "") -> str:
    """The band between two of the edges, the upper one excluded, that a value lies in, in words."""
    place = int(np.searchsorted(edges, value, side="right"))
    low, high = edges[place - 1], edges[place]
    return f"{low:g}{unit} or more" if np.isinf(high) else f"{low:g}{unit} to under {high:g}{unit}"


def how_many(actions: int) -> str:
    """A number of actions, in words."""
    words = ("none", "1 or 2", "3 to 5", "6 or more")
    return words[int(np.searchsorted((1, 3, 6), actions, side="right"))]


def split_scores(
    key: str, aus: Sequence[str], answers: Answers, targets: Targets, records: Iterable[Mapping]
) -> dict[str, Any]:
    """group -> the figures of its drawings, for `STRENGTH` of each unit, for others the means."""
    if key == STRENGTH:
        parts = {}
        for low, high in pairwise(STRENGTHS):
            there = (targets.intensity >= low) & (targets.intensity < high)
            active = np.where(there, 1, np.where(targets.intensity == 0, 0, np.nan))
            part = replace(targets, active=active.astype(np.float32))
            figures_of = unit_figures(aus, answers, part)
            parts[band(low, STRENGTHS)] = {"drawings": len(targets), **figures_of}
        return parts
    groups = np.array([SPLITS[key](record) for record in records])
    parts = {}
    for group in np.unique(groups):
        rows = np.flatnonzero(groups == group)
        parts[str(group)] = scores(aus, answers.take(rows), targets.take(rows))
        del parts[str(group)]["units"]
    return parts


def evaluate(
    reader: Reader,
    data: shards.DataSet,
    splits: Sequence[str] = (),
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Figures on a data set, with the median time of a drawing and `splits` by keys of SPLITS.

    Drawings are decoded one by one: what is kept are the answers, some kB each.
    """
    targets = encode(data.records, reader.aus, reader.landmarks)
    rows, seconds = [], []
    for page in pages_of(data.drawings):
        begun = time.perf_counter()
        rows.append(reader.row(page))
        seconds.append(time.perf_counter() - begun)
        if progress:
            progress(len(rows), len(data))
    answers = stacked(rows)
    result = scores(reader.aus, answers, targets)
    result["median_ms"] = float(np.median(seconds) * 1000)
    if splits:
        result["splits"] = {
            key: split_scores(key, reader.aus, answers, targets, data.records) for key in splits
        }
    return result


def rounded(value: Any) -> Any:
    """Figures to six digits, nan to null: for people, and for programs that read JSON."""
    if isinstance(value, dict):
        return {key: rounded(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(entry) for entry in value]
    if isinstance(value, float | np.floating):
        return float(f"{value:.6g}") if np.isfinite(value) else None
    return value


def number(value: float | None) -> float:
    """JSON has no nan: null stands for what could not be measured."""
    return float("nan") if value is None else value


def table(result: dict[str, Any]) -> str:
    """The figures for people."""
    head = ("yes", "accuracy", "balanced", "F1", "AUC", "ECE", "intensity")
    lines = [f"{'':22}" + "".join(f"{word:>10}" for word in head)]
    means = {words: result[key] for key, words in MEANS.items() if key in result}
    for name, unit in (*result["units"].items(), *means.items()):
        cells = "".join(f"{number(unit[key]):10.3f}" for key in UNIT_FIGURES)
        lines.append(f"{name:22}{cells}")
    lines.append("\n" + summary(result))
    for key, groups in result.get("splits", {}).items():
        lines.append("\n" + split_table(key, groups))
    return "\n".join(lines)


def split_table(key: str, groups: dict[str, Any]) -> str:
    """A line for each group: means over all units, then over the twelve, then the rest."""
    head = ("drawings", "balanced", "AUC", "ECE", "of the 12", "AUC", "ECE", "angles", "landmarks")
    lines = [f"{'by ' + key:44}" + "".join(f"{word:>10}" for word in head)]
    for group, part in groups.items():
        cells = [f"{part['drawings']}"]
        for means in MEANS:
            figures = ("balanced_accuracy", "auc", "ece")
            cells += [f"{number(part[means][figure]):.3f}" for figure in figures]
        if "angle_error_deg" in part:
            cells.append(f"{number(part['angle_error_deg']['mean']):.1f}°")
            cells.append(f"{100 * number(part['landmark_error']):.1f}%")
        lines.append(f"{group:44}" + "".join(f"{cell:>10}" for cell in cells))
    return "\n".join(lines)


def summary(result: dict[str, Any]) -> str:
    """One line of what is not of single units."""
    angles = "  ".join(f"{k} {number(v):.1f}°" for k, v in result["angle_error_deg"].items())
    parts = [
        f"{result['drawings']} drawings; errors: {angles}",
        f"landmarks {100 * number(result['landmark_error']):.1f}% of the face's height",
        f"{100 * number(result['seen_as_face']):.1f}% seen as a face",
    ]
    if "false_alarms_at_rest" in result:
        parts.append(f"{number(result['false_alarms_at_rest']):.2f} false alarms on a face at rest")
    if who := result.get("person"):
        parts.append(
            f"sex AUC {number(who['sex_auc']):.3f}, age off by {number(who['age_error_years']):.1f}"
            f" years, features' correlation {number(who['likeness']):.2f}"
        )
    if "median_ms" in result:
        parts.append(f"{result['median_ms']:.1f} ms a drawing")
    return "; ".join(parts)
