"""What faces do that feel something: all of it possible, and in the mix that is asked for."""

from collections import Counter

import numpy as np
import pytest

from dataset_gen import feelings
from dataset_gen.feelings import BESIDE, FEELINGS, MOST, sample_feeling
from dataset_gen.sampling import FELT, sample_face, sample_rng
from facs_rig import CONTROL_NAMES, load_rig

MANY = [sample_feeling(np.random.default_rng(k)) for k in range(2000)]


def test_every_part_is_something_that_a_face_can_do():
    for often, parts in FEELINGS.values():
        assert often > 0
        for part in parts:
            for side in feelings.SIDES:
                assert part.control.format(side=side) in CONTROL_NAMES
            assert 1 <= part.least < part.most <= MOST and 0 < part.share <= 1
            assert parts.count(part) == 1
    assert all(1 <= value <= MOST for aus in MANY for value in aus.values())
    assert len({name for aus in MANY for name in aus}) == len(CONTROL_NAMES)  # some beside


def test_feelings_come_as_often_as_they_are_drawn():
    total = sum(often for often, _ in FEELINGS.values())
    share = {name: often / total for name, (often, _) in FEELINGS.items()}
    assert np.mean([not aus for aus in MANY]) == pytest.approx(share["rest"], abs=0.03)
    smiling = np.mean(["smile" in aus for aus in MANY])
    certain = share["smile"] + share["laugh"]
    assert certain - 0.03 < smiling < certain + 0.06
    for name in ("frontalis", "smile", "blink"):  # what one side does is done by either
        sides = [sum(f"{name}_{side}" in aus for aus in MANY) for side in feelings.SIDES]
        assert 0.6 < sides[0] / sides[1] < 1.6


def test_what_contradicts_itself_is_rare():
    """Nobody smiles and frowns, or raises lids that are shut, but for the one action beside."""
    pairs = Counter()
    for aus in MANY:
        pairs["smile frown"] += "smile" in aus and "frown" in aus
        pairs["blink lid_raise"] += "blink" in aus and "lid_raise" in aus
    assert all(count < 0.3 * BESIDE * len(MANY) for count in pairs.values())


def test_most_faces_of_the_scheme_feel_something():
    """They are those of `people` in all else, and the others do what these do."""
    rig = load_rig()
    felt, people = (
        [sample_face(rig, sample_rng(8, k), 64, scheme) for k in range(200)]
        for scheme in ("felt", "people")
    )
    resting = [np.mean([not s.parameters.aus for s in some]) for some in (felt, people)]
    assert resting[0] == pytest.approx(0.2 * FELT + 0.125 * (1 - FELT), abs=0.08)
    smiling = [np.mean(["smile" in s.parameters.aus for s in some]) for some in (felt, people)]
    assert smiling[0] > smiling[1] + 0.05
    ages = [np.mean([s.parameters.identity["age"] for s in some]) for some in (felt, people)]
    assert ages[0] == pytest.approx(ages[1], abs=0.15)
    assert any(s.style.graphite > 0 for s in felt)
