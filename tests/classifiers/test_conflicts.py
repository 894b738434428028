"""Which of the detected controls stay when not all of them can be meant."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from classifiers.conflicts import OPPOSITES, RIVALS, VERSIONS, resolve
from classifiers.labels import ACTIVE, FULL, mirrored_name
from facs_rig import CONTROL_NAMES, TWELVE

# Few different values, so that ties and the limit itself are drawn often.
probability = st.sampled_from([0.1, 0.3, 0.4, 0.5, 0.6, 0.9])
intensity = st.one_of(st.just(0.0), st.sampled_from([1.0, 2.0, 3.5, 5.0]), st.floats(ACTIVE, FULL))


@st.composite
def detections(draw, names=CONTROL_NAMES):
    pairs = [(draw(intensity), draw(probability)) for _ in names]
    return (
        {n: i for n, (i, _) in zip(names, pairs, strict=True)},
        {n: p for n, (_, p) in zip(names, pairs, strict=True)},
    )


def active(intensities):
    return {name for name, value in intensities.items() if value}


def said(**pairs):
    """A detection of the given controls (intensity, probability) and of no other."""
    intensities = dict.fromkeys(CONTROL_NAMES, 0.0)
    probabilities = dict(intensities)
    for name, (value, likely) in pairs.items():
        intensities[name], probabilities[name] = value, likely
    settled = resolve(intensities, probabilities)
    return {name: settled[name] for name in active(settled)}


@given(detections())
def test_settling_twice_changes_nothing(detection):
    intensities, probabilities = detection
    once = resolve(intensities, probabilities)
    assert resolve(once, probabilities) == once
    assert tuple(once) == CONTROL_NAMES


@given(detections())
def test_a_mirrored_detection_is_settled_to_the_mirrored_result(detection):
    mirrored = [{mirrored_name(name): v for name, v in part.items()} for part in detection]
    settled = resolve(*detection)
    assert resolve(*mirrored) == {mirrored_name(name): value for name, value in settled.items()}


@given(detections(), st.randoms())
def test_the_order_of_the_names_does_not_matter(detection, random):
    names = list(CONTROL_NAMES)
    random.shuffle(names)
    shuffled = [{name: part[name] for name in names} for part in detection]
    assert resolve(*shuffled) == resolve(*detection)


@given(detections())
def test_nothing_is_added_but_the_symmetric_one_of_two_sides(detection):
    before, _ = detection
    after = resolve(*detection)
    for name in active(after) - active(before):
        assert before[f"{name}_left"] and before[f"{name}_right"]
    assert all(value == 0 or ACTIVE <= value <= FULL for value in after.values())
    for name in CONTROL_NAMES:
        left, right = f"{name}_left", f"{name}_right"
        if left in after and right in after:
            assert not (after[left] and after[right])
            assert after[name] + max(after[left], after[right]) <= FULL + 1e-9


@given(detections())
def test_no_opposites_are_left_and_of_rivals_no_doubtful_one(detection):
    _, probabilities = detection
    left = active(resolve(*detection))
    for one, other in OPPOSITES:
        for version in VERSIONS:
            assert not {one + version, other + version} <= left
            assert not {one, other + version} <= left
            assert not {one + version, other} <= left
    for one, other in RIVALS:
        sided = {f"{one}_left", f"{other}_left"} & set(probabilities)  # there both sides speak too
        if {one, other} <= left and not sided:
            less, more = sorted((probabilities[one], probabilities[other]))
            assert less >= 0.5 or less == more


@given(detections(TWELVE))
def test_a_part_of_the_catalogue_will_do(detection):
    settled = resolve(*detection)
    assert tuple(settled) == TWELVE
    assert resolve(settled, detection[1]) == settled


@given(detections())
def test_what_is_alone_stays(detection):
    """Each control by itself keeps its intensity, however doubtful it is."""
    intensities, probabilities = detection
    for name in active(intensities):
        alone = dict.fromkeys(intensities, 0.0) | {name: intensities[name]}
        assert resolve(alone, probabilities) == alone


def test_every_name_in_the_tables_is_a_control():
    assert {name for pair in (*OPPOSITES, *RIVALS) for name in pair} <= set(CONTROL_NAMES)


def test_worry_lines_across_the_forehead_or_in_its_middle():
    certain = {"frontalis": 2.0, "medialis_frontalis": 3.0}
    assert said(frontalis=(2, 0.9), medialis_frontalis=(3, 0.6)) == certain
    assert said(frontalis=(2, 0.9), medialis_frontalis=(3, 0.4)) == {"frontalis": 2.0}
    assert said(frontalis=(2, 0.2), medialis_frontalis=(3, 0.4)) == {"medialis_frontalis": 3.0}
    assert said(frontalis_left=(2, 0.9), medialis_frontalis=(3, 0.4)) == {"frontalis_left": 2.0}


def test_folds_on_one_side_do_not_vie_with_those_on_the_other():
    assert said(wince_left=(2, 0.9), sneer_left=(3, 0.4)) == {"wince_left": 2.0}
    both = said(wince_left=(2, 0.9), sneer_right=(3, 0.4))
    assert both == {"wince_left": 2.0, "sneer_right": 3.0}


@pytest.mark.parametrize("first, second", [("left", "right"), ("right", "left")])
def test_one_side_seen_on_both(first, second):
    one, other = f"smile_{first}", f"smile_{second}"
    assert said(**{one: (4, 0.9), other: (2, 0.3)}) == {one: 4.0}
    assert said(**{one: (4, 0.9), other: (2, 0.6)}) == {"smile": 2.0, one: 2.0}
    assert said(**{one: (4, 0.3), other: (4, 0.3)}) == {"smile": 4.0}


def test_of_opposites_the_likelier_stays_however_sure_both_are():
    assert said(lid_raise=(2, 0.8), blink=(5, 0.9)) == {"blink": 5.0}
    assert said(lid_raise=(2, 0.8), blink_left=(5, 0.9)) == {"blink_left": 5.0}
    assert said(jaw_left=(2, 0.8), jaw_right=(2, 0.7)) == {"jaw_left": 2.0}
    assert said(jaw_left=(2, 0.8), jaw_right=(2, 0.8)) == {}
    assert said(lip_lock_upper=(2, 0.8), lip_loosen_lower=(2, 0.9)) == {
        "lip_lock_upper": 2.0, "lip_loosen_lower": 2.0,
    }  # fmt: skip


def test_nothing_yields_to_what_has_itself_yielded():
    """The sneer is excluded by the wince, so that the deepened fold stays beside the wince."""
    found = said(wince=(2, 0.9), sneer=(2, 0.4), nasolabial_deepen=(2, 0.3))
    assert found == {"wince": 2.0, "nasolabial_deepen": 2.0}


def test_both_sides_speak_for_the_whole():
    """A doubtful symmetric control does not yield if its two sides are as certain as can be."""
    found = said(frontalis=(1, 0.3), frontalis_left=(2, 0.9), frontalis_right=(2, 0.8),
                 medialis_frontalis=(3, 0.7))  # fmt: skip
    assert found == {"frontalis": 3.0, "medialis_frontalis": 3.0}
    assert np.isclose(sum(found.values()), 6)
