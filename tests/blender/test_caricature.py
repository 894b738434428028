"""The slider from a plain face over the drawn one to its caricature."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from facs_rig.blender.keys import FITTED  # noqa: E402
from facs_rig.blender.pose import identity_of, pose_of  # noqa: E402
from facs_rig.blender.reshape import fitted_offsets  # noqa: E402
from facs_rig.exaggeration import exaggerated  # noqa: E402
from facs_rig.identity import BY_NAME, FEATURES  # noqa: E402

from .test_shell import press  # noqa: E402

pytestmark = pytest.mark.usefixtures("kept_fits")


@pytest.fixture
def face(shell, sketch, kept):
    return kept("fitted", lambda: press(sketch))


def local(face, evaluated):
    """The evaluated mesh in the face's own place."""
    face.parent.location = (0.0, 0.0, 0.0)
    return evaluated(face)


@pytest.mark.parametrize("much", [0.0, 0.6, 1.5, 2.0])
def test_the_face_is_the_caricature_that_the_core_makes(face, evaluated, rig, much):
    offsets, drawn = fitted_offsets(face), pose_of(face)
    face.sketch_to_face.caricature = much
    assert face.sketch_to_face.caricature == pytest.approx(much) == face["caricature"]
    wanted = rig.pose(*exaggerated(drawn, offsets, much))
    assert np.abs(local(face, evaluated) - wanted).max() < 2e-5


def test_it_comes_back_to_what_was_drawn(face, evaluated):
    before, who, does = local(face, evaluated), identity_of(face), pose_of(face).aus
    for much in (1.7, 0.0, 2.0, 1.0):
        face.sketch_to_face.caricature = much
    assert np.abs(evaluated(face) - before).max() < 1e-5
    assert identity_of(face) == pytest.approx(who, abs=1e-5)
    assert pose_of(face).aus == pytest.approx(does, abs=1e-5)


def test_nothing_is_left_of_a_plain_face(face):
    face.sketch_to_face.caricature = 0.0
    assert not any(pose_of(face).aus.values())
    assert face.data.shape_keys.key_blocks[FITTED].value == 0
    who = identity_of(face)
    assert all(abs(who.get(f.name, 0.0)) < 1e-6 for f in FEATURES)


def test_what_the_artist_has_changed_stays(face):
    memory = face.sketch_to_face
    memory.caricature = 1.5
    nose = memory.identity.nose_length
    memory.identity.nose_length = nose + 0.25
    face["cheek_puff"] = 2.0
    memory.caricature = 1.0
    assert face["cheek_puff"] == pytest.approx(2.0)
    drawn = face["sketch_person"].get("nose_length", BY_NAME["nose_length"].default)
    assert memory.identity.nose_length == pytest.approx(drawn + 0.25, abs=1e-4)


def test_fitting_again_begins_at_what_was_drawn(face):
    face.sketch_to_face.caricature = 1.8
    bpy.ops.sketch_to_face.fit_again("EXEC_DEFAULT", True)
    assert face.sketch_to_face.caricature == 1.0


def test_a_face_without_a_sketch_has_no_caricature(shell, evaluated):
    bpy.ops.mesh.add_facs_face()
    face = bpy.context.active_object
    before = evaluated(face)
    assert face.sketch_to_face.caricature == 1.0
    face.sketch_to_face.caricature = 2.0
    assert face.sketch_to_face.caricature == 1.0
    assert np.array_equal(evaluated(face), before)
