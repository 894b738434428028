"""``sketch2face evaluate``: how well the detector reads folders of drawings."""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from addon.console import Bar, name_paths
from facs_rig.common.errors import InputError

if TYPE_CHECKING:
    from classifiers.training.evaluate import Progress
    from classifiers.training.readings import Reader


def arguments(parser: argparse.ArgumentParser) -> None:
    from classifiers.runtime import WEIGHTS
    from classifiers.training.evaluate import SPLITS, STRENGTH

    parser.add_argument(
        "--data",
        type=Path,
        metavar="DIR",
        action="append",
        default=[],
        help="folder of .tar shards, a test set; several times for several (none: stored figures)",
    )
    parser.add_argument("--weights", type=Path, default=WEIGHTS, help="folder of other networks")
    parser.add_argument(
        "--baseline", type=Path, metavar="DIR", help="measure the GoogLeNets of this folder instead"
    )
    parser.add_argument(
        "--split",
        nargs="+",
        default=[],
        metavar="KEY",
        choices=(*SPLITS, STRENGTH),
        help=f"break the figures down by {', '.join(SPLITS)} or {STRENGTH}",
    )
    parser.add_argument("--limit", type=int, help="read at most so many drawings of each set")
    parser.add_argument(
        "--json", action="store_true", help="a JSON object a line for each set instead of tables"
    )
    name_paths(parser)


def run(options: argparse.Namespace) -> int:
    with Bar("drawings") as bar:
        evaluate(options, bar)
    return 0


def evaluate(options: argparse.Namespace, progress: Progress | None = None) -> None:
    """Print the figures; InputError if the shards or the weights cannot be used."""
    from classifiers import load_detector
    from classifiers.training.evaluate import rounded, table

    if options.baseline and not options.data:
        raise InputError("--baseline is measured on test sets: name one with --data.")
    if not options.data:
        stored = load_detector(options.weights).model["figures"]
        stored = {kind: stored[kind] for kind in ("clean", "drawn_over")}
        if options.json:
            print(json.dumps(rounded(stored)))
        else:
            print("\n\n".join(f"{kind}\n{table(result)}" for kind, result in stored.items()))
        return
    for result in results(options, progress):
        text = f"{result['data']}\n{table(result)}\n"
        print(json.dumps(rounded(result)) if options.json else text, flush=True)


def results(options: argparse.Namespace, progress: Progress | None) -> Iterator[dict[str, Any]]:
    """The figures of each test set."""
    from classifiers.training import shards
    from classifiers.training.evaluate import evaluate

    reader = reader_of(options)
    for folder in options.data:
        data = shards.load(folder, limit=options.limit)
        result = evaluate(reader, data, options.split, progress)
        yield {"data": str(folder), "model": reader.about} | result


def reader_of(options: argparse.Namespace) -> Reader:
    from classifiers import load_detector
    from classifiers.training.readings import DetectorReader

    if not options.baseline:
        return DetectorReader(load_detector(options.weights))
    # Before torch is loaded: threads that spin for each other on a busy machine take seconds.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    from classifiers.training.googlenet import load_baseline

    return load_baseline(options.baseline)
