"""Expression files, and expressions made of others."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from facs_rig import CONTROL_NAMES, FaceParameters, expressions
from facs_rig.expressions import FORMAT, blend, dumps, loads, mirrored, random_expression

FULL = FaceParameters(
    {"smile": 4.5, "blink_left": 10.0},
    {"age": 0.25, "nose_hump": -1.0},
    head=(0.3, -0.2, 0.1),
    neck=(0.01, 0.0, -0.5),
    gaze=(-0.4, 0.2),
)
HEADING = {"format": FORMAT, "version": 1}


def same(a: FaceParameters, b: FaceParameters) -> bool:
    angles = [np.array((*p.head, *p.neck, *p.gaze)) for p in (a, b)]
    return a.aus == b.aus and a.identity == b.identity and np.allclose(*angles, rtol=0, atol=1e-8)


def test_what_is_saved_comes_back(tmp_path):
    path = tmp_path / "joy.json"
    expressions.write(path, FULL)
    assert same(expressions.read(path), FULL)
    assert [p.name for p in tmp_path.iterdir()] == ["joy.json"]


def test_a_file_says_what_it_is_in_degrees():
    content = json.loads(dumps(FaceParameters({"smile": 5}, head=(np.radians(30), 0.0, 0.0))))
    assert content["format"] == FORMAT and content["version"] == 2
    assert content["head"] == {"yaw": 30.0, "pitch": 0.0, "roll": 0.0}
    assert content["aus"] == {"smile": 5.0}
    assert "identity" not in content  # an expression is worn by anybody


@given(
    st.dictionaries(st.sampled_from(CONTROL_NAMES), st.floats(0, 10).map(lambda v: round(v, 6))),
    st.tuples(*[st.floats(-3.14, 3.14)] * 3),
    st.tuples(*[st.floats(-1.04, 1.04)] * 2),
)
def test_every_expression_survives(aus, head, gaze):
    face = FaceParameters(aus, {}, head, (0.0, 0.0, 0.0), gaze)
    assert same(loads(dumps(face)), face)


def test_what_is_missing_is_neutral():
    assert loads(json.dumps(HEADING)) == FaceParameters()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "it is not JSON"),
        ("smile 5", "it is not JSON"),
        ("[" * 100_000, "it is not JSON"),
        ("9" * 5000, "it is not JSON"),
        ("[]", "it lacks"),
        ('{"aus": {"smile": 5}}', "it lacks"),
        (json.dumps({"format": FORMAT}), "its version is missing"),
        (json.dumps({"format": FORMAT, "version": True}), "its version is missing"),
        (
            json.dumps({"format": FORMAT, "version": 3, "aus": {"not yet known": 1}}),
            "saved by a newer Sketch to Face (format 3, this one knows 2); update the add-on",
        ),
        (json.dumps({**HEADING, "au": {}}), "no part 'au'; did you mean 'aus'?"),
        (json.dumps({**HEADING, "aus": []}), "'aus' must be a table"),
        (json.dumps({**HEADING, "aus": {"smlie": 5}}), "'smlie'; did you mean 'smile'?"),
        (json.dumps({**HEADING, "aus": {"smile": 10.5}}), "smile = 10.5 is outside 0 to 10"),
        (json.dumps({**HEADING, "aus": {"smile": -1}}), "smile = -1.0 is outside 0 to 10"),
        (json.dumps({**HEADING, "aus": {"smile": "5"}}), "'smile' has no number"),
        (json.dumps({**HEADING, "aus": {"smile": None}}), "'smile' has no number"),
        (json.dumps({**HEADING, "aus": {"smile": True}}), "'smile' has no number"),
        (json.dumps({**HEADING, "aus": {"smile": float("nan")}}), "'smile' is nan"),
        (json.dumps({**HEADING, "aus": {"smile": 10**400}}), "'smile' is inf"),
        (json.dumps({**HEADING, "identity": {"nose_hmp": 1}}), "did you mean 'nose_hump'?"),
        (json.dumps({**HEADING, "identity": {"age": 2}}), "age = 2.0 is outside -1 to 1"),
        (json.dumps({**HEADING, "head": {"yawn": 1}}), "'head' has no angle 'yawn'"),
        (json.dumps({**HEADING, "gaze": {"roll": 1}}), "'gaze' has no angle 'roll'"),
        (json.dumps({**HEADING, "gaze": {"yaw": 90}}), "gaze yaw = 90 is outside -60 to 60"),
        (json.dumps({**HEADING, "neck": {"yaw": float("inf")}}), "'neck yaw' is inf"),
    ],
)
def test_what_is_no_expression_is_refused_in_one_sentence(text, says):
    with pytest.raises(ValueError, match="^[^\n]+$") as refused:
        loads(text)
    assert says in str(refused.value)


@pytest.mark.parametrize("name", ["nowhere.json", "folder", "picture.json", "big.json"])
def test_a_file_that_cannot_be_read_is_named(tmp_path, name):
    (tmp_path / "folder").mkdir()
    (tmp_path / "picture.json").write_bytes(b"\x89PNG\r\n\x1a\n\xff\xfe")
    (tmp_path / "big.json").write_bytes(b" " * 2_000_000)
    with pytest.raises(ValueError, match=f"{name}'.* (cannot be read|not an expression file)"):
        expressions.read(tmp_path / name)


@pytest.mark.parametrize("aus", [{"smirk": 5}, {"smile": 11}, {"smile": float("nan")}])
def test_a_bad_expression_leaves_the_older_file(tmp_path, aus):
    path = tmp_path / "joy.json"
    path.write_text("older")
    with pytest.raises(ValueError):
        expressions.write(path, FaceParameters(aus))
    assert path.read_text() == "older"


def test_a_place_that_cannot_be_written_to_is_named(tmp_path):
    with pytest.raises(ValueError, match="cannot be written: no such file or directory"):
        expressions.write(tmp_path / "nowhere" / "joy.json", FULL)
    (tmp_path / "folder.json").mkdir()
    with pytest.raises(ValueError, match="cannot be written: a folder of that name"):
        expressions.write(tmp_path / "folder.json", FULL)
    assert {p.name for p in tmp_path.iterdir()} == {"folder.json"}


def test_files_with_a_byte_order_mark_are_read(tmp_path):
    path = Path(tmp_path / "joy.json")
    path.write_bytes(b"\xef\xbb\xbf" + dumps(FULL).encode())
    assert same(expressions.read(path), FULL)


# --- made of others ------------------------------------------------------------------------------


def test_random_expressions_are_ones_that_a_face_can_do(rng):
    seen = set()
    for _ in range(400):
        aus = random_expression(rng)
        assert 3 <= len(aus) <= 5
        assert all(1 <= value <= 5 for value in aus.values())
        names = set(aus)
        seen |= names
        for name in names:
            assert f"{name}_left" not in names and f"{name}_right" not in names, names
        for pair in (
            {"lid_raise", "blink"},
            {"lid_raise", "blink_left"},
            {"lid_raise", "squint"},
            {"smile", "frown"},
            {"smile_left", "purse"},
            {"jaw_open", "lip_lock_upper"},
            {"jaw_left", "jaw_right"},
            {"cheek_puff", "cheek_suck"},
            {"nostril_flare", "nostril_compress"},
            {"frontalis", "medialis_frontalis"},
            {"blink_left", "blink_right"},
        ):
            assert not pair <= names, names
        loads(dumps(FaceParameters(aus)))
    assert seen == set(CONTROL_NAMES)  # nothing is never done


def test_random_expressions_are_the_same_for_the_same_seed():
    first, second = (random_expression(np.random.default_rng(5)) for _ in range(2))
    assert first == second
    assert first != random_expression(np.random.default_rng(6))


def test_random_expressions_end_when_nothing_more_fits(rng):
    assert random_expression(rng, 0) == {}
    assert len(random_expression(rng, 2)) == 2
    assert 8 < len(random_expression(rng, 1000)) < 30
    with pytest.raises(ValueError, match="cannot have -1 controls"):
        random_expression(rng, -1)


def test_mirrored_exchanges_the_sides():
    aus = {"smile_left": 4.0, "jaw_right": 2.0, "squint": 1.0}
    assert mirrored(aus) == {"smile_right": 4.0, "jaw_left": 2.0, "squint": 1.0}


@given(st.dictionaries(st.sampled_from(CONTROL_NAMES), st.floats(0, 10)))
def test_mirrored_twice_is_the_same(aus):
    assert mirrored(mirrored(aus)) == aus
    assert set(mirrored(aus)) <= set(CONTROL_NAMES)


def test_blend_goes_in_straight_lines():
    joy, fear = {"smile": 4.0, "squint": 2.0}, {"lid_raise": 5.0, "squint": 1.0}
    assert blend(joy, fear, 0) == joy
    assert blend(joy, fear, 1) == fear
    assert blend(joy, fear, 0.5) == {"lid_raise": 2.5, "squint": 1.5, "smile": 2.0}
