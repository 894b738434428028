"""Where a sketch comes from: a file, an image in Blender, or strokes drawn in the 3D view."""

import os
import re
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np
from bpy.props import EnumProperty, PointerProperty, StringProperty
from numpy.typing import NDArray

from facs_rig.blender.armature import metre
from facs_rig.common.errors import InputError

from ..messages import translation
from .preferences import RELATIVE

if TYPE_CHECKING:
    from addon.drawing import Drawing

PENCILS = ("GREASEPENCIL", "GPENCIL")  # what the object's type is called, from and before 4.3
FIELDS = ("sketch_kind", "sketch", "sketch_image", "sketch_pencil")
BESIDE = 0.14  # metres from the drawing to the middle of the face
THINNEST = 0.0005  # metres: strokes of this radius and thinner count as that


@dataclass(frozen=True)
class Source:
    """A sketch, read from Blender; the rest can be done anywhere.

    name : what it is called       mark : changes whenever the drawing does
    load : makes the drawing, and the (2, 3) affine map from its pixels (u, v, 1) to the places that
        pins are kept in: pixels of the picture, or metres in the plane of the strokes
    """

    name: str
    mark: str
    load: Callable[[], tuple["Drawing", NDArray[np.float64]]]


SAME = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


class SketchChoice:
    """The properties that say which sketch is meant, for the scene and for each face."""

    sketch_kind: EnumProperty(
        name="Sketch From",
        description="Where the drawing is",
        **translation.OWN_CONTEXT,
        items=[
            ("FILE", "File", "A picture on the disk: a scan, a photo of paper, an export",
             "FILE_IMAGE", 0),
            ("IMAGE", "Image", "An image in this file, as you paint it in Blender",
             "IMAGE_DATA", 1),
            ("PENCIL", "Pencil", "What you draw with Grease Pencil in the 3D view",
             "GREASEPENCIL", 2),
        ],
    )  # fmt: skip
    sketch: StringProperty(
        name="Sketch",
        description="The drawing of a face: PNG, JPEG or whatever your scanner writes",
        subtype="FILE_PATH",
        options=RELATIVE,
    )
    sketch_image: PointerProperty(
        name="Image",
        description="An image in this file that shows a drawn face",
        type=bpy.types.Image,
    )
    sketch_pencil: PointerProperty(
        name="Grease Pencil",
        description="The Grease Pencil object that the face is drawn in",
        type=bpy.types.Object,
        poll=lambda _settings, candidate: candidate.type in PENCILS,
    )


def copy(giver, taker) -> None:
    """Let `taker` (the scene's settings or a face's) mean the sketch that `giver` does."""
    for name in FIELDS:
        setattr(taker, name, getattr(giver, name))


def same(one, other) -> bool:
    """Whether two holders mean the same sketch."""
    field = {"FILE": "sketch", "IMAGE": "sketch_image", "PENCIL": "sketch_pencil"}
    kind = one.sketch_kind
    return kind == other.sketch_kind and getattr(one, field[kind]) == getattr(other, field[kind])


def source_of(holder) -> Source:
    """The sketch that `holder` means. InputError, one sentence, if there is none.

    Only for the main thread, as it reads Blender's data.
    """
    return {"FILE": _file, "IMAGE": _image, "PENCIL": _pencil}[holder.sketch_kind](holder)


def _file(holder) -> Source:
    if not holder.sketch.strip():
        raise InputError(
            translation.text("No sketch is chosen: pick the image of a drawn face first.")
        )
    return _file_source(Path(bpy.path.abspath(holder.sketch)).expanduser())


def _file_source(path: Path) -> Source:
    def load():
        from addon.drawing import load_drawing  # late: Blender starts faster without

        return load_drawing(path), SAME

    return Source(path.stem, file_mark(path), load)


def file_mark(path: Path) -> str:
    """A text that changes when the file does."""
    try:
        state = path.stat()
    except (OSError, ValueError):  # gone, or a path that the system cannot even look up
        return f"{path} is not there"
    return f"{path} {state.st_mtime_ns} {state.st_size}"


def _without_pixels(image: bpy.types.Image) -> str:
    """Why an image has no pixels, and what to do."""
    if image.source == "MOVIE":
        return translation.text(
            "'{name}' is a movie: save the frame that you mean as a picture, and choose that.",
            name=image.name,
        )
    if image.source == "VIEWER":
        return translation.text(
            "Nobody can read the pixels of '{name}': save it with Image > Save As, and choose that "
            "file.",
            name=image.name,
        )
    return translation.text(
        "The image '{name}' has no pixels; is its file missing?", name=image.name
    )


def frame_of(image: bpy.types.Image) -> str:
    """The file of the frame of an image sequence that is shown now.

    As the image editor or the empty that shows it says; else the chosen file is that of frame 1.
    """
    path = bpy.path.abspath(image.filepath)
    digits = re.search(r"(\d+)(?!.*\d)", os.path.basename(path))
    if digits is None:
        return path
    start, stop = digits.span()
    folder, name = os.path.split(path)
    user = _user_of(image)
    if user is None:
        number = int(digits[0]) + bpy.context.scene.frame_current - 1
    else:
        number = user.frame_current + user.frame_offset
    first = int(digits[0])
    shown = f"{number:0{stop - start}d}" if number >= 0 else digits[0]
    found = os.path.join(folder, name[:start] + shown + name[stop:])
    if os.path.isfile(found) or number == first:
        return found
    return path  # before the first or after the last: what the sequence was opened with


def _user_of(image: bpy.types.Image):
    """What says which frame of a sequence is shown; None if nothing shows it."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            space = area.spaces.active
            if area.type == "IMAGE_EDITOR" and space.image == image:
                return space.image_user
    empties = (o for o in bpy.context.scene.objects if o.type == "EMPTY" and o.data == image)
    empty = next(empties, None)
    return empty.image_user if empty is not None else None


def _image(holder) -> Source:
    image = holder.sketch_image
    if image is None:
        raise InputError(
            translation.text("No image is chosen: pick one of this file's images first.")
        )
    if image.source == "SEQUENCE":
        return _file_source(Path(frame_of(image)))
    width, height = image.size
    if not width or not height or not image.channels:
        raise InputError(_without_pixels(image))
    pixels = np.empty(width * height * image.channels, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    name, channels = image.name, image.channels
    rows = pixels.reshape(height, width, channels)[::-1]  # Blender's begin at the bottom
    rows = rows[..., 0] if channels == 1 else rows[..., : 3 if channels == 3 else 4]

    def load():
        from addon.drawing import Drawing

        return Drawing.of(np.clip(rows, 0, 1), f"The image '{name}'"), SAME

    return Source(Path(name).stem, f"{name} {width} {height} {zlib.crc32(pixels.data)}", load)


def _pencil(holder) -> Source:
    pencil = holder.sketch_pencil
    if pencil is None or pencil.type not in PENCILS:
        raise InputError(
            translation.text("No drawing is chosen: pick the Grease Pencil object you drew first.")
        )
    found = strokes_of(pencil)
    name = pencil.name
    mark = 0
    for points, radii in found:
        mark = zlib.crc32(radii.tobytes(), zlib.crc32(points.tobytes(), mark))

    def load():
        from addon.drawing import Drawing
        from addon.strokes_page import PenStroke, page_of_strokes, plane_of

        every = np.concatenate([points for points, _ in found]) if found else np.empty((0, 3))
        right, up, _ = plane_of(every)
        strokes = [
            PenStroke(np.stack([points @ right, points @ up], axis=1), 2 * radii)
            for points, radii in found
        ]
        page, to_plane = page_of_strokes(strokes, name=f"The Grease Pencil drawing '{name}'")
        return Drawing.of(page, f"The Grease Pencil drawing '{name}'"), to_plane

    return Source(name, f"{name} {len(found)} {mark}", load)


def place_beside(context, holder) -> tuple[float, float, float]:
    """Where the face of a sketch is meant to stand, in units of the scene: at the 3D cursor or,
    where the sketch is drawn in the view, to its right, so that neither hides the other."""
    wide = BESIDE * metre(context.scene)
    if holder.sketch_kind != "PENCIL" or holder.sketch_pencil is None:
        return tuple(context.scene.cursor.location)
    drawn = [points for points, _ in strokes_of(holder.sketch_pencil)]
    if not drawn:
        return tuple(context.scene.cursor.location)
    points = np.concatenate(drawn)
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    _, y, z = ((low + high) / 2).tolist()
    return (float(high[0]) + wide, y, z)


def strokes_of(
    pencil: bpy.types.Object,
) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Every visible stroke of the current frame: (k, 3) points and (k,) radii, metres, world."""
    read = _strokes_of_curves if pencil.type == "GREASEPENCIL" else _strokes_of_points
    matrix = np.array(pencil.matrix_world)
    size = float(np.abs(np.linalg.det(matrix[:3, :3]))) ** (1 / 3)
    thinnest = THINNEST * metre(bpy.context.scene)
    return [
        (points @ matrix[:3, :3].T + matrix[:3, 3], np.maximum(radii * size, thinnest))
        for points, radii in read(pencil)
        if len(points)
    ]


def _strokes_of_curves(pencil) -> list[tuple[NDArray, NDArray]]:
    """From Blender 4.3 on: all strokes of a drawing lie in common arrays."""
    found = []
    for layer in pencil.data.layers:
        frame = layer.current_frame()
        if layer.hide or frame is None or frame.drawing is None:
            continue
        drawing = frame.drawing
        position = drawing.attributes.get("position")
        if position is None or not len(position.data):
            continue
        points = np.empty((len(position.data), 3), dtype=np.float32)
        position.data.foreach_get("vector", points.ravel())
        radii = np.full(len(points), 0.01, dtype=np.float32)
        radius = drawing.attributes.get("radius")
        if radius is not None and len(radius.data) == len(points):
            radius.data.foreach_get("value", radii)
        place = np.array(layer.matrix_local) if hasattr(layer, "matrix_local") else np.eye(4)
        points = points @ place[:3, :3].T + place[:3, 3]
        starts = np.empty(len(drawing.curve_offsets), dtype=np.int32)
        drawing.curve_offsets.foreach_get("value", starts)
        cyclic = np.zeros(len(starts) - 1, dtype=bool)
        closing = drawing.attributes.get("cyclic")
        if closing is not None and len(closing.data) == len(cyclic):
            closing.data.foreach_get("value", cyclic)
        for a, b, closed in zip(starts[:-1], starts[1:], cyclic, strict=True):
            found.append(_closed(points[a:b], radii[a:b], closed))
    return found


def _strokes_of_points(pencil) -> list[tuple[NDArray, NDArray]]:
    """Before Blender 4.3: a stroke is a collection of points."""
    found = []
    for layer in pencil.data.layers:
        if layer.hide or layer.active_frame is None:
            continue
        for stroke in layer.active_frame.strokes:
            points = np.empty((len(stroke.points), 3), dtype=np.float32)
            pressure = np.empty(len(points), dtype=np.float32)
            stroke.points.foreach_get("co", points.ravel())
            stroke.points.foreach_get("pressure", pressure)
            place = np.array(layer.matrix_layer)
            points = points @ place[:3, :3].T + place[:3, 3]
            # Its width is in thousandths of a metre, as long as strokes scale with the view.
            radii = pressure * stroke.line_width * pencil.data.pixel_factor / 2000
            found.append(_closed(points, radii, bool(stroke.use_cyclic)))
    return found


def _closed(points: NDArray, radii: NDArray, closed: bool) -> tuple[NDArray, NDArray]:
    if closed and len(points) > 2:
        return np.concatenate([points, points[:1]]), np.concatenate([radii, radii[:1]])
    return points, radii
