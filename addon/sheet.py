"""Contact sheets: controls of the face at rest, half and full, shaded and drawn, with captions.

The command ``sketch2face rig --sheet`` and the pictures of the documentation are made of these.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from addon.preview import PAPER, paint
from dataset_gen import Style, draw_strokes
from dataset_gen.linework import ink
from facs_rig import CONTROL_NAMES, CONTROLS, Camera, FaceParameters, FaceRig, landmark_points
from facs_rig.common.errors import InputError
from facs_rig.controls import REGIONS
from facs_rig.rotation import rotation

Picture = NDArray[np.uint8]  # (h, w, 3)

LAYERS = ("brow", "iris", "pupil", "lip")  # surface strokes of a plain drawing
LEVELS = (0.0, 2.5, 5.0)
KINDS = ("shaded", "drawn")
VIEWS = {"front": 0.0, "three-quarter": 38.0}  # degrees that the head is turned to its own left
TITLES = {f"{region.title()} face": (region,) for region in REGIONS}
FEW = 12  # controls that need no groups
SIZE = 160  # pixels, the height of a face
WIDTH = 0.84  # of a face's picture, as a share of its height
SMALLEST, LARGEST = 48, 1024
# The close-up: from the hairline to under an open mouth, as shares of forehead to chin.
ABOVE, BELOW = 0.16, 0.18
INK, GREY = "#202020", "#707070"
PAGE_RATIO = 1.2  # height to width that a sheet tries to have


# --- one face -------------------------------------------------------------------------------------


def seen_from(vertices: NDArray, yaw: float) -> NDArray[np.float32]:
    """Vertices (n, 3) of the whole head turned stiffly by `yaw` degrees to the face's own left."""
    turning = rotation((np.radians(yaw), 0.0, 0.0))
    return (np.asarray(vertices) @ turning.T).astype(np.float32)


def close_up(
    rig: FaceRig, yaw: float = 0.0, size: int = SIZE, identity: Mapping[str, float] | None = None
) -> Camera:
    """A camera that fills a picture of `size` pixels' height with the face, without the crown."""
    neutral = rig.neutral(identity)
    place = landmark_points(rig, neutral)
    top, bottom = place["forehead"][1], place["chin"][1]
    height = top - bottom
    front = (neutral[:, 1] > bottom) & (neutral[:, 1] < top) & (neutral[:, 2] > 0)
    x = seen_from(neutral[front], yaw)[:, 0]
    top, bottom = top + ABOVE * height, bottom - BELOW * height
    pixels = size / (top - bottom)
    width = round(WIDTH * size)
    centre = (width / 2 - pixels * (x.min() + x.max()) / 2, pixels * top)
    return Camera(width, size, (pixels, pixels), (float(centre[0]), float(centre[1])))


def whole_head(rig: FaceRig, faces: Sequence[FaceParameters], size: int) -> Camera:
    """One camera for the whole heads of several faces, so that their sizes can be compared."""
    heads = []
    for face in faces:
        upright = rig.neutral(face.identity)
        kept = upright[:, 1] > landmark_points(rig, upright)["chin"][1] - 0.03
        heads.append(rig.turn(upright, face)[kept])
    return Camera.framing(np.concatenate(heads), round(WIDTH * size), size, 0.02)


def face_picture(
    rig: FaceRig,
    parameters: FaceParameters,
    camera: Camera,
    kind: str,
    yaw: float = 0.0,
    layers: Sequence[str] = LAYERS,
) -> Picture:
    """(h, w, 3) a posed face, `shaded` or `drawn` with these `layers`, on the colour of paper."""
    vertices = seen_from(rig.pose(parameters), yaw)
    if kind == "shaded":
        return paint(rig, vertices, camera, dict(parameters.identity))
    strokes = draw_strokes(rig, vertices, camera, 1, tuple(layers))
    style = Style(width=max(1.0, 0.35 + 0.0055 * camera.height))
    lines = ink(strokes, camera.width, camera.height, style)
    return np.repeat(np.minimum(lines, PAPER)[:, :, None], 3, axis=2)


# --- pages ----------------------------------------------------------------------------------------


def font(size: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


def blank(width: int, height: int) -> Picture:
    return np.full((height, width, 3), PAPER, dtype=np.uint8)


def text_line(
    width: int, parts: Sequence[tuple[str, str]], size: float, height: int | None = None
) -> Picture:
    """A line of text (h, width, 3), made of (text, colour) parts, cut with an ellipsis to fit."""
    height = height or round(1.45 * size)
    page = Image.fromarray(blank(width, height))
    draw, letters = ImageDraw.Draw(page), font(size)
    x = 0.0
    for text, colour in parts:
        shown = _fitting(draw, text, letters, width - x - 3)
        draw.text((x, height / 2), shown, fill=colour, font=letters, anchor="lm")
        x += draw.textlength(text, font=letters)
    return np.asarray(page)


def _fitting(draw: ImageDraw.ImageDraw, text: str, letters, room: float) -> str:
    """As much of a text as there is room for, with an ellipsis if it is cut."""
    if draw.textlength(text, font=letters) <= room:
        return text
    while text and draw.textlength(text + "…", font=letters) > room:
        text = text[:-1]
    return text.rstrip(" ,") + "…" if text else ""


def captioned(picture: Picture, text: str, size: float = 13, lines: int = 1) -> Picture:
    """A picture with centred text under it, in at most so many `lines`."""
    width, height = picture.shape[1], round(1.3 * size)
    page = Image.fromarray(blank(width, round(lines * height + 0.5 * size)))
    draw, letters = ImageDraw.Draw(page), font(size)
    rows = [""]
    for word in text.split():
        longer = f"{rows[-1]} {word}".strip()
        if draw.textlength(longer, font=letters) < width or len(rows) == lines:
            rows[-1] = longer
        else:
            rows.append(word)
    for k, row in enumerate(rows):
        row = _fitting(draw, row, letters, width)
        draw.text((width / 2, (k + 0.6) * height), row, fill=INK, font=letters, anchor="mm")
    return np.concatenate([picture, np.asarray(page)])


def grid(pictures: Sequence[Picture], columns: int, gap: int = 0) -> Picture:
    """Pictures of one size in rows of `columns`, `gap` pixels apart."""
    padded = [np.pad(p, ((0, gap), (0, gap), (0, 0)), constant_values=PAPER) for p in pictures]
    padded += [np.full_like(padded[0], PAPER)] * (-len(padded) % columns)
    rows = [np.concatenate(padded[k : k + columns], 1) for k in range(0, len(padded), columns)]
    page = np.concatenate(rows)
    return page[: page.shape[0] - gap, : page.shape[1] - gap]


def stack(pictures: Sequence[Picture], gap: int = 0) -> Picture:
    """Pictures of any width under each other."""
    width = max(p.shape[1] for p in pictures)
    rows = [np.pad(p, ((0, gap), (0, width - p.shape[1]), (0, 0)), constant_values=PAPER)
            for p in pictures]  # fmt: skip
    return np.concatenate(rows)


def paletted(picture: Picture) -> Image.Image:
    """The picture with 256 colours of its own: a third of the bytes, and no eye sees it."""
    return Image.fromarray(picture).quantize(256, dither=Image.Dither.NONE)


# --- the contact sheet ----------------------------------------------------------------------------


def contact_sheet(
    rig: FaceRig,
    names: Sequence[str] = CONTROL_NAMES,
    *,
    kinds: Sequence[str] = KINDS,
    view: str = "front",
    size: int = SIZE,
    identity: Mapping[str, float] | None = None,
    layers: Sequence[str] = LAYERS,
    columns: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Picture:
    """(h, w, 3) controls at LEVELS, in groups, each with its name, action units and signature.

    names : controls, in any order;  kinds : rows of each control;  size : pixels, a face's height
    identity : who wears the expressions;  layers : of the drawings, see dataset_gen.draw_strokes
    columns : controls beside each other (chosen if None)
    Turned faces show the side that acts.
    Raises InputError for unknown names, kinds, views, layers and sizes.
    """
    _check(names, kinds, view, size)
    who = dict(identity or {})
    chosen = [control for control in CONTROLS if control.name in names]
    yaws = {c.name: VIEWS[view] * (-1 if c.side == "left" else 1) for c in chosen}
    cameras = {yaw: close_up(rig, yaw, size, who) for yaw in sorted(set(yaws.values()))}
    work, done = len(kinds) * (len(cameras) + (len(LEVELS) - 1) * len(chosen)), 0

    def picture(aus: Mapping[str, float], kind: str, yaw: float) -> Picture:
        nonlocal done
        made = face_picture(rig, FaceParameters(aus, who), cameras[yaw], kind, yaw, layers)
        done += 1
        if progress:
            progress(done, work)
        return made

    rest = {(kind, yaw): picture({}, kind, yaw) for kind in kinds for yaw in cameras}
    gap = max(8, size // 10)
    groups = {}
    few = len(chosen) <= FEW and len({c.region for c in chosen}) > 1
    for title, regions in {"Face": REGIONS}.items() if few else TITLES.items():
        blocks = []
        for control in (c for c in chosen if c.region in regions):
            rows, yaw = [], yaws[control.name]
            for kind in kinds:
                levels = [picture({control.name: v}, kind, yaw) if v else rest[kind, yaw]
                          for v in LEVELS]  # fmt: skip
                rows.append(grid(levels, len(LEVELS), gap=max(2, size // 32)))
            blocks.append(np.concatenate([_heading(control, rows[0].shape[1], size), *rows]))
        if blocks:
            groups[title] = blocks
    columns = columns or _columns([len(b) for b in groups.values()], next(iter(groups.values()))[0])
    letters = max(13.0, size / 8)
    pages = []
    for title, blocks in groups.items():
        page = grid(blocks, min(columns, max(len(b) for b in groups.values())), gap)
        plural = "s" if len(blocks) > 1 else ""
        about = f"   {len(blocks)} control{plural} at {', '.join(f'{v:g}' for v in LEVELS)}"
        line = text_line(page.shape[1], [(title, INK), (about, GREY)], letters)
        pages.append(stack([line, page], gap // 2))
    return np.pad(stack(pages, gap), ((gap, 0), (gap, gap), (0, 0)), constant_values=PAPER)


def _check(names: Sequence[str], kinds: Sequence[str], view: str, size: int) -> None:
    from facs_rig.parameters import intensities

    intensities(dict.fromkeys(names, 0.0))
    if not names:
        raise InputError("a contact sheet needs at least one control")
    for kind in kinds:
        if kind not in KINDS:
            raise InputError(f"a face can be {' or '.join(KINDS)}, not '{kind}'")
    if view not in VIEWS:
        raise InputError(f"there is no view '{view}'; choose from {', '.join(VIEWS)}")
    if not SMALLEST <= size <= LARGEST:
        raise InputError(f"the size of a face is {SMALLEST} to {LARGEST} pixels, not {size}")


def _heading(control, width: int, size: int) -> Picture:
    """Two lines over a control's pictures: what it is called, and what it looks like."""
    letters = max(10.0, size / 11)
    units = f"AU {'+'.join(control.aus)}"
    name = [(control.label, INK), (f"   {control.name}   {units}", GREY)]
    about = [(control.signature, GREY)]
    return np.concatenate(
        [text_line(width, name, letters), text_line(width, about, 0.85 * letters)]
    )


def _columns(counts: Sequence[int], block: Picture) -> int:
    """How many blocks beside each other bring the page closest to PAGE_RATIO."""
    height, width = block.shape[:2]

    def ratio(columns: int) -> float:
        return sum(-(-n // columns) for n in counts) * height / (columns * width)

    return min(range(1, max(counts) + 1), key=lambda c: abs(np.log(ratio(c) / PAGE_RATIO)))
