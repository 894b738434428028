"""Make every picture of the documentation anew, but the photographs of Blender's window.

    make pictures
    python docs/pictures.py controls drawings      # some of them

The photographs come from `tests/blender/window` (see docs/development.md).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from carved_pictures import carved_faces
from data_pictures import drawn_features, histograms, page_of_drawings
from data_pictures import ways as drawn_ways
from fit_pictures import (
    generated_examples,
    living_faces,
    shipped_examples,
    steps_of_both_methods,
)
from hair_pictures import beards_of_all_kinds, heads_of_hair
from hair_pictures import drawn_hair as drawings_of_hair
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from sphere_picture import sphere_example
from style_pictures import stylised_people

from addon.sheet import (
    KINDS,
    LAYERS,
    PAPER,
    VIEWS,
    captioned,
    close_up,
    contact_sheet,
    face_picture,
    grid,
    paletted,
    whole_head,
)
from dataset_gen import draw_strokes
from dataset_gen.linework import ink
from facs_rig import (
    CONTROL_NAMES,
    CONTROLS,
    FULL_INTENSITY,
    TWELVE,
    Camera,
    FaceParameters,
    FaceRig,
    landmark_points,
    load_rig,
)
from facs_rig.actions import drawn_actions
from facs_rig.expressions import random_expression
from facs_rig.folds import drawn_creases
from facs_rig.identity import FEATURES
from facs_rig.levels import LEVELS, at_level
from facs_rig.macros import age_of
from facs_rig.raster import rasterise

IMAGES = Path(__file__).parent / "images"
Picture = NDArray[np.uint8]


def coloured(picture: NDArray) -> Picture:
    """A grey picture (h, w) as (h, w, 3)."""
    return np.repeat(picture[:, :, None], 3, axis=2) if picture.ndim == 2 else picture


def sheet(pictures: list[NDArray], columns: int) -> Picture:
    """Pictures of one size in rows of `columns`."""
    return grid([coloured(picture) for picture in pictures], columns)


def save(name: str, picture: Picture, few_colours: bool = True) -> None:
    IMAGES.mkdir(exist_ok=True)
    image = paletted(picture) if few_colours else Image.fromarray(picture)
    image.save(IMAGES / name, optimize=True)
    kilobytes = (IMAGES / name).stat().st_size / 1000
    print(f"docs/images/{name}  {picture.shape[1]}x{picture.shape[0]}, {kilobytes:.0f} kB")


def portrait(size: int) -> Camera:
    """A camera that fills a square with the default head."""
    neutral = load_rig().neutral()
    return Camera.framing(neutral[neutral[:, 1] > -0.1], size, size, 0.02)


def controls() -> None:
    """All 47 controls at full natural activation, and at rest."""
    rig, camera = load_rig(), close_up(load_rig(), size=200)
    at_rest = face_picture(rig, FaceParameters(), camera, "shaded")
    pictures = [captioned(at_rest, "at rest")]
    for control in CONTROLS:
        face = FaceParameters({control.name: FULL_INTENSITY})
        text = f"{control.name} ({'+'.join(control.aus)})"
        pictures.append(captioned(face_picture(rig, face, camera, "shaded"), text))
    save("controls.png", grid(pictures, 8))


def creases() -> None:
    """The twelve detected controls as line drawings: it is by their creases that they show."""
    rig, camera = load_rig(), portrait(256)
    pictures = []
    for name in ("", *TWELVE):
        posed = rig.pose(FaceParameters({name: 5.0} if name else {}))
        picture = ink(draw_strokes(rig, posed, camera, 1), 256, 256)
        pictures.append(captioned(coloured(picture), name or "at rest"))
    posed = rig.pose(FaceParameters({"smile": 5.0, "squint": 3.0}, {"age": 0.9}, (0.6, 0.1, 0.0)))
    picture = ink(draw_strokes(rig, posed, camera, 1), 256, 256)
    pictures.append(captioned(coloured(picture), "old, turned"))
    save("creases.png", sheet(pictures, 7))


# --- the face (docs/face.md) ---------------------------------------------------------------------

# Sheets of some twelve controls each, so that every one can be read.
SHEETS = {
    "upper": [c.name for c in CONTROLS if c.region == "upper"],
    "mid": [c.name for c in CONTROLS if c.region == "mid"],
    "mouth": [c.name for c in CONTROLS if c.region == "lower"][:11],
    "lips_jaw": [c.name for c in CONTROLS if c.region == "lower"][11:],
}


def contact_sheets() -> None:
    """Every control at 0, 2.5 and 5, shaded and drawn, from the front and in three quarters."""
    assert sorted(name for names in SHEETS.values() for name in names) == sorted(CONTROL_NAMES)
    for title, names in SHEETS.items():
        for view in VIEWS:
            picture = contact_sheet(load_rig(), names, view=view, size=200, columns=3)
            save(f"face_{title}_{view.replace('-', '_')}.png", picture)


PAIRS = (
    ("frontalis", "medialis_frontalis"),
    ("squint", "outer_squint"),
    ("wince", "sneer"),
    ("grimace", "smile"),
)


def pairs() -> None:
    """The thesis' subtle pairs, drawn at 256 px."""
    rig, camera = load_rig(), portrait(256)
    blocks = []
    for pair in PAIRS:
        faces = []
        for name in pair:
            posed = rig.pose(FaceParameters({name: FULL_INTENSITY}))
            lines = ink(draw_strokes(rig, posed, camera, 1), 256, 256)
            faces.append(captioned(np.minimum(coloured(lines), PAPER), name))
        blocks.append(np.concatenate(faces, axis=1))
    save("face_pairs.png", grid(blocks, 2, gap=24))


def only(who: str) -> dict[str, float]:
    """Shares of a single ethnicity."""
    return {name: float(name == who) for name in ("african", "asian", "caucasian")}


PEOPLE = {
    "young woman, African": {"gender": 0.0, **only("african")},
    "young woman, Asian": {"gender": 0.0, **only("asian")},
    "young woman, Caucasian": {"gender": 0.0, **only("caucasian")},
    "young man, African": {"gender": 1.0, **only("african"), "jaw_width": 0.4},
    "man, Asian, heavy": {"gender": 1.0, "age": 0.35, "weight": 1.0, **only("asian")},
    "woman, Caucasian, thin": {"gender": 0.0, "age": 0.5, "weight": -1.0, **only("caucasian")},
    "old woman, African": {"gender": 0.0, "age": 1.0, **only("african")},
    "old man, Caucasian": {"gender": 1.0, "age": 1.0, "nose_hump": 0.6, **only("caucasian")},
}


def identities() -> None:
    """The same smile on different people."""
    rig = load_rig()
    camera = whole_head(rig, [FaceParameters({}, who) for who in PEOPLE.values()], 230)
    rows = []
    for aus, kind in (({}, "shaded"), ({"smile": 4.5}, "shaded"), ({"smile": 4.5}, "drawn")):
        row = [face_picture(rig, FaceParameters(aus, who), camera, kind)
               for who in PEOPLE.values()]  # fmt: skip
        rows.append(np.concatenate(row, axis=1))
    width = rows[0].shape[1] // len(PEOPLE)
    names = [captioned(np.full((1, width, 3), PAPER, np.uint8), name, 12) for name in PEOPLE]
    save("identities.png", np.concatenate([*rows, np.concatenate(names, axis=1)]))


AGES = (6, 12, 25, 60, 75, 90)


def face_ages() -> None:
    """Both sexes at AGES, shaded and drawn."""
    rig = load_rig()
    people = [{"gender": g, "age": age_of(years)} for g in (0.0, 1.0) for years in AGES]
    faces = [FaceParameters({}, who) for who in people]
    camera = whole_head(rig, faces, 250)
    layers = ("brow", "brow_hair", "iris", "pupil", "lip")
    rows = []
    for kind in KINDS:
        rows += [face_picture(rig, face, camera, kind, layers=layers) for face in faces]
    page = grid(rows, len(AGES))
    width = page.shape[1] // len(AGES)
    names = [captioned(np.full((1, width, 3), PAPER, np.uint8), f"{y} years", 12) for y in AGES]
    save("face_ages.png", np.concatenate([page, np.concatenate(names, axis=1)]))


OWN_WAYS = ("smile", "frown", "sneer", "wince", "brow_furrow", "pucker")


def face_variants() -> None:
    """What the default person does, and eight who look the same and have their own ways."""
    rig, camera = load_rig(), close_up(load_rig(), size=170)
    people = [{}, *(drawn_actions(np.random.default_rng(k)) for k in range(8))]
    rows = []
    for name in OWN_WAYS:
        for kind in KINDS:
            faces = [FaceParameters({name: FULL_INTENSITY}, who) for who in people]
            rows.append(grid([face_picture(rig, face, camera, kind) for face in faces], 9))
        rows[-1] = captioned(rows[-1], name)
    save("face_variants.png", np.concatenate(rows))


def features() -> None:
    """Every feature of the identity at its two ends."""
    rig, size = load_rig(), 150
    largest = [FaceParameters({}, {name: 1.0}) for name in ("head_width", "head_height")]
    head, face = whole_head(rig, largest, size), close_up(rig, size=size)
    blocks = []
    for feature in FEATURES:
        camera = head if feature.low.split("/")[0] in ("head", "forehead", "ears", "neck") else face
        ends = [face_picture(rig, FaceParameters({}, {feature.name: v}), camera, "shaded")
                for v in (feature.minimum, feature.maximum)]  # fmt: skip
        blocks.append(captioned(np.concatenate(ends, axis=1), feature.name))
    save("face_features.png", grid(blocks, 7, gap=8))


def styles() -> None:
    """Stylised people."""
    save("face_styles.png", stylised_people())


def layers() -> None:
    """Surface strokes that a drawing may have, and hair; they move with the face."""
    rig = load_rig()
    fine = ("brow_hair", "iris", "pupil", "lash", "lash_lower", "lip", "lip_line")
    styles = sorted(name for name in rig.curves if name.startswith("hair_"))
    sets = {
        "contours alone": (),
        "brow, iris, pupil, lip": LAYERS,
        "brow_hair, lash, lip_line": fine,
        "hairline": (*fine, "hairline"),
        **{name: (*fine, name) for name in styles},
    }
    rest = FaceParameters({}, {"gender": 0.3})
    lively = FaceParameters({"smile": 4.0, "squint": 2.0, "frontalis_left": 3.0},
                            {"gender": 0.3}, (0.6, 0.1, 0.1))  # fmt: skip
    blocks = []
    for text, chosen in sets.items():
        head = whole_head(rig, [rest, lively], 280)
        # Hair needs more room than the head, above all at its sides.
        camera = head.cropped(-12, -36, head.width + 12, head.height + 4, head.width + 24, 320)
        faces = [face_picture(rig, face, camera, "drawn", layers=chosen) for face in (rest, lively)]
        blocks.append(captioned(np.concatenate(faces), text))
    save("face_layers.png", grid(blocks, 4))


def levels() -> None:
    """The levels of detail: at rest with their polygons, acting, and as line drawings."""
    acting = FaceParameters({"smile": 4.0, "jaw_open": 3.0, "frontalis": 3.0})
    asleep = FaceParameters({"blink": 5.0, "frown": 3.0})
    camera = close_up(load_rig(), size=420)
    pictures = []
    for name in LEVELS:
        rig = at_level(load_rig(), name)
        shaded = [face_picture(rig, face, camera, "shaded") for face in (acting, asleep)]
        drawn = face_picture(rig, acting, camera, "drawn")
        row = np.concatenate([wireframe(rig, camera), *shaded, drawn], axis=1)
        text = f"{name}: {rig.n_vertices:,} vertices, {len(rig.triangles):,} triangles"
        pictures.append(captioned(row, text, 16))
    save("face_levels.png", np.concatenate(pictures))


def wireframe(rig: FaceRig, camera: Camera) -> Picture:
    """The polygons of a face at rest that are seen, on its shaded picture."""
    vertices = rig.neutral()
    shown = face_picture(rig, FaceParameters(), camera, "shaded")
    page = Image.fromarray(shown).resize((2 * camera.width, 2 * camera.height))
    draw, pixels = ImageDraw.Draw(page), 2 * camera.project(vertices)
    seen = np.unique(rasterise(vertices, rig.triangles, camera).triangle)
    sizes = np.diff(np.append(rig.polygon_starts, len(rig.polygon_vertices)))
    owner = np.repeat(np.arange(len(sizes)), sizes - 2)
    skin = rig.vertex_part[rig.polygon_vertices[rig.polygon_starts]] == 0
    for polygon in np.unique(owner[seen[seen >= 0]]):
        if skin[polygon]:
            start = rig.polygon_starts[polygon]
            ring = pixels[rig.polygon_vertices[start : start + sizes[polygon]]]
            draw.polygon([tuple(point) for point in ring[:, :2]], outline="#3050a0")
    return np.asarray(page.resize((camera.width, camera.height), Image.Resampling.LANCZOS))


def gaze() -> None:
    """Where the eyes look, and the lids that follow them; then blinks while looking."""
    rig = load_rig()
    place = landmark_points(rig, rig.neutral())
    left, right = place["eye_outer_right"][0] - 0.012, place["eye_outer_left"][0] + 0.012
    top, bottom = place["brow_peak_left"][1] + 0.01, place["eye_bottom_left"][1] - 0.014
    scale = 300 / (right - left)
    camera = Camera(300, round(scale * (top - bottom)), (scale, scale),
                    (-scale * left, scale * top))  # fmt: skip

    def eyes(yaw: float, pitch: float, aus: dict[str, float], kind: str) -> Picture:
        looking = FaceParameters(aus, gaze=(np.radians(yaw), np.radians(pitch)))
        return face_picture(rig, looking, camera, kind)

    blocks = []
    for pitch, up in ((-25, "up"), (0, ""), (25, "down")):
        for yaw, side in ((-30, "to the own right"), (0, ""), (30, "to the own left")):
            text = " and ".join(t for t in (up, side) if t) or "ahead"
            faces = [eyes(yaw, pitch, {}, kind) for kind in ("shaded", "drawn")]
            blocks.append(captioned(np.concatenate(faces), text))
    for aus, text in (({"blink": 2.5}, "down, half a blink"), ({"squint": 5.0}, "down, squint"),
                      ({"lid_raise": 5.0}, "down, lids raised")):  # fmt: skip
        faces = [eyes(0, 25, aus, kind) for kind in ("shaded", "drawn")]
        blocks.append(captioned(np.concatenate(faces), text))
    save("face_gaze.png", grid(blocks, 3, gap=10))


def faces_of(expressions: dict[str, FaceParameters], columns: int = 7, size: int = 200,
             lines: int = 1) -> Picture:  # fmt: skip
    """Captioned close-ups, shaded over drawn."""
    rig = load_rig()
    blocks = []
    for text, face in expressions.items():
        camera = close_up(rig, size=size, identity=dict(face.identity))
        both = [face_picture(rig, face, camera, kind) for kind in ("shaded", "drawn")]
        blocks.append(captioned(np.concatenate(both), text, 12, lines))
    return grid(blocks, columns, gap=6)


def one_sided() -> None:
    """What the face does on one side, at full natural activation."""
    names = [c.name for c in CONTROLS if c.side != "both"]
    save("face_one_sided.png", faces_of({n: FaceParameters({n: FULL_INTENSITY}) for n in names}))


def ten_at_random(rng: np.random.Generator) -> dict[str, float]:
    """Any ten controls at any strength up to full, sensible or not."""
    names = rng.choice(CONTROL_NAMES, 10, replace=False)
    return {str(name): round(float(rng.uniform(0, FULL_INTENSITY)), 1) for name in names}


def random_faces() -> None:
    """Random expressions as the button makes them, and any ten controls at random."""
    rng = np.random.default_rng(7)
    likely = {}
    for _ in range(10):
        aus = random_expression(rng)
        likely[", ".join(f"{n} {v:g}" for n, v in aus.items())] = FaceParameters(aus)
    save("face_random.png", faces_of(likely, 5, 230, lines=4))
    chance = [ten_at_random(np.random.default_rng(k)) for k in range(14)]
    save("face_ten.png", faces_of({f"ten at random, {k}": FaceParameters(aus)
                                   for k, aus in enumerate(chance)}))  # fmt: skip


EXTREMES = (
    "frontalis", "brow_furrow", "squint", "lid_raise", "wince", "sneer", "cheek_puff",
    "smile", "frown", "shrug", "purse", "grimace", "lip_loosen", "jaw_open",
)  # fmt: skip


def extremes() -> None:
    """Beyond nature: 10 on the scale; and the strongest expressions on the farthest identities."""
    beyond = {f"{name} 10": FaceParameters({name: 10.0}) for name in EXTREMES}
    save("face_beyond.png", faces_of(beyond))
    strong = {
        "smile": {"smile": 5.0, "outer_squint": 4.0},
        "anger": {"brow_furrow": 5.0, "lid_raise": 3.0, "lip_lock": 4.0, "wince": 2.0},
        "fear": {"frontalis": 5.0, "brow_furrow": 3.0, "lid_raise": 5.0, "grimace": 4.0,
                 "jaw_open": 2.0},
        "disgust": {"wince": 5.0, "sneer": 4.0, "shrug": 2.0, "squint": 3.0},
        "blink": {"blink": 5.0},
        "jaw open": {"jaw_open": 5.0},
    }  # fmt: skip
    rig, size = load_rig(), 190
    rows = []
    for name, who in PEOPLE.items():
        camera = close_up(rig, size=size, identity=who)
        row = [face_picture(rig, FaceParameters(aus, who), camera, "shaded")
               for aus in strong.values()]  # fmt: skip
        rows.append(captioned(np.concatenate(row, axis=1), name, 14))
    wide = np.full((1, rows[0].shape[1] // len(strong), 3), PAPER, np.uint8)
    heading = np.concatenate([captioned(wide, name, 14) for name in strong], axis=1)
    save("face_extremes.png", np.concatenate([heading, *rows]))


def own_creases() -> None:
    """Six expressions on the default person and on eight with creases of their own."""
    rig, size = load_rig(), 190
    names = ("frontalis", "brow_furrow", "smile", "grimace", "squint", "wince")
    camera = close_up(rig, size=size)
    rows = []
    for seed in range(9):
        who = drawn_creases(np.random.default_rng(seed), 0.9) if seed else {}
        faces = [FaceParameters({name: FULL_INTENSITY}, who) for name in names]
        rows.append([face_picture(rig, face, camera, kind) for face in faces for kind in KINDS])
    wide = np.full((1, 2 * rows[0][0].shape[1], 3), PAPER, np.uint8)
    heading = np.concatenate([captioned(wide, name, 14) for name in names], axis=1)
    save("face_creases.png", np.concatenate([heading, *(np.concatenate(r, axis=1) for r in rows)]))


def turned() -> None:
    """The whole head from all sides, at rest."""
    rig = load_rig()
    yaws = np.radians([-80, -40, 0, 40, 80])
    faces = [FaceParameters({}, {}, (0.6 * yaw, 0.0, 0.0), (0.4 * yaw, 0.0, 0.0)) for yaw in yaws]
    camera = whole_head(rig, faces, 300)
    rows = [grid([face_picture(rig, face, camera, kind) for face in faces], 5) for kind in KINDS]
    inked = np.flatnonzero(np.any(rows[-1] != PAPER, axis=(1, 2)))
    top, bottom = max(inked[0] - 10, 0), inked[-1] + 40  # the shaded neck is longer
    save("face_turned.png", np.concatenate([row[top:bottom] for row in rows]))


# --- data and fits --------------------------------------------------------------------------------


def drawings() -> None:
    """A page of the data set."""
    save("drawings.png", page_of_drawings())


def conventions() -> None:
    """The same faces by convention, and a face's features by some of them."""
    save("conventions.png", page_of_drawings("conventions"))
    save("drawn_features.png", drawn_features())


def ways() -> None:
    """The ways to draw what lies within the outline, on three faces."""
    save("ways.png", drawn_ways())


def dataset_statistics() -> None:
    """What the sampler draws by lot, in both schemes."""
    save("dataset_statistics.png", histograms())


def examples() -> None:
    """What the program makes of the sketches that ship with it."""
    save("examples.png", shipped_examples())


def fits() -> None:
    """What it makes of generated drawings."""
    save("fits.png", generated_examples())


def alive() -> None:
    """Fitted faces in other expressions."""
    save("alive.png", living_faces())


def stages() -> None:
    """The way of one sketch, by both methods."""
    save("stages.png", steps_of_both_methods())


def engraved() -> None:
    """Strokes without a place on the face: ignored, engraved and embossed."""
    save("engraved.png", carved_faces(), few_colours=False)  # or the thin blue lines go


def sphere() -> None:
    """The thesis' simple example: a sphere takes the outline of a drawing."""
    save("sphere.png", sphere_example(), few_colours=False)  # a palette would grey the thin lines


FACE = (contact_sheets, pairs, identities, face_ages, face_variants, features, styles, gaze,
        layers, levels, one_sided, random_faces, extremes, own_creases, turned)  # fmt: skip
DATA = (drawings, conventions, ways, dataset_statistics)


def hair() -> None:
    """The heads of hair that there are, each from four sides."""
    save("hair.png", heads_of_hair(people={"": {"gender": 0.2}}))


def beards() -> None:
    """The beards that there are, and that they go with the skin."""
    save("beards.png", beards_of_all_kinds())


def drawn_hair() -> None:
    """Drawings of the data set that wear them."""
    save("drawn_hair.png", drawings_of_hair())


PICTURES = {f.__name__: f for f in (controls, creases, *FACE, *DATA, examples, fits, alive, stages,
                                    sphere, engraved, hair, beards, drawn_hair)}  # fmt: skip


def main() -> None:
    chosen = sys.argv[1:] or list(PICTURES)
    unknown = set(chosen) - set(PICTURES)
    if unknown:
        sys.exit(f"There is no picture '{unknown.pop()}'; choose from: {', '.join(PICTURES)}.")
    for name in chosen:
        PICTURES[name]()


if __name__ == "__main__":
    main()
