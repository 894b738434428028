"""People do things each in their own way, and it is still the same thing."""

from __future__ import annotations

import numpy as np
import pytest

from facs_rig import CONTROL_NAMES, CONTROLS, FaceParameters, load_rig
from facs_rig.actions import (
    GROUP_OF,
    GROUPS,
    SPREAD,
    TABLE,
    WAYS,
    action_weights,
    drawn_actions,
    variant_name,
)
from facs_rig.controls import WHOLE
from facs_rig.identity import ACTIONS, BY_NAME, check_identity
from facs_rig.variants import variant_weights

MM = 1e-3
WITHOUT = {"blink"}  # moves lids alone, and these have their keys
WHOLE_ACTIONS = [n for k, n in enumerate(CONTROL_NAMES) if WHOLE[k] == k and n not in WITHOUT]


@pytest.fixture(scope="module")
def rig():
    return load_rig()


@pytest.fixture(scope="module")
def ways(rig):
    """(variants, M, 3) by name: what they move the cage and its joints by."""
    motions = rig.motions
    rows = motions.cage_variants.toarray().reshape(motions.cage_variants.shape[0], -1, 3)
    return dict(zip(motions.variant_names, rows, strict=False))


@pytest.fixture(scope="module")
def means(rig):
    """Control -> (M, 3) what its key moves the cage by, for the default person."""
    keys = rig.motions.cage_keys[: len(CONTROLS)].reshape(len(CONTROLS), -1, 3)
    return dict(zip(CONTROL_NAMES, keys, strict=True))


def smile(identity, strength=5.0):
    return FaceParameters({"smile": strength}, identity)


def test_every_action_but_the_blink_has_ways(ways):
    assert set(GROUP_OF) == set(WHOLE_ACTIONS)
    for name, whole in zip(CONTROL_NAMES, WHOLE, strict=True):
        has = [variant_name(name, way) in ways for way in WAYS]
        assert all(has) or (CONTROL_NAMES[whole] in WITHOUT and not any(has)), name


def test_ways_belong_to_their_own_key(rig):
    for name, parent in zip(rig.motions.variant_names, rig.motions.parents, strict=True):
        for way in WAYS:
            if name.endswith(f"_way_{way}"):
                assert rig.keys[parent].name == name.removesuffix(f"_way_{way}")


def test_the_default_person_does_everything_in_the_mean_way(rig):
    assert not action_weights({})
    assert not action_weights(dict.fromkeys(TABLE, 0.0))
    plain = rig.pose(smile({}))
    np.testing.assert_array_equal(plain, rig.pose(smile(dict.fromkeys(TABLE, 0.0))))


def test_a_way_changes_its_own_actions_alone(rig):
    who = {"smile_action_1": 1.0, "smile_action_3": -1.0}
    assert np.abs(rig.pose(smile(who)) - rig.pose(smile({}))).max() > 2 * MM
    for other in ("frown", "brow_furrow", "jaw_open"):
        face = FaceParameters({other: 5.0}, who)
        np.testing.assert_array_equal(rig.pose(face), rig.pose(FaceParameters({other: 5.0})))
    np.testing.assert_array_equal(rig.neutral(who), rig.neutral())


def test_both_ends_are_as_far_from_the_mean(rig):
    mean = rig.pose(smile({}))
    one, other = (rig.pose(smile({"smile_action_2": x})) - mean for x in (1.0, -1.0))
    np.testing.assert_allclose(one, -other, atol=1e-6)


@pytest.mark.parametrize("name", WHOLE_ACTIONS)
def test_a_way_is_as_strong_as_the_mean(rig, ways, means, name):
    """What is along the mean is taken out, so that 5 is as much as before; what is left is neither
    nothing nor another action. Measured: at most 0.09 of the mean along it; sizes 0.09 to 0.53."""
    mean = means[name]
    skin = np.any([ways[variant_name(name, way)] for way in WAYS], axis=(0, 2))
    for way in WAYS:
        move = ways[variant_name(name, way)]
        along = (move * mean).sum() / (mean[skin] ** 2).sum()
        size = np.linalg.norm(move) / np.linalg.norm(mean[skin])
        assert abs(along) < 0.12, way
        assert 0.05 < size < 0.6, way


@pytest.mark.parametrize("stem", ["frontalis", "wince", "sneer", "smile", "grimace"])
def test_left_and_right_are_halves(ways, stem):
    for way in WAYS:
        left, right = (ways[variant_name(f"{stem}_{side}", way)] for side in ("left", "right"))
        both = ways[variant_name(stem, way)]
        np.testing.assert_allclose(left + right, both, atol=4e-5)  # what is too little is left out
        assert min(np.abs(left).max(), np.abs(right).max()) > 1e-4


def test_ways_are_alike_on_both_sides_but_for_the_lopsided(rig):
    mirrored = [-1, 1, 1]
    for group, (_, actions) in GROUPS.items():
        sided = {c.name for c in CONTROLS if c.side != "both"}
        for way, what in WAYS.items():
            action = next(name for name in actions if name not in sided)
            change = rig.shape(FaceParameters({action: 5.0}, {f"{group}_action_{way}": 1.0}))
            change = change - rig.shape(FaceParameters({action: 5.0}))
            image = change[rig.mirror] * mirrored
            apart = np.linalg.norm(change - image) / np.linalg.norm(change)
            if what == "lopsided":
                assert apart > 1.2, (group, way)  # twice, where it is the very opposite
            else:
                assert apart < 0.25, (group, way)


def test_what_is_in_the_mouth_the_balls_and_the_joints_stay(rig):
    who = dict.fromkeys(TABLE, 1.0)
    for name in ("jaw_open", "smile", "purse", "squint"):
        face = FaceParameters({name: 5.0}, who)
        away = rig.pose(face) - rig.pose(FaceParameters({name: 5.0}))
        assert np.abs(away).max() > 0.5 * MM
        for part in ("teeth", "tongue", "eyes"):
            assert np.abs(away[rig.parts[part]]).max() < 1e-6, (name, part)
    assert np.abs(rig.motions.cage_variants.toarray()[:, 3 * rig._m :]).max() == 0


def test_lids_close_in_every_way(rig):
    """The edge of the upper lid: what a blink takes farthest. Measured: 0.05 mm, 0.3 at most."""
    way_down = (rig.shape(FaceParameters({"blink": 5.0})) - rig.neutral())[:, 1]
    skin = rig.parts["skin"]
    edge = np.flatnonzero(skin & (way_down < 0.9 * way_down[skin].min()))
    assert len(edge) > 60
    for k in range(6):
        shut = FaceParameters({"blink": 5.0, "squint": 3.0, "brow_furrow": 3.0, "wince": 2.0})
        who = drawn_actions(np.random.default_rng(k))
        away = rig.shape(FaceParameters(shut.aus, who)) - rig.shape(shut)
        assert np.abs(away).max() > 0.2 * MM
        assert np.abs(away[edge]).mean() < 0.1 * MM
        assert np.abs(away[edge]).max() < 0.5 * MM


def test_many_people_do_the_same_thing_each_in_their_own_way(rig, means, ways):
    """How alike people's keys are: the cosine to the mean, and between two people. Measured, of all
    actions: to the mean 0.90 in the mean and 0.70 at least; between two people 0.84."""
    people = [drawn_actions(np.random.default_rng([5, k])) for k in range(40)]
    to_mean, between = [], []
    for name in WHOLE_ACTIONS:
        rows = np.stack([ways[variant_name(name, way)].ravel() for way in WAYS])
        group = GROUP_OF[name]
        amounts = np.array([[who[f"{group}_action_{way}"] for way in WAYS] for who in people])
        keys = means[name].ravel() + amounts @ rows
        keys /= np.linalg.norm(keys, axis=1, keepdims=True)
        to_mean.append(keys @ means[name].ravel() / np.linalg.norm(means[name]))
        between.append((keys @ keys.T)[np.triu_indices(len(people), 1)])
    assert np.mean(to_mean) > 0.85
    assert np.min(to_mean) > 0.6
    others = [b for b, name in zip(between, WHOLE_ACTIONS, strict=True) if "jaw" not in name]
    assert np.mean(others) < 0.93
    assert np.min([np.mean(b) for b in others]) > 0.6


def test_people_are_drawn_by_lot_within_bounds():
    one, again = (drawn_actions(np.random.default_rng(3)) for _ in range(2))
    assert one == again
    assert set(one) == set(TABLE) == {f.name for f in ACTIONS}
    many = [drawn_actions(np.random.default_rng(k)) for k in range(300)]
    values = np.array([list(who.values()) for who in many])
    assert np.abs(values).max() <= 1
    assert 0.6 * SPREAD < values.std() < 1.4 * SPREAD
    sizes = values.std(axis=1)
    assert np.quantile(sizes, 0.9) > 1.8 * np.quantile(sizes, 0.1)  # some are near the mean
    for who in many[:20]:
        check_identity(who)


def test_too_much_of_a_way_is_named():
    assert BY_NAME["smile_action_1"].part == "actions"
    with pytest.raises(ValueError, match=r"smile_action_1 = 1.5 is outside -1 to 1"):
        check_identity({"smile_action_1": 1.5})
    with pytest.raises(ValueError, match="no identity parameter 'smile_action_9'"):
        check_identity({"smile_action_9": 0.5})


def test_names_that_the_asset_does_not_know_count_nothing():
    weights = variant_weights({"smile_action_2": 0.5}, ["smile_way_2", "nobody_way_1"])
    assert weights.tolist() == [0.5, 0.0]
