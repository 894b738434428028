"""What goes with the drawn actions is a driven key of its own: Blender shows what the core says."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from facs_rig import CONTROLS, FaceParameters  # noqa: E402
from facs_rig.blender import build_face  # noqa: E402
from facs_rig.blender.pose import set_pose  # noqa: E402
from facs_rig.blender.reshape import fitted_offsets, reshape  # noqa: E402
from facs_rig.blender.shape import own_keys  # noqa: E402
from facs_rig.fitted_keys import FITTED, FITTED_REGIONS, FittedKey, offsets_at  # noqa: E402

from .test_build_face import TOLERANCE  # noqa: E402
from .test_reshape import some_offsets  # noqa: E402

DRAWN = {"smile": 4.0, "jaw_open": 1.5, "brow_furrow": 3.0}
OTHERS = (
    DRAWN, {}, {"smile": 2.0}, {"brow_furrow": 8.0, "jaw_open": 0.5}, {"cheek_puff": 5.0},
)  # fmt: skip


def keys_of(rig, drawn=DRAWN) -> tuple[FittedKey, ...]:
    """Keys of some offsets for each region that has drawn actions."""
    found = []
    for k, region in enumerate(FITTED_REGIONS):
        names = [c.name for c in CONTROLS if c.region == region and c.name in drawn]
        if names:
            offsets = some_offsets(rig, 10 + k).astype(np.float32)
            shares = dict.fromkeys(names, 1 / len(names))
            aus = {name: drawn[name] for name in names}
            found.append(FittedKey(FITTED_REGIONS[region], offsets, shares, aus))
    return tuple(found)


def whole(rig, keys) -> np.ndarray:
    return some_offsets(rig, 3).astype(np.float32) + sum(key.offsets for key in keys)


@pytest.fixture
def made(empty_blender, rig):
    keys = keys_of(rig)
    offsets = whole(rig, keys)
    return build_face("face", rig, FaceParameters(DRAWN), offsets, keys), offsets, keys


@pytest.mark.parametrize("aus", OTHERS, ids=str)
def test_the_face_is_the_core_s_with_every_expression(made, rig, evaluated, aus):
    face, offsets, keys = made
    set_pose(face, FaceParameters(aus))
    wanted = rig.pose(FaceParameters(aus), offsets_at(offsets, keys, aus))
    assert np.abs(evaluated(face) - wanted).max() < TOLERANCE


def test_no_driver_is_broken_and_one_slider_takes_all_away(made, rig, evaluated):
    face, offsets, keys = made
    blocks = face.data.shape_keys.key_blocks
    assert [b.name for b in blocks][-len(keys) - 1 :] == [FITTED, *(key.name for key in keys)]
    assert all(curve.driver.is_valid for curve in face.data.shape_keys.animation_data.drivers)
    blocks[FITTED].value = 0.0
    assert np.abs(evaluated(face) - rig.pose(FaceParameters(DRAWN))).max() < TOLERANCE
    blocks[FITTED].value = 0.5
    half = rig.pose(FaceParameters(DRAWN), 0.5 * offsets)
    assert np.abs(evaluated(face) - half).max() < TOLERANCE


def test_offsets_read_back_are_those_given(made):
    face, offsets, _ = made
    assert np.abs(fitted_offsets(face) - offsets).max() < 1e-6


def test_as_many_actions_as_a_region_has_find_room_in_a_driver(empty_blender, rig, evaluated):
    drawn = {c.name: 2.0 for c in CONTROLS if c.region == "lower"}
    keys = keys_of(rig, drawn)
    offsets = whole(rig, keys)
    face = build_face("face", rig, FaceParameters(drawn), offsets, keys)
    aus = {name: 1.0 for name in list(drawn)[::2]}
    set_pose(face, FaceParameters(aus))
    wanted = rig.pose(FaceParameters(aus), offsets_at(offsets, keys, aus))
    assert np.abs(evaluated(face) - wanted).max() < 2 * TOLERANCE
    reshape(face, rig, {}, 0 * offsets)
    assert not [name for name in face.keys() if "_part_" in name and "itted" in name]
    assert np.abs(evaluated(face) - rig.pose(FaceParameters(aus))).max() < TOLERANCE


def test_another_fit_brings_its_own(made, rig, evaluated):
    face, *_ = made
    drawn = {"smile": 1.0, "sneer": 2.0}
    keys = keys_of(rig, drawn)
    offsets, who = whole(rig, keys), {"gender": 1.0, "nose_length": 0.5}
    reshape(face, rig, who, offsets, keys)
    names = {name for name in FITTED_REGIONS.values() if name in face.data.shape_keys.key_blocks}
    assert names == {key.name for key in keys}
    for aus in (drawn, {}, {"smile": 0.5}, DRAWN):
        set_pose(face, FaceParameters(aus, who))
        wanted = rig.pose(FaceParameters(aus, who), offsets_at(offsets, keys, aus))
        assert np.abs(evaluated(face) - wanted).max() < TOLERANCE
    assert own_keys(face, rig) == []


def test_another_person_keeps_them(made, rig, evaluated):
    face, offsets, keys = made
    who = {"gender": 0.0, "age": 0.8, "mouth_width": -0.7}
    reshape(face, rig, who)
    for aus in OTHERS:
        set_pose(face, FaceParameters(aus, who))
        wanted = rig.pose(FaceParameters(aus, who), offsets_at(offsets, keys, aus))
        assert np.abs(evaluated(face) - wanted).max() < TOLERANCE
