"""Length and volume: what they change of a cut, and what they leave."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from facs_rig.common.errors import InputError
from facs_rig.hair.cut import ANGLES, mirrored, to_json
from facs_rig.hair.presets import HAIRLINE, PRESETS, preset
from facs_rig.hair.shell import shell
from facs_rig.hair.style import LEAST, MOST, Style, fuller, longer, styled

NAMES = st.sampled_from(sorted(PRESETS))
FACTORS = st.floats(LEAST, MOST)


@given(NAMES)
def test_as_drawn_changes_nothing(name):
    cut = preset(name)
    assert to_json(styled(cut, Style())) == to_json(cut)


@given(NAMES, FACTORS, FACTORS)
def test_more_is_never_less(name, one, other):
    cut, (less, more) = preset(name), sorted((one, other))
    assert (longer(cut, more).edge <= longer(cut, less).edge + 1e-12).all()
    assert (fuller(cut, more).thick >= fuller(cut, less).thick - 1e-12).all()
    for tail, fuller_tail in zip(fuller(cut, less).balls, fuller(cut, more).balls, strict=True):
        assert (fuller_tail.radius >= tail.radius).all()


@given(NAMES, FACTORS, FACTORS)
def test_both_sides_alike_stay_alike(name, length, volume):
    style = Style(length, volume)
    one, other = styled(mirrored(preset(name)), style), mirrored(styled(preset(name), style))
    assert np.allclose(one.edge, other.edge) and np.allclose(one.thick, other.thick)


@given(NAMES, FACTORS)
def test_length_and_volume_are_two_things(name, factor):
    cut = preset(name)
    assert np.array_equal(longer(cut, factor).thick, cut.thick)
    assert np.array_equal(fuller(cut, factor).edge, cut.edge)


def test_what_is_bald_stays_bald():
    cut = preset("bald_rim")
    crown = np.degrees(np.minimum(ANGLES, 2 * np.pi - ANGLES)) <= 50
    assert np.array_equal(longer(cut, MOST).edge[crown], cut.edge[crown])
    flat = replace(cut, thick=np.zeros_like(cut.thick))
    assert not fuller(flat, MOST).thick.any()


@pytest.mark.parametrize("name", ["bob", "long_straight", "fringe"])
def test_hair_is_cut_to_the_hairline_at_most(name):
    cut = preset(name)
    line = np.interp(np.degrees(np.minimum(ANGLES, 2 * np.pi - ANGLES)), *np.array(HAIRLINE).T)
    short = longer(cut, LEAST)
    assert (short.edge <= np.maximum(line, cut.edge) + 1e-12).all()
    assert short.edge[24] > cut.edge[24] + 0.12  # behind it is shorter


def test_the_face_stays_open():
    cut = preset("long_straight")
    assert longer(cut, MOST).edge[0] > cut.edge[0] - 0.02
    assert longer(cut, 1.5).edge[24] == pytest.approx(1 - 1.5 * (1 - cut.edge[24]))


def test_a_tail_grows_and_a_bun_does_not():
    tail, bun = preset("ponytail"), preset("bun")
    assert longer(tail, 1.5).balls[0].line[-1, 1] < tail.balls[0].line[-1, 1] - 0.5
    assert np.array_equal(longer(bun, 1.5).balls[0].line, bun.balls[0].line)
    assert np.allclose(longer(tail, 1.5).edge, tail.edge, atol=0.05)  # combed back as before


@pytest.mark.parametrize("name", sorted(PRESETS))
@pytest.mark.parametrize("style", [Style(LEAST, LEAST), Style(MOST, MOST)])
def test_the_shell_of_any_style_is_sound(rig, name, style):
    made = shell(rig, {}, styled(preset(name), style))
    assert np.isfinite(made.points).all()
    assert len(made.points) == len(shell(rig, {}, preset(name)).points)
    size = np.ptp(made.points, axis=0)
    assert (size > 0.1).all() and (size < 1.0).all()


@pytest.mark.parametrize("value", [LEAST - 0.01, MOST + 0.01, float("nan"), -1.0])
@pytest.mark.parametrize("name", ["length", "volume"])
def test_a_style_out_of_range_is_said_so(name, value):
    with pytest.raises(InputError, match=f"{name} of hair must be from 0.3 to 2"):
        Style(**{name: value})
