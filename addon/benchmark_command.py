"""``sketch2face benchmark``: action units on drawings, ours or any method's, on named test sets."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from addon.console import Bar, name_paths, remark
from addon.evaluate_command import reader_of
from facs_rig.common.errors import InputError

ABOUT = """\
Test sets of drawings that anybody can draw again, seed by seed, and a table of how well their
action units are read: by this program, or by another method whose answers are in a file of
JSON lines, one drawing each: {"set": "fresh", "index": 0, "aus": {"smile": 0.93, "blink": 0.02}}.
docs/benchmark.md says more.
"""


def arguments(parser: argparse.ArgumentParser) -> None:
    from classifiers.runtime import WEIGHTS
    from classifiers.training.benchmark import COUNT, SETS

    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.description = ABOUT
    parser.epilog = "test sets:\n" + "\n".join(
        f"  {name:12} {chosen.about}" for name, chosen in SETS.items()
    )
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR",
        help="folder of the test sets: what is missing is drawn, what is there is used again",
    )  # fmt: skip
    parser.add_argument(
        "--sets", nargs="+", metavar="SET", default=[name for name in SETS if name != "freestyle"],
        help="which of them (default: all but freestyle, which needs bpy)",
    )  # fmt: skip
    parser.add_argument(
        "--count", type=int, default=COUNT, help=f"drawings of each set (default {COUNT})"
    )
    parser.add_argument("--jobs", type=int, default=1, help="processes that draw (default 1)")
    parser.add_argument(
        "--answers", type=Path, metavar="FILE.jsonl", help="measure these answers, not our own"
    )
    parser.add_argument("--weights", type=Path, default=WEIGHTS, help="folder of other networks")
    parser.add_argument(
        "--baseline", type=Path, metavar="DIR", help="measure the GoogLeNets of this folder instead"
    )
    parser.add_argument(
        "--write",
        type=Path,
        metavar="FILE.jsonl",
        help="also write our answers, as --answers reads them",
    )
    parser.add_argument(
        "--draw-only", action="store_true", help="draw the sets, for another method to answer"
    )
    parser.add_argument("--json", action="store_true", help="a JSON object for each set, no table")
    name_paths(parser)


def run(options: argparse.Namespace) -> int:
    """Draw, answer, measure; InputError for answers or folders that cannot be used."""
    from classifiers.training import benchmark
    from classifiers.training.evaluate import rounded
    from facs_rig.common.files import Outputs

    if options.answers and (options.baseline or options.write):
        raise InputError("--answers are another method's: leave out --baseline and --write.")
    benchmark.check_names(options.sets)
    theirs = benchmark.read_answers(options.answers) if options.answers else None
    absent = [name for name in options.sets if theirs is not None and name not in theirs]
    if absent:
        raise InputError(
            f"{options.answers} does not answer the set {absent[0]}: name those that it does with "
            "--sets."
        )
    reader = None if theirs or options.draw_only else reader_of(options)
    results: dict[str, dict[str, Any]] = {}
    lines = []
    for name in options.sets:
        with Bar(f"{name}: drawings") as bar:
            data = benchmark.drawn(name, options.out, options.count, options.jobs, bar)
        mark = benchmark.fingerprint(data)
        if options.draw_only:
            remark(f"{name:12} {len(data)} drawings, fingerprint {mark}")
            continue
        if theirs is not None:
            said = theirs[name]
        else:
            assert reader is not None
            with Bar(f"{name}: answers") as bar:
                said = dict(enumerate(benchmark.answers_of(reader, data, bar)))
            lines += [json.dumps({"set": name, "index": k, "aus": a}) for k, a in said.items()]
        try:
            measured = benchmark.figures(said, data)
        except InputError as error:
            raise InputError(f"{options.answers or 'our answers'}, set {name}: {error}") from None
        results[name] = {"drawings": len(data), "fingerprint": mark} | measured
        if options.json:
            print(json.dumps(rounded({"set": name} | results[name])), flush=True)
    if options.write:
        with Outputs() as outputs:
            outputs.beside(options.write).write_text("\n".join(lines) + "\n", encoding="utf-8")
    if results and not options.json:
        print(benchmark.table(results))
    return 0
