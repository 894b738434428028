"""Other rigs' names for an expression, with the name lists that these rigs really have."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from facs_rig import ARKIT_NAMES, CONTROL_NAMES, FULL_INTENSITY, load_rig
from facs_rig.conventions import CONVENTIONS
from facs_rig.expressions import mirrored
from facs_rig.retarget import recognise, retarget, unshown

# The 18 expressions of the VRM 1.0 specification, and the 17 of VRM 0.x without `unknown`.
VRM1 = ("happy", "angry", "sad", "relaxed", "surprised", "aa", "ih", "ou", "ee", "oh", "blink",
        "blinkLeft", "blinkRight", "lookUp", "lookDown", "lookLeft", "lookRight",
        "neutral")  # fmt: skip
VRM0 = ("neutral", "a", "i", "u", "e", "o", "blink", "joy", "angry", "sorrow", "fun", "lookup",
        "lookdown", "lookleft", "lookright", "blink_l", "blink_r")  # fmt: skip
# As VRoid Studio exports them; older versions put the mesh's name before each.
VROID = tuple(
    f"Fcl_{name}"
    for name in (
        "ALL_Neutral", "ALL_Angry", "ALL_Fun", "ALL_Joy", "ALL_Sorrow", "ALL_Surprised",
        "BRW_Angry", "BRW_Fun", "BRW_Joy", "BRW_Sorrow", "BRW_Surprised", "EYE_Natural",
        "EYE_Angry", "EYE_Close", "EYE_Close_R", "EYE_Close_L", "EYE_Fun", "EYE_Joy",
        "EYE_Joy_R", "EYE_Joy_L", "EYE_Sorrow", "EYE_Surprised", "EYE_Spread", "MTH_Up",
        "MTH_Down", "MTH_Angry", "MTH_Small", "MTH_Large", "MTH_Neutral", "MTH_Fun", "MTH_Joy",
        "MTH_Sorrow", "MTH_Surprised", "MTH_A", "MTH_I", "MTH_U", "MTH_E", "MTH_O",
    )
)  # fmt: skip
# Curves of Epic's Facial Description Standard, those of a part of the face that ARKit has as well
# and neighbours that are easily taken for them.
METAHUMAN = tuple(
    f"CTRL_expressions_{name}"
    for name in (
        *(f"{stem}{side}"
          for stem in ("browDown", "browLateral", "browRaiseIn", "browRaiseOuter", "eyeBlink",
                       "eyeCheekRaise", "eyeFaceScrunch", "eyeLidPress", "eyeLookDown",
                       "eyeLookLeft", "eyeLookRight", "eyeLookUp", "eyeLowerLidUp", "eyeRelax",
                       "eyeSquintInner", "eyeUpperLidUp", "eyeWiden", "jawChinCompress",
                       "jawChinRaiseD", "jawChinRaiseU", "jawClench", "mouthCheekBlow",
                       "mouthCheekSuck", "mouthCornerDepress", "mouthCornerDown",
                       "mouthCornerPull", "mouthCornerUp", "mouthDimple", "mouthFunnelD",
                       "mouthFunnelU", "mouthLipsPress", "mouthLipsPurseD", "mouthLipsPurseU",
                       "mouthLipsTightenD", "mouthLipsTightenU", "mouthLipsTogetherD",
                       "mouthLipsTogetherU", "mouthLowerLipBite", "mouthLowerLipDepress",
                       "mouthLowerLipRollIn", "mouthLowerLipRollOut", "mouthPressD",
                       "mouthPressU", "mouthSharpCornerPull", "mouthStretch",
                       "mouthStretchLipsClose", "mouthUpperLipRaise", "mouthUpperLipRollIn",
                       "mouthUpperLipRollOut", "neckStretch", "noseNasolabialDeepen",
                       "noseNostrilCompress", "noseNostrilDepress", "noseNostrilDilate",
                       "noseWrinkle", "noseWrinkleUpper")
          for side in "LR"),
        "jawBack", "jawFwd", "jawLeft", "jawOpen", "jawOpenExtreme", "jawRight", "mouthDown",
        "mouthLeft", "mouthLowerLipShiftLeft", "mouthRight", "mouthUp", "tongueOut", "tongueLeft",
    )
)  # fmt: skip
MESHES = {"ours": CONTROL_NAMES, "arkit": ARKIT_NAMES, "metahuman": METAHUMAN, "vrm1": VRM1,
          "vrm0": VRM0, "vroid": VROID}  # fmt: skip
HALVES = (("Left", "Right"), ("left", "right"), ("L", "R"), ("l", "r"))

controls = st.dictionaries(st.sampled_from(CONTROL_NAMES), st.floats(0, 10), max_size=8)
conventions = st.sampled_from(sorted(CONVENTIONS))


def other_side(key: str, keys) -> str:
    """The key of the other side, the key itself if it has none."""
    for pair in HALVES:
        for here, there in (pair, pair[::-1]):
            if key.endswith(here) and key.removesuffix(here) + there in keys:
                return key.removesuffix(here) + there
    return key


# --- names ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", MESHES)
def test_each_convention_is_recognised_by_its_own_names(name):
    known = recognise(("Basis", *MESHES[name]))
    assert known.convention.name == name
    assert known.missing == () and known.ambiguous == {}
    assert known.found == {key: key for key in CONVENTIONS[name].keys}


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize(
    "written",
    [
        "head_{}", "Face.M_F00_000_00_{}", "Key_{}", "{}.001", "{}_geo", "blendShape1.{}",
    ],
)  # fmt: skip
def test_words_before_and_after_a_name_do_no_harm(name, written):
    names = [written.format(key) for key in MESHES[name]]
    known = recognise(names)
    if name == "vrm0" and not written.endswith("001"):
        # single letters are vowels only when nothing else stands beside them
        assert set("aiueo") == set(known.missing) and known.convention.name == "vrm0"
        return
    assert known.convention.name == name
    assert known.found == {key: written.format(key) for key in CONVENTIONS[name].keys}


@pytest.mark.parametrize(
    "write",
    [
        str.lower,
        str.upper,
        lambda key: key.removesuffix("Left") + "_L" if key.endswith("Left") else key,
        lambda key: "L_" + key.removesuffix("Left") if key.endswith("Left") else key,
        lambda key: "left " + key.removesuffix("Left") if key.endswith("Left") else key,
        lambda key: key.replace("Left", ".l"),
        lambda key: key.replace("Left", "-LEFT"),
        lambda key: "Eye_L_" + key[3:-4] if key.startswith("eye") and key[-4:] == "Left" else key,
    ],
)  # fmt: skip
def test_case_separators_and_sides_are_spelled_as_one_likes(write):
    known = recognise([write(name) for name in ARKIT_NAMES])
    assert known.convention.name == "arkit"
    assert known.found == {key: write(key) for key in CONVENTIONS["arkit"].keys}


def test_metahuman_names_come_without_their_prefix_and_in_lower_case_too():
    keys = CONVENTIONS["metahuman"].keys
    for write in (lambda n: n.removeprefix("CTRL_expressions_"), str.lower):
        known = recognise([write(name) for name in METAHUMAN])
        assert known.convention.name == "metahuman"
        assert known.found == {key: write(key) for key in keys}


def test_a_teeth_mesh_with_one_key_is_enough():
    known = recognise(["Basis", "teeth_jawOpen"])
    assert (known.convention.name, known.found) == ("arkit", {"jawOpen": "teeth_jawOpen"})
    assert "mouthSmileLeft" in known.missing


def test_presets_beside_perfect_sync_leave_the_finer_names_in_charge():
    assert recognise((*VRM1, *ARKIT_NAMES)).convention.name == "arkit"


@pytest.mark.parametrize(
    ("names", "chosen"),
    [
        (["head_jawOpen", "jawOpen", "jawOpen.001", "JawOpen"], "jawOpen"),
        (["head_jawOpen", "jaw_open_fix_v2"], "head_jawOpen"),
    ],
)
def test_the_name_with_least_around_it_is_taken(names, chosen):
    assert recognise([*names, "mouthSmileLeft", "mouthSmileRight"]).found["jawOpen"] == chosen


def test_what_can_be_read_in_two_ways_is_refused():
    known = recognise(["head_jawOpen", "teeth_jawOpen", "mouthFunnel"])
    assert "jawOpen" in known.missing
    assert known.ambiguous == {"jawOpen": ("head_jawOpen", "teeth_jawOpen")}
    with pytest.raises(ValueError, match="'head_jawOpen' and 'teeth_jawOpen' could all be"):
        recognise(["head_jawOpen", "teeth_jawOpen"])


@pytest.mark.parametrize(
    "name",
    [
        "jawOpen_mouthSmileLeft",  # a corrective of two keys
        "browInnerUp_L",  # half of a key that has no sides
        "mouthSmileLeft_R",
        "mouthSmile_upper_left_Left",
    ],
)
def test_names_that_only_look_alike_are_left_alone(name):
    assert name not in recognise([name, "noseSneerLeft", "noseSneerRight"]).found.values()


@pytest.mark.parametrize("names", [[], ["Basis"], ["Key 1", "bulge", "あ"], ["Key_A", "L"]])
def test_a_mesh_without_any_known_name_is_one_sentence(names):
    with pytest.raises(ValueError, match=r"none of its \d shape keys has a name of .*ARKit"):
        recognise(names)


# --- values ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CONVENTIONS)
def test_the_table_speaks_of_controls_and_of_both_sides_alike(name):
    keys = CONVENTIONS[name].keys
    for key, weights in keys.items():
        assert weights and set(weights) <= set(CONTROL_NAMES), key
        assert all(weight > 0 for weight in weights.values()), key
        assert keys[other_side(key, keys)] == mirrored(weights), key


def test_every_arkit_key_is_one_that_a_face_is_driven_by():
    undriven = set(ARKIT_NAMES) - set(CONVENTIONS["arkit"].keys)
    assert all(name.startswith("eyeLook") or name in ("mouthClose", "mouthLeft", "mouthRight",
               "tongueOut") for name in undriven)  # fmt: skip
    assert not set(CONVENTIONS["arkit"].keys) - set(ARKIT_NAMES)


def test_values_of_some_expressions():
    arkit = retarget({"smile": 5, "frown": 2.5, "blink_left": 10}, "arkit")
    assert arkit["mouthSmileLeft"] == arkit["mouthSmileRight"] > 0.8
    assert (arkit["mouthFrownLeft"], arkit["eyeBlinkLeft"], arkit["eyeBlinkRight"]) == (0.5, 1, 0)
    assert retarget({"smile_left": 5}, "vrm1")["happy"] == 0.5
    assert retarget({"smile_left": 5, "smile_right": 5}, "vrm0")["joy"] == 1
    human = retarget({"smile": 2.0, "smile_left": 1.0}, "metahuman")
    assert human["CTRL_expressions_mouthCornerPullL"] == pytest.approx(0.6)
    assert human["CTRL_expressions_mouthCornerPullR"] == pytest.approx(0.4)
    assert retarget({"jaw_open": 4}, "vroid")["Fcl_MTH_A"] == pytest.approx(0.8)
    assert retarget({"smile": 3}, "ours") == {n: 0.6 * (n == "smile") for n in CONTROL_NAMES}


@given(conventions, controls, st.sampled_from(CONTROL_NAMES), st.floats(0, 10))
def test_values_lie_between_0_and_1_and_grow_with_the_expression(name, aus, control, more):
    less = retarget(aus, name)
    stronger = retarget({**aus, control: max(aus.get(control, 0), more)}, name)
    assert set(less) == set(CONVENTIONS[name].keys)
    assert all(0 <= less[key] <= stronger[key] + 1e-12 <= 1 + 2e-12 for key in less)
    assert not any(retarget({}, name).values())


@given(conventions, controls)
def test_a_mirrored_expression_gives_mirrored_keys(name, aus):
    there = retarget(mirrored(aus), name)
    for key, value in retarget(aus, name).items():
        assert there[other_side(key, there)] == pytest.approx(value)


@pytest.mark.parametrize(
    ("aus", "name", "says"),
    [
        ({"smlie": 3}, "arkit", "did you mean 'smile'"),
        ({"smile": 11}, "arkit", "outside 0 to 10"),
        ({"smile": float("nan")}, "arkit", "outside 0 to 10"),
        ({"smile": -1}, "ours", "outside 0 to 10"),
        ({}, "arkti", "did you mean 'arkit'"),
        ({}, "?", "there are ours, arkit"),
    ],
)
def test_bad_input_is_one_sentence(aus, name, says):
    with pytest.raises(ValueError, match=says):
        retarget(aus, name)


def test_what_a_rig_cannot_show_is_told():
    arkit, vrm = CONVENTIONS["arkit"], CONVENTIONS["vrm1"]
    aus = {"nostril_flare": 4.0, "smile_left": 2.0, "jaw_open": 1.0, "squint": 0.0}
    assert unshown(aus, arkit, arkit.keys) == ("nostril_flare",)
    assert unshown(aus, arkit, ["jawOpen"]) == ("nostril_flare", "smile_left")
    assert unshown(aus, vrm, ["happy", "aa"]) == ("nostril_flare",)
    assert unshown({}, arkit, []) == ()


# --- against the shipped head, whose ARKit keys were modelled by somebody else --------------------


def test_arkit_keys_move_the_head_as_the_controls_do():
    rig = load_rig()
    deltas = dict(zip(ARKIT_NAMES, rig.arkit_deltas, strict=True))
    unlike = unshown(dict.fromkeys(CONTROL_NAMES, 1.0), CONVENTIONS["arkit"], ARKIT_NAMES)
    assert set(unlike) == {"cheek_suck", "nostril_flare", "nostril_compress"}
    for name, wanted in zip(CONTROL_NAMES, rig.control_deltas, strict=True):
        values = retarget({name: FULL_INTENSITY}, "arkit")
        moved = sum(value * deltas[key] for key, value in values.items())
        if name not in unlike:
            likeness = np.vdot(moved, wanted) / np.linalg.norm(moved) / np.linalg.norm(wanted)
            # A blink runs along an arc, keys go straight; half a funnel takes the other lip along.
            hard = name.startswith(("blink", "lip_loosen_"))
            assert likeness > (0.55 if hard else 0.8), name
