"""``sketch2face detect``: what the faces in sketches do, for people and for programs."""

from __future__ import annotations

import argparse
import json
import sys
from typing import TYPE_CHECKING, Any

from addon.console import Bar, distinct, file_name, say
from addon.terminal import mute, printable

if TYPE_CHECKING:
    from addon.drawing import Drawing
    from classifiers import Detection


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("sketch", type=file_name, nargs="+", help="pictures of drawn faces")
    parser.add_argument("--json", action="store_true", help="one JSON object a line and sketch")
    parser.add_argument(
        "--explain",
        type=file_name,
        metavar="OUT.png",
        help="write a picture: the lines that each action was read from, in colour",
    )


def run(options: argparse.Namespace) -> int:
    from facs_rig.common.files import Outputs, check_output

    if options.explain:
        check_output(options.explain, (".png",))
        for path in options.sketch:
            distinct([path, options.explain])

    from addon.drawing import PAINTED, load_drawing
    from classifiers import load_detector
    from facs_rig.common.errors import InputError

    detector = None
    status = 0
    drawings = {}
    for path in options.sketch:
        try:
            drawing = load_drawing(path)
        except InputError as error:
            status = say(str(error), 2)
            continue
        detector = detector or load_detector()
        detection = detector.detect(drawing.image)
        upright = drawing.turned(detection.turn)
        if detection.trouble:
            status = say(detection.no_face(f"'{path}'"), 2)
        elif detection.turn:
            say(f"{detection.how_it_lay()} ('{path}')", 0)
        if drawing.painted:
            say(f"{PAINTED} ('{path}')", 0)
        if options.json:
            told = json.dumps(_detection_json(path, upright, detection, detector.model))
        else:
            told = _tell_detection(path, detection)
        try:
            print(told, flush=True)
        except BrokenPipeError:
            if not options.explain:
                raise
            mute(sys.stdout)  # the picture is still wanted
        if options.explain:
            drawings[path] = drawing.image
    if detector and drawings and not status:
        from addon.explain import explain

        with Bar("explaining") as bar:
            picture = explain(drawings, detector, bar)
        with Outputs() as outputs:
            picture.save(outputs.beside(options.explain))
    return status


def _detection_json(
    path: str, drawing: Drawing, detection: Detection, model: dict[str, Any]
) -> dict[str, Any]:
    """The contract's object for one sketch; lengths in pixels of the file that was given.

    drawing : as it was turned to be read
    """
    places = drawing.to_input(list(detection.landmarks.values()))
    return {
        "sketch": path,
        **detection.to_json(),
        "face": not detection.trouble,
        "face_probability": round(detection.face_probability, 4),
        "turned": detection.clockwise,
        "landmarks": {
            name: [round(float(u), 2), round(float(v), 2)]
            for name, (u, v) in zip(detection.landmarks, places, strict=True)
        },
        "confidences": {name: round(p, 4) for name, p in detection.confidences.items()},
        "faces": detection.faces_to_json(drawing.matrix),
        "model": {key: model[key] for key in ("format", "sha256", "size") if key in model},
    }


def _tell_detection(path: str, detection: Detection) -> str:
    lines = [printable(path)]
    if detection.trouble:
        return "\n".join([*lines, "  no face"])
    head = degrees(detection.to_json()["head"])
    lines.append(f"  face {detection.face_probability:.2f}, head {head}")
    if detection.left_out():
        lines.append(f"  {detection.left_out()}")
    order = sorted(detection.probabilities.items(), key=lambda item: -item[1])
    for name, probability in order:
        bar = "#" * round(20 * probability)
        active = f"active, {detection.intensities[name]:.1f}" if detection.active[name] else ""
        lines.append(f"  {name:<20} {probability:5.2f} {bar:<20} {active}".rstrip())
    return "\n".join(lines)


def degrees(head: dict[str, float]) -> str:
    return ", ".join(f"{name} {value:+.0f}°" for name, value in head.items())
