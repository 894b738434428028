"""A hat in Blender: beside the hair it follows head and person, goes to files, comes off."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from facs_rig import FaceParameters  # noqa: E402
from facs_rig.blender import build_face, set_identity  # noqa: E402
from facs_rig.blender.armature import to_blender  # noqa: E402
from facs_rig.blender.hair import add_hair, colour_of, hair_of, set_colour  # noqa: E402
from facs_rig.blender.hat import hat_of, put_on, take_off  # noqa: E402
from facs_rig.blender.pose import identity_of, set_pose  # noqa: E402
from facs_rig.blender.shape import shown  # noqa: E402
from facs_rig.common.errors import InputError  # noqa: E402
from facs_rig.hair.cut import ANGLES  # noqa: E402
from facs_rig.hair.hat import Hat, hat_mesh  # noqa: E402
from facs_rig.hair.presets import PRESETS, preset  # noqa: E402

from .test_hair import SAME, THEN, TURNED, WHO, places  # noqa: E402

CAP = Hat(0.3 + 0.15 * np.cos(ANGLES), np.full((48, 6), 0.02), np.full(48, 0.05))


@pytest.fixture
def face(empty_blender, rig):
    made = build_face("Somebody", rig, FaceParameters(identity=WHO), identity_keys=True)
    put_on(made, hat_mesh(rig, identity_of(made), CAP), identity_of(made))
    return made


def test_the_object_is_the_core_s_hat(face, rig):
    hat, made = hat_of(face), hat_mesh(rig, identity_of(face), CAP)
    assert hat.name == "Somebody Hat" and hat.parent == face.parent and hair_of(face) is None
    assert np.abs(places(hat) - to_blender(made.points)).max() < 1e-6
    assert colour_of(hat) == pytest.approx(made.colour) and not hat.data.validate()
    assert [material.name for material in hat.data.materials] == ["Hat"]


def test_it_is_worn_beside_hair_and_in_files(face, rig):
    add_hair(face, rig, preset(next(iter(PRESETS))))
    assert hair_of(face) not in (None, hat_of(face))
    worn = {part.name: part for part in shown(face, rig).worn}
    assert set(worn) == {"hair", "hat"}
    points = hat_mesh(rig, identity_of(face), CAP).points
    assert np.abs(worn["hat"].points - points).max() < SAME


def test_it_follows_head_and_person(face, rig):
    made = hat_mesh(rig, identity_of(face), CAP)
    set_pose(face, FaceParameters(TURNED.aus, identity_of(face), TURNED.head, TURNED.neck))
    (worn,) = shown(face, rig).worn
    posed = rig.pose(FaceParameters(TURNED.aus, identity_of(face), TURNED.head, TURNED.neck))
    assert np.abs(worn.points - made.on(posed)).max() < SAME
    set_identity(face, rig, THEN)
    assert np.abs(places(hat_of(face)) - to_blender(made.on(rig.neutral(THEN)))).max() < SAME


def test_another_hat_keeps_object_and_colour_and_all_goes_with_it(face, rig):
    hat = hat_of(face)
    set_colour(hat, (0.8, 0.1, 0.1))
    other = Hat(CAP.edge - 0.1, CAP.thick, 0 * CAP.brim)
    assert put_on(face, hat_mesh(rig, identity_of(face), other), identity_of(face)) == hat
    assert colour_of(hat) == pytest.approx((0.8, 0.1, 0.1))
    mesh, material = hat.data.name, hat.data.materials[0].name
    take_off(face)
    assert hat_of(face) is None
    assert mesh not in bpy.data.meshes and material not in bpy.data.materials
    take_off(face)


def test_a_hat_that_is_edited_is_let_be(face, rig):
    hat = hat_of(face)
    bpy.context.view_layer.objects.active = hat
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(InputError, match="'Somebody Hat' is being edited"):
        take_off(face)
    bpy.ops.object.mode_set(mode="OBJECT")
