"""How well the detector does on a folder of shards: `sketch2face evaluate --data DIR`.

Without a folder the figures that were measured when the weights were made are shown.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import metrics, shards
from .detector import WEIGHTS, Detector, Reading, load_detector
from .labels import Targets, encode
from .preprocess import Floats, as_page

UNIT_FIGURES = ("yes", "accuracy", "balanced_accuracy", "f1", "auc", "ece")


def pages_of(drawings: Iterable[NDArray[np.uint8]]) -> Iterator[Floats]:
    """uint8 drawings (h, w), 255 = paper, as pages of ink."""
    return (as_page(drawing / np.float32(255)) for drawing in drawings)


def read_all(detector: Detector, pages: Iterable[Floats]) -> list[Reading]:
    return [detector.read(page) for page in pages]


def figures(detector: Detector, readings: Sequence[Reading], targets: Targets) -> dict[str, Any]:
    """All figures of n readings against their targets (landmarks in pixels of the same pages).

    Per unit: share of yes, accuracy, balanced accuracy, F1, AUC, calibration error (ECE), mean
    intensity error where it is active. In all: means over the units, mean angle errors in degrees,
    mean landmark error relative to the face's height, share of drawings seen as a face.
    """
    detections = [detector.interpret(reading) for reading in readings]
    units = {}
    for k, name in enumerate(detector.aus):
        truth = targets.active[:, k]
        probability = np.array([d.probabilities[name] for d in detections])
        said = np.array([d.active[name] for d in detections])
        raw = np.array([r.intensities[k] for r in readings])
        yes = truth == 1
        units[name] = {
            "yes": float(np.nanmean(truth)),
            **metrics.rates(truth, said),
            "auc": metrics.auc(truth, probability),
            "ece": metrics.calibration_error(truth, probability),
            "intensity_error": float(np.abs(raw - targets.intensity[:, k])[yes].mean())
            if yes.any()
            else float("nan"),
        }
    angles = np.degrees(np.abs(np.array([d.head for d in detections]) - targets.angles))
    points = np.array([r.landmarks for r in readings])
    height = np.ptp(targets.landmarks[..., 1], axis=1)
    offset = np.hypot(*np.moveaxis(points - targets.landmarks, -1, 0)).mean(axis=1)
    keys = next(iter(units.values()))
    return {
        "drawings": len(readings),
        "mean": {key: float(np.nanmean([unit[key] for unit in units.values()])) for key in keys},
        "units": units,
        "angle_error_deg": dict(zip(("yaw", "pitch", "roll"), angles.mean(axis=0), strict=True)),
        "landmark_error": float((offset / height).mean()),
        "seen_as_face": float(np.mean([d.face_probability > 0.5 for d in detections])),
    }


def rounded(value: Any) -> Any:
    """Figures to six digits, nan to null: for people, and for programs that read JSON."""
    if isinstance(value, dict):
        return {key: rounded(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(entry) for entry in value]
    if isinstance(value, float | np.floating):
        return float(f"{value:.6g}") if np.isfinite(value) else None
    return value


def evaluate(detector: Detector, data: shards.DataSet) -> dict[str, Any]:
    """Figures of the detector on a data set, with the median time of a detection."""
    targets = encode(data.records, detector.aus, detector.landmarks)
    readings, seconds = [], []
    for page in pages_of(data.drawings):
        begun = time.perf_counter()
        readings.append(detector.read(page))
        seconds.append(time.perf_counter() - begun)
    return figures(detector, readings, targets) | {"median_ms": float(np.median(seconds) * 1000)}


def number(value: float | None) -> float:
    """JSON has no nan: null stands for what could not be measured."""
    return float("nan") if value is None else value


def table(result: dict[str, Any]) -> str:
    """The figures for people."""
    head = ("yes", "accuracy", "balanced", "F1", "AUC", "ECE", "intensity")
    keys = (*UNIT_FIGURES, "intensity_error")
    lines = [f"{'':20}" + "".join(f"{word:>10}" for word in head)]
    for name, unit in (*result["units"].items(), ("mean", result["mean"])):
        lines.append(f"{name:20}" + "".join(f"{number(unit[key]):10.3f}" for key in keys))
    angles = "  ".join(f"{k} {v:.1f}°" for k, v in result["angle_error_deg"].items())
    lines.append(
        f"\n{result['drawings']} drawings; mean errors: {angles}; landmarks"
        f" {100 * result['landmark_error']:.1f}% of the face's height;"
        f" {100 * result['seen_as_face']:.1f}% seen as a face"
        + (f"; {result['median_ms']:.1f} ms a drawing" if "median_ms" in result else "")
    )
    return "\n".join(lines)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--data", type=Path, help="folder of .tar shards (else: stored figures)")
    parser.add_argument("--weights", type=Path, default=WEIGHTS, help="folder of other networks")
    parser.add_argument("--limit", type=int, help="read at most so many drawings")
    parser.add_argument("--json", action="store_true", help="one JSON object instead of a table")


def run(args: argparse.Namespace) -> int:
    """Print the figures; 0 when done, 2 if the shards or the weights cannot be used."""
    try:
        detector = load_detector(args.weights)
        if args.data:
            results = {str(args.data): evaluate(detector, shards.load(args.data, args.limit))}
        else:
            stored = detector.model["figures"]
            results = {kind: stored[kind] for kind in ("clean", "drawn_over")}
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    if args.json:
        print(json.dumps(rounded(results[str(args.data)] if args.data else results)))
        return 0
    for kind, result in results.items():
        print(f"{kind}\n{table(result)}\n")
    return 0


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    add_arguments(parser)
    return run(parser.parse_args(argv))


if __name__ == "__main__":
    sys.exit(main())
