"""What each sub-command of ``sketch2face`` takes and does; see `addon.cli` for the frame.

Imports stand in the functions: a command loads what it needs, and help loads nothing.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from addon.files import OutputError, Outputs, check_output

if TYPE_CHECKING:
    from addon.drawing import Drawing
    from classifiers import Detection

FACES = (".glb", ".obj", ".ply", ".blend")


class UsageError(ValueError):
    """A command line that cannot be carried out; the text is one sentence."""


def say(sentence: str, status: int) -> int:
    """One line on stderr, and the exit status passed through."""
    print(f"sketch2face: {' '.join(sentence.split())}", file=sys.stderr)
    return status


def _usage(call: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
    """Call something that answers wrong arguments with a ValueError of one sentence."""
    try:
        return call(*arguments, **named)
    except (UsageError, OutputError):
        raise
    except ValueError as error:
        raise UsageError(str(error)) from error


class Bar:
    """A progress bar on stderr, if that is a terminal; otherwise nothing. Call it (done, total)."""

    WIDTH = 32

    def __init__(self, label: str) -> None:
        self.label = label
        self.shown = sys.stderr.isatty()
        self._last = ""

    def __call__(self, done: int, total: int) -> None:
        if not self.shown:
            return
        full = self.WIDTH * done // max(total, 1)
        line = f"\r{self.label} [{'#' * full}{'.' * (self.WIDTH - full)}] {done}/{total}"
        if line != self._last:
            self._last = line
            sys.stderr.write(line)
            sys.stderr.flush()

    def __enter__(self) -> Bar:
        return self

    def __exit__(self, *_: object) -> None:
        if self._last:
            sys.stderr.write("\n")


# --- fit -----------------------------------------------------------------------------------------


def fit_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("sketch", help="picture of a drawn face (PNG, JPEG, WebP, TIFF, BMP, GIF)")
    parser.add_argument(
        "-o",
        "--output",
        metavar="FACE",
        help=f"the face, {', '.join(FACES)} (default: SKETCH's name with .glb, in this folder)",
    )
    parser.add_argument("--report", metavar="R.json", help="write what was read and measured")
    parser.add_argument(
        "--preview", metavar="P.png", help="write a picture: sketch, expression, fitted face"
    )
    parser.add_argument(
        "--align",
        metavar="LEFT,TOP,RIGHT,BOTTOM",
        help="where the head is in the sketch, in pixels (default: found by itself)",
    )
    parser.add_argument("-q", "--quiet", action="store_true", help="say nothing when all is well")
    _tweakable_arguments(parser)


def _tweakable_arguments(parser: argparse.ArgumentParser) -> None:
    """An option for every field of snakes.Tweakables, made from the field itself."""
    from snakes import describe

    group = parser.add_argument_group("tweakables", "how the lines pull the skin")
    for name, kind, default, about in describe():
        flag = "--" + name.replace("_", "-")
        unit = f" {about['unit']}" if about["unit"] else ""
        text = about["help"].replace("%", "%%")
        if kind is bool:
            group.add_argument(
                flag, default=default, action=argparse.BooleanOptionalAction, help=text
            )
            continue
        limits = "" if about["minimum"] is None else f", {about['minimum']:g}…{about['maximum']:g}"
        group.add_argument(
            flag,
            type=kind,
            default=default,
            choices=about["choices"],
            metavar=None if about["choices"] else {int: "N", float: "X"}.get(kind, "TEXT"),
            help=f"{text} (default {default}{unit}{limits})",
        )


def fit(options: argparse.Namespace) -> int:
    from snakes import Tweakables, describe, parse_box

    sketch = Path(options.sketch)
    face = Path(options.output or f"{sketch.stem or 'face'}.glb")
    _distinct([sketch, face, options.report, options.preview])
    check_output(face, FACES)
    if face.suffix.lower() == ".blend":
        _need_bpy(face)
    if options.report:
        check_output(options.report, (".json",))
    if options.preview:
        check_output(options.preview, (".png",))
    values = {name: getattr(options, name) for name, *_ in describe()}
    tweakables = _usage(Tweakables, **values)
    if options.align is not None:
        _usage(parse_box, options.align)

    from addon import pipeline

    wanted = pipeline.FitOptions(tweakables=tweakables, align=options.align)
    with Bar("fitting") as bar:
        fitted = pipeline.fit(sketch, wanted, bar)
    report = pipeline.report(fitted, face)
    with Outputs() as outputs:
        if options.report:
            outputs.beside(options.report).write_text(json.dumps(report, indent=2) + "\n")
        if options.preview:
            from PIL import Image

            Image.fromarray(pipeline.preview(fitted)).save(outputs.beside(options.preview))
        pipeline.write_face(fitted, face)  # whole or not at all by itself, and the last to appear
    if not options.quiet:
        _tell_fit(report, [face, options.report, options.preview])
    return 0


def _tell_fit(report: dict[str, Any], written: Sequence[Any]) -> None:
    active = {name: au for name, au in report["aus"].items() if au["active"]}
    expression = ", ".join(f"{name} {au['intensity']:.1f}" for name, au in active.items())
    print(f"expression     {expression or 'neutral'}")
    print(f"head           {_degrees(report['head'])}")
    error = report["contour_error_px"]
    print(
        "contour error  "
        + ", ".join(f"{name} {error[name]:.2f} px" for name in ("template", "expression", "fitted"))
    )
    stages = dict(report["timings_s"])
    total = stages.pop("total")
    parts = ", ".join(f"{stage} {seconds:.2f}" for stage, seconds in stages.items())
    print(f"time           {total:.2f} s ({parts})")
    print(f"written        {', '.join(str(path) for path in written if path)}")


# --- detect ---------------------------------------------------------------------------------------


def detect_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("sketch", nargs="+", help="pictures of drawn faces")
    parser.add_argument("--json", action="store_true", help="one JSON object a line and sketch")
    parser.add_argument(
        "--explain",
        metavar="OUT.png",
        help="write a picture of which strokes each answer rests on (for a single sketch)",
    )


def detect(options: argparse.Namespace) -> int:
    if options.explain:
        if len(options.sketch) > 1:
            raise UsageError("--explain takes a single sketch; call it once for each.")
        check_output(options.explain, (".png",))
        _distinct([options.sketch[0], options.explain])

    from addon.drawing import SketchError, load_drawing
    from classifiers import load_detector

    detector = None
    status = 0
    for path in options.sketch:
        try:
            drawing = load_drawing(path)
        except SketchError as error:
            status = say(str(error), 2)
            continue
        detector = detector or load_detector()
        detection = detector.detect(drawing.image)
        if options.json:
            print(json.dumps(_detection_json(path, drawing, detection, detector.model)), flush=True)
        else:
            _tell_detection(path, detection)
        if options.explain:
            from addon.explain import explain

            with Bar("explaining") as bar:
                picture = explain(drawing.image, detector, bar)
            with Outputs() as outputs:
                picture.save(outputs.beside(options.explain))
    return status


def _detection_json(
    path: str, drawing: Drawing, detection: Detection, model: dict[str, Any]
) -> dict[str, Any]:
    """The contract's object for one sketch; lengths in pixels of the file that was given."""
    places = drawing.to_input(list(detection.landmarks.values()))  # type: ignore[arg-type]
    return {
        "sketch": path,
        **detection.to_json(),
        "face_probability": round(detection.face_probability, 4),
        "landmarks": {
            name: [round(float(u), 2), round(float(v), 2)]
            for name, (u, v) in zip(detection.landmarks, places, strict=True)
        },
        "model": {key: model[key] for key in ("format", "sha256", "size") if key in model},
    }


def _tell_detection(path: str, detection: Detection) -> None:
    print(path)
    print(f"  face {detection.face_probability:.2f}, head {_degrees(detection.to_json()['head'])}")
    order = sorted(detection.probabilities.items(), key=lambda item: -item[1])
    for name, probability in order:
        bar = "#" * round(20 * probability)
        active = f"active, {detection.intensities[name]:.1f}" if detection.active[name] else ""
        print(f"  {name:<20} {probability:5.2f} {bar:<20} {active}".rstrip())


def _degrees(head: dict[str, float]) -> str:
    return ", ".join(f"{name} {value:+.0f}°" for name, value in head.items())


# --- generate, train, evaluate --------------------------------------------------------------------


def generate_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--count", type=int, required=True, help="how many samples")
    parser.add_argument("--out", metavar="DIR", required=True, help="folder of the shards")
    parser.add_argument("--seed", type=int, default=0, help="the same seed gives the same bytes")
    parser.add_argument(
        "--engine",
        choices=("contours",),
        default="contours",
        help="what draws the lines: occluding and suggestive contours",
    )
    parser.add_argument(
        "--scheme",
        choices=("sparse", "thesis"),
        default="sparse",
        help="sparse: a few actions at any strength; thesis: every action at a random 0 to 5",
    )
    parser.add_argument("--jobs", type=int, default=1, help="how many processes (default 1)")
    parser.add_argument(
        "--resume", action="store_true", help="go on with an interrupted run of the same seed"
    )


def generate(options: argparse.Namespace) -> int:
    from dataset_gen.generate import generate

    with Bar("samples") as bar:
        shards = _usage(
            generate,
            options.count,
            options.out,
            seed=options.seed,
            engine=options.engine,
            jobs=options.jobs,
            resume=options.resume,
            scheme=options.scheme,
            progress=bar,
        )
    print(f"{options.count} samples in {len(shards)} shards in {options.out}")
    return 0


def train_arguments(parser: argparse.ArgumentParser) -> None:
    from classifiers import train

    train.add_arguments(parser)


def train(options: argparse.Namespace) -> int:
    from classifiers import train

    return _usage(train.run, options) or 0


def evaluate_arguments(parser: argparse.ArgumentParser) -> None:
    from classifiers import evaluate

    evaluate.add_arguments(parser)


def evaluate(options: argparse.Namespace) -> int:
    from classifiers import evaluate

    return _usage(evaluate.run, options) or 0


# --- rig ------------------------------------------------------------------------------------------


def rig_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="the controls as one JSON object")
    parser.add_argument(
        "-o", "--output", metavar="FACE", help=f"write the rig's face, {', '.join(FACES)}"
    )
    parser.add_argument(
        "--au",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="pose the written face: a control at 0…10, 5 is fully activated (may be repeated)",
    )


def rig(options: argparse.Namespace) -> int:
    from facs_rig import CONTROLS, IDENTITY, FaceParameters, load_rig
    from facs_rig.parameters import intensities

    if options.output:
        face = check_output(options.output, FACES)
        if face.suffix.lower() == ".blend":
            _need_bpy(face)
        from addon.export import write_mesh

        aus = dict(_assignment(text) for text in options.au)
        _usage(intensities, aus)
        write_mesh(face, load_rig(), FaceParameters(aus=aus))
        print(f"written        {face}")
    elif options.au:
        raise UsageError("--au poses the face that -o writes; add -o FACE.glb.")
    elif options.json:
        table = {
            "controls": [
                {
                    "name": c.name,
                    "label": c.label,
                    "region": c.region,
                    "aus": list(c.aus),
                    "muscle": c.muscle,
                    "side": c.side,
                    "signature": c.signature,
                }
                for c in CONTROLS
            ],
            "identity": [
                {
                    "name": f.name,
                    "label": f.label,
                    "minimum": f.minimum,
                    "maximum": f.maximum,
                    "default": f.default,
                }
                for f in IDENTITY
            ],
        }
        print(json.dumps(table, indent=2))
    else:
        print(f"{len(CONTROLS)} controls, each 0 to 10 (5 is a full natural activation):")
        for control in CONTROLS:
            units = " ".join(control.aus)
            print(f"  {control.name:<22}{control.region:<7}{units:<14}{control.label}")
        print(f"{len(IDENTITY)} identity parameters:")
        for f in IDENTITY:
            print(f"  {f.name:<30}{f.minimum:g} to {f.maximum:g}, default {f.default:g}")
    return 0


def _assignment(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name.strip(), float(value)
    except ValueError:
        raise UsageError(f"--au takes NAME=VALUE, such as smile=5, not '{text}'.") from None


def _distinct(paths: Sequence[Any]) -> None:
    seen: set[Path] = set()
    for path in (Path(path).resolve() for path in paths if path):
        if path in seen:
            raise UsageError(f"'{path.name}' is named twice; give every file a name of its own.")
        seen.add(path)


def _need_bpy(face: Path) -> None:
    from importlib.util import find_spec

    if find_spec("bpy") is None:
        raise UsageError(
            f"writing '{face}' needs Blender as a module: pip install 'sketch-to-face[blender]'"
        )
