"""``sketch2face rig``: the catalogue of the face's controls, their contact sheet, posed faces."""

from __future__ import annotations

import argparse
import json
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from addon.console import (
    FACES,
    Bar,
    assignment,
    distinct,
    file_name,
    need_bpy,
    remark,
)
from facs_rig.common.errors import InputError

if TYPE_CHECKING:
    from facs_rig import FaceParameters

EXAMPLES = """\
examples:
  sketch2face rig --list                                  the 47 controls and who can wear them
  sketch2face rig --sheet controls.png                    every control at 0, 2.5 and 5
  sketch2face rig --sheet lips.png --only purse pucker --size 320 --drawn
  sketch2face rig -o face.glb --au smile=4 --au squint=2 --identity age=0.8 --head=-20,5,0
  sketch2face rig -o manga.glb --person manga --au smile=4 --identity eye_size=2.8
  sketch2face rig -o face.fbx --expression joy.json --names arkit
  sketch2face rig -o light.glb --detail medium             or game: fewer polygons, the same keys
"""


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.epilog = EXAMPLES
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    # `--gaze -10,5`: what begins like a number is a value, not an option.
    parser._negative_number_matcher = re.compile(r"^-[\d.]")

    show = parser.add_argument_group("list (the default)")
    show.add_argument("--list", action="store_true", help="list controls and identity parameters")
    show.add_argument("--json", action="store_true", help="the list as one JSON object")

    sheet = parser.add_argument_group("contact sheet")
    sheet.add_argument(
        "--sheet",
        type=file_name,
        metavar="OUT.png",
        help="draw every control at 0, 2.5 and 5 (5 is full)",
    )
    sheet.add_argument("--size", type=int, metavar="N", help="pixels of a face (default 160)")
    sheet.add_argument("--shaded", action="store_true", help="only shaded faces")
    sheet.add_argument("--drawn", action="store_true", help="only line drawings")
    sheet.add_argument("--view", choices=("front", "three-quarter"), help="(default front)")
    sheet.add_argument(
        "--layers",
        metavar="NAME",
        nargs="+",
        help="surface strokes of the drawings (default: brow iris pupil lip; more: brow_hair lash "
        "lash_lower lip_line hairline hair_short …)",
    )
    sheet.add_argument("--only", metavar="NAME", nargs="+", help="these controls alone")

    export = parser.add_argument_group("posed face")
    export.add_argument(
        "-o",
        "--output",
        type=file_name,
        metavar="FACE",
        help=f"write a posed face, {', '.join(FACES)}",
    )
    export.add_argument(
        "--expression",
        type=file_name,
        metavar="FILE.json",
        help="start from an expression saved in Blender",
    )
    export.add_argument(
        "--au",
        metavar="NAME=VALUE",
        action="append",
        help="a control at 0…10, 5 is a full natural activation (may be repeated)",
    )
    export.add_argument("--gaze", metavar="YAW,PITCH", help="degrees, to the own left and down")
    export.add_argument("--head", metavar="YAW,PITCH,ROLL", help="degrees that the head turns")
    export.add_argument("--neck", metavar="YAW,PITCH,ROLL", help="degrees that the neck turns")
    export.add_argument(
        "--names", choices=("ours", "arkit"), help="shape keys: our 47 (default) or ARKit's 52"
    )
    export.add_argument(
        "--detail",
        metavar="LEVEL",
        help="full, medium (a quarter of the polygons) or game (under 6,000 triangles)",
    )
    export.add_argument(
        "--keys",
        action="store_true",
        help="beside FACE.obj a folder FACE_keys with a face for each shape key",
    )

    parser.add_argument(
        "--person",
        metavar="NAME",
        help="a stylised person to start from, for --sheet and -o: comic, manga, chibi … (--list)",
    )
    parser.add_argument(
        "--identity",
        metavar="NAME=VALUE",
        action="append",
        help="whose face, for --sheet and -o (may be repeated)",
    )


# What only one of the jobs understands.
OWN = {
    "--sheet OUT.png": ("size", "shaded", "drawn", "view", "layers", "only"),
    "-o FACE": ("expression", "au", "gaze", "head", "neck", "names", "keys", "detail"),
}


def run(options: argparse.Namespace) -> int:
    if options.sheet and options.output:
        raise InputError("--sheet and -o are two jobs; call the command once for each.")
    if (options.list or options.json) and (options.sheet or options.output):
        raise InputError("--list and --json print the list; leave --sheet and -o away.")
    for job, names in OWN.items():
        asked = options.sheet if job.startswith("--sheet") else options.output
        for name in names:
            if getattr(options, name) and not asked:
                raise InputError(f"--{name} belongs to {job}; add that.")
    for name in ("identity", "person"):
        if getattr(options, name) and not (options.sheet or options.output):
            raise InputError(f"--{name} belongs to --sheet OUT.png or -o FACE; add one of them.")
    if options.sheet:
        return _sheet(options)
    if options.output:
        return _export(options)
    return _list(options.json)


# --- the list -------------------------------------------------------------------------------------


def catalogue() -> dict[str, Any]:
    """Controls and identity parameters with all that is known of them, for JSON."""
    from facs_rig import CONTROLS, IDENTITY
    from facs_rig.stylised import PRESETS

    return {
        "controls": [
            {
                "name": c.name,
                "label": c.label,
                "region": c.region,
                "aus": list(c.aus),
                "muscle": c.muscle,
                "side": c.side,
                "signature": c.signature,
                "mix": [{"shape": shape, "weight": weight} for shape, weight in c.mix],
                "creases": list(c.creases),
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
                "style": f.style and list(f.style),
            }
            for f in IDENTITY
        ],
        "people": [{"name": p.name, "label": p.label, "identity": p.identity} for p in PRESETS],
        "counts": dict(Counter(c.region for c in CONTROLS)),
    }


def _list(as_json: bool) -> int:
    table = catalogue()
    if as_json:
        print(json.dumps(table, indent=2))
        return 0
    counts = ", ".join(f"{n} {region}" for region, n in table["counts"].items())
    print(
        f"{len(table['controls'])} controls ({counts}), "
        "each 0 to 10 (5 is a full natural activation):"
    )
    for c in table["controls"]:
        units = " ".join(c["aus"])
        print(f"  {c['name']:<22}{c['region']:<7}{units:<12}{c['label']:<23}{c['signature']}")
    print(f"{len(table['identity'])} identity parameters:")
    for f in table["identity"]:
        limits = f"{f['minimum']:g} to {f['maximum']:g}, default {f['default']:.3g}"
        far = f"  (stylised: {f['style'][0]:g} to {f['style'][1]:g})" if f["style"] else ""
        print(f"  {f['name']:<22}{limits:<25}{f['label']}{far}")
    print(f"{len(table['people'])} stylised people, for --person:")
    print(f"  {' '.join(p['name'] for p in table['people'])}")
    return 0


# --- the contact sheet ----------------------------------------------------------------------------


def _sheet(options: argparse.Namespace) -> int:
    from facs_rig.common.files import Outputs, check_output

    check_output(options.sheet, (".png",))
    identity = _identity(options)

    from addon import sheet
    from facs_rig import CONTROL_NAMES, load_rig
    from facs_rig.identity import check_identity

    check_identity(identity)
    both = options.shaded == options.drawn
    kinds = sheet.KINDS if both else ("shaded",) if options.shaded else ("drawn",)
    with Bar("drawing") as bar:
        picture = sheet.contact_sheet(
            load_rig(),
            tuple(options.only or CONTROL_NAMES),
            kinds=kinds,
            view=options.view or "front",
            size=sheet.SIZE if options.size is None else options.size,
            identity=identity,
            layers=options.layers or sheet.LAYERS,
            progress=bar,
        )
    with Outputs() as outputs:
        sheet.paletted(picture).save(outputs.beside(options.sheet), format="PNG", optimize=True)
    remark(f"written        {options.sheet} ({picture.shape[1]} x {picture.shape[0]} pixels)")
    return 0


# --- a posed face ---------------------------------------------------------------------------------


def _export(options: argparse.Namespace) -> int:
    from facs_rig.common.files import check_output

    face = check_output(options.output, FACES)
    if options.keys and face.suffix.lower() != ".obj":
        raise InputError(f"'{face.name}' holds its shape keys itself; --keys is for .obj alone.")
    if options.names and face.suffix.lower() in (".obj", ".ply") and not options.keys:
        raise InputError(
            f"a file such as '{face.name}' cannot hold shape keys; use .glb, .fbx, .blend, "
            "or .obj with --keys."
        )
    if options.detail:
        from facs_rig.levels import check_level

        check_level(options.detail)
    distinct([face, options.expression])
    need_bpy(face)
    parameters = _parameters(options)

    from addon.export import write_mesh
    from facs_rig import load_rig
    from facs_rig.levels import FULL

    with Bar("writing") as bar:
        write_mesh(
            face,
            load_rig(),
            parameters,
            names=options.names or "ours",
            keys=options.keys,
            detail=options.detail or FULL,
            progress=bar,
        )
    remark(f"written        {face}")
    return 0


def _parameters(options: argparse.Namespace) -> FaceParameters:
    """The face that the options describe: the expression file first, then what is named."""
    from facs_rig import FaceParameters, expressions

    start = FaceParameters()
    if options.expression:
        start = expressions.read(options.expression)
    aus = dict(assignment(text, "--au", "smile=5") for text in options.au or ())
    identity = _identity(options)
    turns: Mapping[str, Any] = {
        part: _angles(getattr(options, part), part, names)
        for part, names in expressions.TURNS.items()
        if getattr(options, part)
    }
    posed = replace(
        start, aus={**start.aus, **aus}, identity={**start.identity, **identity}, **turns
    )
    expressions.check(posed)
    return posed


def _identity(options: argparse.Namespace) -> dict[str, float]:
    """Who the options name: the stylised person, then what is changed of him."""
    from facs_rig.stylised import preset

    named = dict(assignment(text, "--identity", "age=0.8") for text in options.identity or ())
    return {**(preset(options.person) if options.person else {}), **named}


def _angles(text: str, part: str, names: tuple[str, ...]) -> tuple[float, ...]:
    """Radians from degrees with commas between them."""
    from math import radians

    try:
        degrees = [float(value) for value in text.split(",")]
    except ValueError:
        degrees = []
    if len(degrees) != len(names):
        wanted = ",".join(name.upper() for name in names)
        raise InputError(f"--{part} takes {wanted} in degrees, not '{text}'.")
    return tuple(radians(value) for value in degrees)
