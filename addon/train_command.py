"""``sketch2face train``: the detector's networks, anew, or the thesis' to compare them with."""

from __future__ import annotations

import argparse
import json
import logging
import os
import sys
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING

from addon.console import name_paths
from facs_rig.common.errors import InputError

if TYPE_CHECKING:
    from classifiers.training.common import Config


def arguments(parser: argparse.ArgumentParser) -> None:
    """The folders, what to train, and an option for each field of Config."""
    from classifiers.training.common import Config

    parser.add_argument(
        "--data",
        type=Path,
        metavar="DIR",
        action="append",
        required=True,
        help="folder of .tar shards; several times for several",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("runs/detector"), help="checkpoint and log"
    )
    parser.add_argument(
        "--weights",
        type=Path,
        help="folder for the exported networks (OUT/weights; classifiers/weights ships them)",
    )
    parser.add_argument("--limit", type=int, help="read at most so many drawings")
    parser.add_argument(
        "--only",
        metavar="UNITS",
        help="train the networks of these units alone, with commas, or those of "
        "'person,regions,hats': who is drawn, what lies where, and where that is a hat",
    )
    parser.add_argument(
        "--start",
        type=Path,
        help="go on from the networks of this folder, such as classifiers/weights; with --only the "
        "checkpoint or folder that the rest is taken from",
    )
    parser.add_argument(
        "--blend",
        type=float,
        default=1.0,
        metavar="SHARE",
        help="export what lies between --start (0) and what was learnt (1): less is forgotten",
    )
    parser.add_argument(
        "--read",
        type=int,
        default=4000,
        metavar="N",
        help="held-out drawings at most to calibrate on and to measure (4000)",
    )
    parser.add_argument(
        "--baseline",
        metavar="UNITS",
        help="train the thesis' GoogLeNet for each of these units, or for 'twelve', --minutes each",
    )
    parser.add_argument("--no-export", action="store_true", help="stop after the last checkpoint")
    parser.add_argument("--speed", action="store_true", help="only measure images per second")
    for field in fields(Config):
        kind = type(field.default)
        option = f"--{field.name.replace('_', '-')}"
        if kind is bool:
            action = argparse.BooleanOptionalAction
            parser.add_argument(option, action=action, default=field.default)
        else:
            parser.add_argument(option, type=kind, default=field.default, help=f"({field.default})")
    name_paths(parser)


def run(options: argparse.Namespace) -> int:
    train(options)
    return 0


def train(options: argparse.Namespace) -> None:
    """Train and export; InputError if the data or the options cannot be used."""
    # Before torch is loaded: threads spinning at a barrier take the core that draws the batches.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    from classifiers.training import shards
    from classifiers.training.common import Config
    from facs_rig import CONTROL_NAMES

    config = Config(**{field.name: getattr(options, field.name) for field in fields(Config)})
    if options.only and not options.start:
        raise InputError("--only and --start belong together: which units, and to what.")
    if not 0 <= options.blend <= 1 or (options.blend < 1 and not options.start):
        raise InputError("--blend is a share from 0 to 1, of what was learnt since --start.")
    if config.agree and config.pool:
        raise InputError("--agree compares drawings of one batch, which --pool mixes: choose one.")
    for names in (options.only, options.baseline):
        if names is not None and not alone(names):
            chosen(names)  # a slip in a name is told before the drawings are read
    data = shards.load(*options.data, limit=options.limit, jobs=max(config.workers, 1))
    if options.speed:
        from classifiers.training.train import speed

        speed(CONTROL_NAMES, tuple(data.records[0]["landmarks"]), config)
        return
    log = log_into(options.out, config)
    if options.baseline:
        from classifiers.training.googlenet import train_baseline

        for unit in chosen(options.baseline):
            train_baseline(data, unit, options.out, config)
        return
    if options.only:
        from classifiers.training.retrain import retrain

        only = alone(options.only) or chosen(options.only)
        checkpoint = retrain(data, options.start, only, options.out, config)
    else:
        from classifiers.training.train import train as train_all

        checkpoint = train_all(data, CONTROL_NAMES, options.out, config, options.start)
    if not options.no_export:
        from classifiers.training.export import export, extended

        weights = options.weights or options.out / "weights"
        if options.only and set(only) <= {"regions", "hats"} and options.start.is_dir():
            extended(checkpoint, options.start, weights)
            return
        start = None if options.only else options.start
        export(checkpoint, data, weights, log.info, options.read, start, options.blend)


def alone(names: str) -> tuple[str, ...]:
    """The parts of the networks that are no units, named with commas; none if others are named."""
    wanted = tuple(name for name in names.replace(" ", "").split(",") if name)
    return wanted if wanted and set(wanted) <= {"person", "regions", "hats"} else ()


def chosen(names: str) -> tuple[str, ...]:
    """The controls named with commas; 'twelve' are those of the thesis. InputError for others."""
    from facs_rig import CONTROL_NAMES, TWELVE

    if names == "twelve":
        return TWELVE
    wanted = tuple(name for name in names.replace(" ", "").split(",") if name)
    unknown = [name for name in wanted if name not in CONTROL_NAMES]
    if unknown or not wanted:
        raise InputError(
            f"There is no unit {', '.join(unknown) or 'named'}: `sketch2face rig` lists them."
        )
    return wanted


def log_into(out: Path, config: Config) -> logging.Logger:
    """The log of the training, to the screen and to a file in the folder `out`."""
    from classifiers.training.common import log

    out.mkdir(parents=True, exist_ok=True)
    to_file = logging.FileHandler(out / "train.log")
    to_screen = logging.StreamHandler(sys.stdout)
    for handler in (to_file, to_screen):
        handler.setFormatter(logging.Formatter("%(asctime)s %(message)s", "%H:%M:%S"))
        log.addHandler(handler)
    log.setLevel(logging.INFO)
    log.info("config %s", json.dumps(asdict(config)))
    return log
