"""What each sub-command of ``sketch2face`` takes and does; see `addon.cli` for the frame.

Imports stand in the functions: a command loads what it needs, and help loads nothing.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from addon.console import (
    FACES,
    Bar,
    assignment,
    distinct,
    file_name,
    need_bpy,
    remark,
    say,
)
from addon.detect_command import degrees
from facs_rig.common.errors import InputError

if TYPE_CHECKING:
    from dataclasses import Field

# --- fit -----------------------------------------------------------------------------------------


def fit_arguments(parser: argparse.ArgumentParser) -> None:
    from addon.pipeline import METHODS, FitOptions
    from facs_rig.common.settings import settings_of
    from facs_rig.levels import FULL

    parser.add_argument(
        "sketch", type=file_name, help="picture of a drawn face (PNG, JPEG, WebP, TIFF, BMP, GIF)"
    )
    parser.add_argument(
        "-o",
        "--output",
        type=file_name,
        metavar="FACE",
        help=f"the face, {', '.join(FACES)} (default: SKETCH's name with .glb, in this folder)",
    )
    parser.add_argument(
        "--report", type=file_name, metavar="R.json", help="write what was read and measured"
    )
    parser.add_argument(
        "--preview",
        type=file_name,
        metavar="P.png",
        help="write a picture: sketch, fitted face as drawn and in three quarters, lines of both",
    )
    parser.add_argument(
        "--align",
        metavar="LEFT,TOP,RIGHT,BOTTOM",
        help="where the head is in the sketch, in pixels (default: found by itself)",
    )
    parser.add_argument(
        "--pin",
        metavar="NAME=U,V",
        action="append",
        default=[],
        help="where a landmark is in the sketch, in pixels, such as mouth_corner_left=312,402, if "
        "it was found at another place (several times for several; `detect --json` names them all)",
    )
    parser.add_argument(
        "--au",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="what a control does, at 0…10, if the sketch was read otherwise: smile=4, or smile=0 "
        "for none; the fit keeps to it (several times for several; `rig --list` names them all)",
    )
    parser.add_argument(
        "--method",
        choices=METHODS,
        default=FitOptions.method,
        help="lines: the face's lines are brought to the drawing's, its person and expression "
        "first; shape: person and expression alone, the skin stays smooth; thesis: the drawing's "
        f"contours slide over the shaded face (default {FitOptions.method})",
    )
    _setting_argument(parser, settings_of(FitOptions)["exaggerate"])
    _setting_argument(parser, settings_of(FitOptions)["hair"])
    _setting_argument(parser, settings_of(FitOptions)["beard"])
    parser.add_argument(
        "--detail",
        metavar="LEVEL",
        default=FULL,
        help="of the written face: full (the default), medium (a quarter of the polygons) or game "
        "(under 6,000 triangles)",
    )
    parser.add_argument("-q", "--quiet", action="store_true", help="say nothing when all is well")
    _stroke_arguments(parser)
    _tweakable_arguments(parser)


def _stroke_arguments(parser: argparse.ArgumentParser) -> None:
    """What becomes of the strokes that have no place on the face."""
    from addon.pipeline import UNMATCHED, FitOptions
    from facs_rig.common.settings import settings_of
    from snakes import PROFILES

    group = parser.add_argument_group(
        "strokes without a place", "scars, and wrinkles where the face has none"
    )
    group.add_argument(
        "--unmatched",
        choices=UNMATCHED,
        default=FitOptions.strokes,
        help="ignore them, engrave them into the skin or emboss them; hair, hatching and what is "
        f"off the face is never carved (default {FitOptions.strokes})",
    )
    group.add_argument(
        "--stroke-profile",
        choices=tuple(PROFILES),
        default=FitOptions.stroke_profile,
        help=f"a crease has low rims, a scar high ones (default {FitOptions.stroke_profile})",
    )
    for name in ("stroke_depth", "stroke_width"):
        _setting_argument(group, settings_of(FitOptions)[name])


def _tweakable_arguments(parser: argparse.ArgumentParser) -> None:
    """An option for every field of snakes.Tweakables."""
    from facs_rig.common.settings import settings_of
    from snakes import Tweakables

    group = parser.add_argument_group("tweakables", "how the lines pull the skin")
    for item in settings_of(Tweakables).values():
        _setting_argument(group, item)


def _setting_argument(group: argparse._ActionsContainer, item: Field[Any]) -> None:
    """An option for a setting, made from the field itself."""
    flag, about, kind = "--" + item.name.replace("_", "-"), item.metadata, type(item.default)
    text = about["help"].replace("%", "%%")
    if kind is bool:
        group.add_argument(
            flag, default=item.default, action=argparse.BooleanOptionalAction, help=text
        )
        return
    unit = f" {about['unit']}" if about["unit"] else ""
    limits = f", at most {about['maximum']:g}" if about["above"] is not None else ""
    if about["minimum"] is not None:
        limits = f", {about['minimum']:g}…{about['maximum']:g}"
    group.add_argument(
        flag,
        type=kind,
        default=item.default,
        choices=about["choices"],
        metavar=None if about["choices"] else {int: "N", float: "X"}.get(kind, "TEXT"),
        help=f"{text} (default {item.default}{unit}{limits})",
    )


def fit(options: argparse.Namespace) -> int:
    from addon.export import check_hair
    from facs_rig.common.box import Box
    from facs_rig.common.files import Outputs, check_output
    from facs_rig.levels import check_level
    from snakes import Tweakables, describe

    sketch = Path(options.sketch)
    face = Path(options.output or f"{sketch.stem or 'face'}.glb")
    distinct([sketch, face, options.report, options.preview])
    check_output(face, FACES)
    need_bpy(face)
    check_hair(face, options.hair)
    if options.report:
        check_output(options.report, (".json",))
    if options.preview:
        check_output(options.preview, (".png",))
    check_level(options.detail)
    values = {name: getattr(options, name) for name, *_ in describe()}
    tweakables = Tweakables(**values)
    if options.align is not None:
        Box.parse(options.align, "The head's box")

    from addon import pipeline
    from addon.drawing import PAINTED
    from classifiers import load_detector

    wanted = pipeline.FitOptions(
        tweakables=tweakables,
        align=options.align,
        pins=dict(map(_pin, options.pin)),
        expression=dict(assignment(text, "--au", "smile=4") for text in options.au),
        method=options.method,
        exaggerate=options.exaggerate,
        hair=options.hair,
        beard=options.beard,
        strokes=options.unmatched,
        stroke_depth=options.stroke_depth,
        stroke_width=options.stroke_width,
        stroke_profile=options.stroke_profile,
    )
    load_detector()
    with Bar("fitting") as bar:
        fitted = pipeline.fit(sketch, wanted, bar)
    report = pipeline.report(fitted, face)
    with Outputs() as outputs:
        if options.report:
            outputs.beside(options.report).write_text(json.dumps(report, indent=2) + "\n")
        if options.preview:
            from PIL import Image

            Image.fromarray(pipeline.preview(fitted)).save(outputs.beside(options.preview))
        pipeline.write_face(fitted, face, outputs, options.detail)
    if not options.quiet:
        _tell_fit(report, [face, options.report, options.preview])
        if fitted.detection.turn:
            say(fitted.detection.how_it_lay(), 0)
        if fitted.drawing.painted:
            say(PAINTED, 0)
        if fitted.detection.left_out():
            say(fitted.detection.left_out(), 0)
        if fitted.hat_left_out:
            say(pipeline.HAT_LEFT_OUT, 0)
    return 0


def _pin(text: str) -> tuple[str, tuple[float, float]]:
    """NAME=U,V as a name and a place; InputError if it is not."""
    name, _, place = text.partition("=")
    try:
        u, v = (float(part) for part in place.split(","))
    except ValueError:
        raise InputError(f"A pin is NAME=U,V, a landmark and its pixel, not '{text}'.") from None
    return name, (u, v)


def _tell_fit(report: dict[str, Any], written: Sequence[Any]) -> None:
    active = {name: au for name, au in report["aus"].items() if au["active"]}
    expression = ", ".join(f"{name} {au['intensity']:.1f}" for name, au in active.items())
    remark(f"expression     {expression or 'neutral'}")
    remark(f"head           {degrees(report['head'])}")
    error = report["contour_error_px"]
    remark(
        "contour error  "
        + ", ".join(f"{name} {error[name]:.2f} px" for name in ("template", "expression", "fitted"))
    )
    stages = dict(report["timings_s"])
    total = stages.pop("total")
    parts = ", ".join(f"{stage} {seconds:.2f}" for stage, seconds in stages.items())
    remark(f"time           {total:.2f} s ({parts})")
    remark(f"written        {', '.join(str(path) for path in written if path)}")


# --- generate, train, evaluate --------------------------------------------------------------------


def generate_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--count", type=int, required=True, help="how many samples")
    parser.add_argument(
        "--out", type=file_name, metavar="DIR", required=True, help="folder of the shards"
    )
    parser.add_argument("--seed", type=int, default=0, help="the same seed gives the same bytes")
    parser.add_argument(
        "--engine",
        choices=("contours", "conventions", "freestyle"),
        default="contours",
        help="what draws the lines: our own contours, conventions (features as people draw them, "
        "by artists drawn by lot), or Blender's Freestyle (needs bpy)",
    )
    parser.add_argument(
        "--scheme",
        choices=("people", "felt", "sparse", "thesis", "smooth", "varied"),
        default="people",
        help="people (default): a few actions at any strength, by people from six to ninety, each "
        "with ways and creases of their own, some stylised; felt: the same people, most of whom "
        "smile, laugh, weep, rage, sleep or rest, as people draw them; sparse: the actions of "
        "people by adults who do and crease alike; smooth: these without creases; varied: two in "
        "three of these with faint creases or none; thesis: every action at a random 0 to 5",
    )
    parser.add_argument(
        "--hair",
        metavar="SHARE",
        type=float,
        default=0.75,
        help="share of the faces that wear a head of hair, 0 to 1 (default 0.75), in the "
        "schemes people and felt, but by conventions, which have their own; 0: three in ten have "
        "one of four simple cuts, as in older data sets",
    )
    parser.add_argument(
        "--jobs", type=int, default=1, help="how many processes of this computer (default 1)"
    )
    parser.add_argument(
        "--dask",
        metavar="tcp://HOST:PORT",
        help="let the workers of the Dask scheduler at this address draw: the same bytes, and no "
        "shared disk is needed; they have the same packages as this computer (with --engine "
        "freestyle also bpy) and one thread each: dask worker ADDRESS --nworkers -1 --nthreads 1",
    )
    parser.add_argument(
        "--resume",
        action="store_true",
        help="go on with an interrupted run: whole shards stay, the others are made; the options "
        "that say what is drawn must be the same, --jobs and --dask may differ",
    )
    parser.add_argument(
        "--strokes", action="store_true", help="keep the coordinates of every line in the JSON"
    )
    parser.add_argument(
        "--meshes",
        action="store_true",
        help="keep the posed face as KEY.ply: metres, triangles, the same vertices in the same "
        "order in every sample; 2 MB each, so that a shard holds 25 samples instead of 250",
    )
    parser.add_argument(
        "--preview",
        metavar="N",
        type=int,
        default=0,
        help="also draw the first N samples on one sheet, DIR/preview.png",
    )


def generate(options: argparse.Namespace) -> int:
    from dataset_gen.folder import check_preview
    from dataset_gen.generate import generate
    from dataset_gen.linework.kernels import jitted

    if sys.stderr.isatty() and options.engine == "contours" and jitted() is None:
        say("numba would find the lines five times as fast: pip install numba", 0)
    if options.preview < 0:
        raise InputError(f"--preview must be at least 0, got {options.preview}.")
    if options.preview:
        check_preview(Path(options.out))
    started = time.perf_counter()
    with Bar("samples") as bar:
        shards = generate(
            options.count,
            options.out,
            seed=options.seed,
            engine=options.engine,
            jobs=options.jobs,
            resume=options.resume,
            scheme=options.scheme,
            strokes=options.strokes,
            meshes=options.meshes,
            dask=options.dask,
            hair=options.hair,
            progress=bar,
        )
    took = time.perf_counter() - started
    remark(f"{options.count} samples in {len(shards)} shards in {options.out}, {took:.0f} s")
    if options.preview:
        remark(f"written        {_preview(Path(options.out), options.preview)}")
    return 0


def _preview(folder: Path, count: int) -> Path:
    """Draw the first samples of a data set on one sheet beside its shards."""
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    from addon.sheet import grid
    from dataset_gen.folder import MARK, PREVIEW
    from dataset_gen.generate import read_shards
    from facs_rig.common.files import Outputs

    pictures = [picture[:, :, None] for picture, _ in islice(read_shards(folder), count)]
    sheet = grid(pictures, columns=math.ceil(math.sqrt(len(pictures))), gap=4)
    marks = PngInfo()
    marks.add_text("Software", MARK)
    with Outputs() as outputs:
        Image.fromarray(sheet[:, :, 0]).save(outputs.beside(folder / PREVIEW), pnginfo=marks)
    return folder / PREVIEW
