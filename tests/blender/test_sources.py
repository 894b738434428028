"""A sketch from a file, from an image in Blender, from Grease Pencil: the same face."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from facs_rig.blender.hair import hair_of  # noqa: E402
from facs_rig.common.errors import InputError  # noqa: E402

from .sheets import draw_on, image_of, lines_of, pencil_of, standing  # noqa: E402
from .test_shell import error_of, everything  # noqa: E402


def active(face) -> set[str]:
    return {item.name for item in face.sketch_to_face.detections if item.active}


def press() -> bpy.types.Object:
    assert bpy.ops.sketch_to_face.fit() == {"FINISHED"}
    return bpy.context.active_object


@pytest.fixture
def settings(shell):
    return bpy.context.scene.sketch_to_face


def test_an_image_gives_the_face_of_its_file(settings, sketch, evaluated):
    settings.sketch = str(sketch)
    from_file = evaluated(press())
    hair_of(bpy.context.active_object).select_set(True)
    bpy.ops.object.delete()  # face and hair, or the next one comes to stand beside them
    settings.sketch_kind, settings.sketch_image = "IMAGE", image_of(sketch)
    face = press()
    assert face.name == "Drawn"
    # Alpha is flattened in another order: a few pixels of soft edges differ in their last bits.
    assert np.abs(evaluated(face) - from_file).max() < 1e-3


def test_grease_pencil_strokes_give_the_expression_of_the_drawing(settings, sketch):
    settings.sketch_kind = "PENCIL"
    settings.sketch_pencil = pencil_of(lines_of(sketch))
    face = press()
    assert face.name == "Pen.001"
    assert "smile" in active(face)
    assert face.sketch_to_face.contour_error_px[2] < face.sketch_to_face.contour_error_px[0]


def test_where_the_pencil_object_stands_and_how_large_it_is_does_not_matter(settings, sketch):
    from addon.blender.state import sources

    pencil = pencil_of(lines_of(sketch))
    settings.sketch_kind, settings.sketch_pencil = "PENCIL", pencil
    drawing, _ = sources.source_of(settings).load()
    pencil.location, pencil.scale = (3.0, -2.0, 1.5), (4.0, 4.0, 4.0)
    bpy.context.view_layer.update()
    moved, to_places = sources.source_of(settings).load()
    # Single precision far from the origin: edges of the ink may shift by a part of a pixel.
    assert np.abs(moved.image - drawing.image).mean() < 0.004
    ink = np.argwhere(moved.image < 0.5).mean(axis=0)[::-1] + 0.5
    middle = to_places[:, :2] @ ink + to_places[:, 2]
    assert np.abs(middle - (3.0, 1.5)).max() < 0.3  # metres, in the plane of the front view


def test_a_drawing_from_the_right_is_upright_too(settings, sketch):
    from addon.blender.state import sources

    lines = lines_of(sketch)
    settings.sketch_kind, settings.sketch_pencil = "PENCIL", pencil_of(lines)
    front, _ = sources.source_of(settings).load()
    turned = pencil_of(lines, "Turned")
    turned.rotation_euler = (0.0, 0.0, np.pi / 2)  # what was drawn from the front, from the right
    bpy.context.view_layer.update()
    settings.sketch_pencil = turned
    right, _ = sources.source_of(settings).load()
    assert np.abs(right.image - front.image).mean() < 0.004


def test_every_change_of_a_sketch_changes_its_mark(settings, sketch, tmp_path):
    from addon.blender.state import sources

    def mark() -> str:
        return sources.source_of(settings).mark

    file = tmp_path / "drawing.png"
    file.write_bytes(sketch.read_bytes())
    settings.sketch = str(file)
    marks = [mark(), mark()]
    file.write_bytes(sketch.read_bytes() + b"\0")
    marks.append(mark())
    settings.sketch_kind, settings.sketch_image = "IMAGE", image_of(sketch)
    marks += [mark(), mark()]
    settings.sketch_image.pixels[40] = 0.25
    marks.append(mark())
    pencil = pencil_of([np.array([[0, 0], [1, 1], [2, 0]])])
    settings.sketch_kind, settings.sketch_pencil = "PENCIL", pencil
    marks += [mark(), mark()]
    draw_on(pencil.data.layers[0].frames[0], [np.array([[0, 1], [1, 0]])])
    marks.append(mark())
    pencil.data.layers[0].hide = True
    marks.append(mark())
    same = [a == b for a, b in zip(marks, marks[1:], strict=False)]
    assert same == [True, False, False, True, False, False, True, False, False]


def test_what_is_missing_is_one_sentence_and_leaves_nothing(settings, sketch):
    before = everything()
    for kind, field, value, says in (
        ("FILE", "sketch", "", "No sketch is chosen"),
        ("IMAGE", "sketch_image", None, "No image is chosen"),
        ("PENCIL", "sketch_pencil", None, "No drawing is chosen"),
    ):
        settings.sketch_kind = kind
        setattr(settings, field, value)
        assert error_of(bpy.ops.sketch_to_face.fit).startswith(says)
        assert everything() == before
    settings.sketch_kind = "IMAGE"
    settings.sketch_image = bpy.data.images.new("Blank", 64, 64)
    assert "blank" in error_of(bpy.ops.sketch_to_face.fit)
    lost = bpy.data.images.new("Lost", 1, 1)
    lost.source, lost.filepath = "FILE", "//nowhere.png"
    settings.sketch_image = lost
    assert "no pixels" in error_of(bpy.ops.sketch_to_face.fit)
    settings.sketch_kind, settings.sketch_pencil = "PENCIL", pencil_of([])
    assert "has no strokes" in error_of(bpy.ops.sketch_to_face.fit)
    settings.sketch_pencil = pencil_of([np.array([[np.nan, 0], [1, 1]])])
    assert "\n" not in error_of(bpy.ops.sketch_to_face.fit)


def test_only_pencil_objects_can_be_chosen(settings):
    cube = bpy.data.objects.new("Cube", bpy.data.meshes.new("Cube"))
    settings.sketch_kind, settings.sketch_pencil = "PENCIL", cube  # a script may do that
    assert "No drawing is chosen" in error_of(bpy.ops.sketch_to_face.fit)


def test_a_blank_sheet_is_ready_to_be_drawn_on(settings, sketch):
    assert bpy.ops.sketch_to_face.new_drawing() == {"FINISHED"}
    pencil = bpy.context.active_object
    assert settings.sketch_kind == "PENCIL" and settings.sketch_pencil == pencil
    assert "has no strokes" in error_of(bpy.ops.sketch_to_face.fit)
    draw_on(pencil.data.layers[0].frames[0], lines_of(sketch))
    assert "smile" in active(press())


def test_strokes_come_in_world_coordinates_with_the_layer_s_own_place(settings):
    from addon.blender.state import sources

    line = np.array([[0.0, 0.0], [0.1, 0.2]])
    pencil = pencil_of([line], radius=0.002)
    pencil.location, pencil.scale = (1.0, 2.0, 3.0), (2.0, 2.0, 2.0)
    bpy.context.view_layer.update()
    ((points, radii),) = sources.strokes_of(pencil)
    assert np.allclose(points, standing(line) * 2 + (1, 2, 3), atol=1e-6)
    assert np.allclose(radii, 0.004, rtol=1e-3)


def test_source_of_nothing_is_a_sketch_error(settings):
    from addon.blender.state import sources

    with pytest.raises(InputError):
        sources.source_of(settings)
