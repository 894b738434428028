"""The keys' expressions: what they may say, and that every reader of them finds the same values."""

from __future__ import annotations

import ast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import facs_rig.keys
from facs_rig import CONTROL_NAMES, load_rig
from facs_rig.keys import LONGEST, PROPERTIES, Key, abbreviated, compile_keys, variables_of

NAMES_PER_EXPRESSION = 52  # one letter each
RIG = load_rig()
KEYS = RIG.keys
HELPERS = KEYS[len(CONTROL_NAMES) :]
ALLOWED = (
    ast.Expression, ast.BinOp, ast.UnaryOp, ast.Add, ast.Sub, ast.Mult, ast.Div, ast.USub,
    ast.UAdd, ast.Call, ast.Name, ast.Load, ast.Constant,
)  # fmt: skip


def evaluate(expression: str, values: dict[str, float]) -> float:
    """The plain text, as any reader of Python would understand it."""
    return float(eval(expression, {"__builtins__": {}, "min": min, "max": max}, dict(values)))


@pytest.mark.parametrize(
    ("expression", "names"),
    [
        ("smile*0.2", ("smile",)),
        ("max(b*2-a,0)+a", ("b", "a")),
        ("min(max(1,2),3)", ()),
        ("0.5", ()),
        ("-gaze_pitch", ("gaze_pitch",)),
    ],
)
def test_variables_are_named_once(expression, names):
    found = variables_of(expression)
    assert sorted(found) == sorted(names)
    assert len(set(found)) == len(found)


@pytest.mark.parametrize("expression", ["smile*", "smile 2", ""])
def test_what_is_no_expression_is_an_error(expression):
    with pytest.raises(SyntaxError):
        variables_of(expression)


# --- the rig's own keys ---


@pytest.mark.parametrize("key", KEYS, ids=lambda key: key.name)
def test_a_key_says_only_what_blenders_drivers_understand(key):
    tree = ast.parse(key.expression, mode="eval")
    for node in ast.walk(tree):
        assert isinstance(node, ALLOWED), ast.dump(node)
        if isinstance(node, ast.Call):
            assert isinstance(node.func, ast.Name)
            assert node.func.id in ("min", "max")
            assert len(node.args) == 2
            assert not node.keywords
        if isinstance(node, ast.Constant):
            assert type(node.value) in (int, float)


@pytest.mark.parametrize("key", KEYS, ids=lambda key: key.name)
def test_a_key_can_be_abbreviated(key):
    _, names = abbreviated(key.expression)
    assert len(variables_of(key.expression)) <= NAMES_PER_EXPRESSION
    assert all(len(alias) == 1 for alias in names)
    assert tuple(names.values()) == variables_of(key.expression)
    assert len(key.name) < 61  # what a shape key of Blender may be called


def test_keys_fit_into_drivers():
    """In parts, where one is too long: each is short enough, and together they say the same."""
    pytest.importorskip("bpy")
    from facs_rig.blender.keys import in_parts

    values = settings_of(3)
    for key in KEYS:
        known = dict(values)
        for name, expression in in_parts(key.name, key.expression):
            assert len(abbreviated(expression)[0]) <= LONGEST
            known[name] = evaluate(expression, known)
        values[key.name] = values.get(key.name, known[key.name])
        assert known[key.name] == pytest.approx(evaluate(key.expression, values), abs=1e-12)


def test_a_key_reads_controls_properties_and_keys_before_it():
    known = {*CONTROL_NAMES, *PROPERTIES}
    for key in HELPERS:
        assert set(variables_of(key.expression)) <= known, key.name
        known.add(key.name)
    assert len({key.name for key in KEYS}) == len(KEYS)
    assert not {key.name for key in HELPERS} & {*CONTROL_NAMES, *PROPERTIES}


def test_controls_come_first_and_full_intensity_is_one():
    for name, key in zip(CONTROL_NAMES, KEYS, strict=False):
        assert key.name == name
        assert evaluate(key.expression, {name: 5.0}) == pytest.approx(1.0)
        assert evaluate(key.expression, {name: 0.0}) == 0.0


def test_a_face_at_rest_has_no_key_but_zero():
    rest = dict.fromkeys((*CONTROL_NAMES, *PROPERTIES), 0.0) | {"crease_gain": 1.0}
    assert not compile_keys(HELPERS)(rest).any()


def settings_of(seed: int) -> dict[str, float]:
    rng = np.random.default_rng(seed)
    values = {name: float(v) for name, v in zip(CONTROL_NAMES, rng.uniform(0, 10, 47), strict=True)}
    for name in rng.choice(CONTROL_NAMES, 25, replace=False):
        values[str(name)] = 0.0
    return values | {
        "gaze_yaw": float(rng.uniform(-35, 35)),
        "gaze_pitch": float(rng.uniform(-35, 35)),
        "crease_gain": float(rng.uniform(0.2, 2)),
        "lid_rest": float(rng.uniform(-0.3, 0.5)),
    }


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_abbreviated_text_gives_the_same(seed):
    """Every key of the rig, for a random face."""
    values = settings_of(seed)
    for key, value in zip(HELPERS, compile_keys(HELPERS)(values), strict=True):
        text, names = abbreviated(key.expression)
        short = {alias: values[name] for alias, name in names.items()}
        assert evaluate(text, short) == pytest.approx(value, rel=1e-9, abs=1e-12)
        values[key.name] = float(value)  # for the keys behind it


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(0, 10_000), min_size=1, max_size=5))
def test_many_faces_at_once_as_one_by_one(seeds):
    faces = [settings_of(seed) for seed in seeds]
    batch = {name: np.array([face[name] for face in faces]) for name in faces[0]}
    values = compile_keys(HELPERS)
    np.testing.assert_allclose(
        values(batch), np.stack([values(face) for face in faces], axis=1), rtol=1e-12, atol=1e-12
    )


# --- any keys ---


def test_names_that_contain_each_other_and_functions_survive():
    text, names = abbreviated("smile*2+smile_left-min(smile,max_lid)")
    values = {"smile": 2.0, "smile_left": 3.0, "max_lid": 1.5}
    assert evaluate(text, {a: values[n] for a, n in names.items()}) == 2 * 2 + 3 - 1.5


def test_numbers_with_exponents_are_left_alone():
    names = [f"control_{k}" for k in range(6)]  # one of them is called e
    text, alias = abbreviated("+".join(f"1e-05*{name}+2.5e3*{name}" for name in names))
    assert "e" in alias
    assert evaluate(text, dict.fromkeys(alias, 1.0)) == pytest.approx(6 * 2500.00001)


def test_fifty_two_names_have_a_letter_each():
    wanted = [f"control_{k}" for k in range(NAMES_PER_EXPRESSION)]
    text, names = abbreviated("+".join(wanted))
    assert sorted(names.values()) == sorted(wanted)
    assert evaluate(text, {alias: 1.0 for alias in names}) == NAMES_PER_EXPRESSION


def test_a_key_may_read_earlier_ones():
    keys = [Key("once", "smile*2"), Key("twice", "once*once"), Key("both", "once+twice")]
    values = compile_keys(keys)
    np.testing.assert_allclose(values({"smile": 3.0}), [6, 36, 42])
    np.testing.assert_allclose(values({"smile": np.array([0.0, 3.0])}), [[0, 6], [0, 36], [0, 42]])


def test_a_key_cannot_read_later_ones():
    with pytest.raises(ValueError, match="key 'first': an expression may not hold 'second'"):
        compile_keys([Key("first", "second+1"), Key("second", "smile")])


def test_constants_are_as_long_as_the_batch():
    values = compile_keys([Key("constant", "0.25"), Key("own", "min(smile,1)")])
    np.testing.assert_allclose(values({"smile": np.array([0.5, 4.0])}), [[0.25, 0.25], [0.5, 1]])


def test_no_keys_at_all():
    assert compile_keys([])({"smile": 1.0}).shape == (0,)


NOT_OURS = [
    "grin*2", "abs(smile)", "__import__('os')", "open('x')", "smile.real", "smile**9**9",
    "smile if smile else 1", "[smile]", "(lambda: smile)()", "min(smile)", "min(smile,1,2)",
    "min(smile,1,key=abs)", "min(*smile)", "max", "min*2", "'a'*9999999", "1j", "True", "None",
    "1e400", "smile//1", "smile%1", "smile<<9", "~smile", "not smile", "smile>1", "smile and 1",
    "(smile:=1)", "f'{smile}'", "smile; smile", "smile\nsmile", "", "smile*", "\0", "…",
    "9" * 5000, "-" * 1500 + "smile", "(" * 900 + "smile" + ")" * 900, "smile+" * 500 + "smile",
    "1.0.__class__", "().__class__.__bases__[0].__subclasses__()", "smile[0]", "__builtins__",
    "await smile", "yield", "import os", "min.__self__", "ascii(smile)", "é*2",
]  # fmt: skip


@pytest.mark.parametrize("expression", NOT_OURS)
def test_what_is_no_plain_sum_is_refused_and_not_run(expression, monkeypatch):
    """Texts come from a file, which may be anybody's."""
    for name in ("exec", "eval", "compile"):  # what could run it
        monkeypatch.setattr(facs_rig.keys, name, None, raising=False)
    with pytest.raises(ValueError, match="^key 'bad': ") as told:
        compile_keys([Key("fine", "smile*2"), Key("bad", expression)])
    assert "\n" not in str(told.value) and len(str(told.value)) < 160


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000))
def test_the_very_bits_that_python_gives(seed):
    values = settings_of(seed)
    mine = compile_keys(HELPERS)(values)
    for key, value in zip(HELPERS, mine, strict=True):
        expected = evaluate(key.expression, values)
        assert np.float64(expected).tobytes() == value.tobytes()
        values[key.name] = expected


def expressions():
    """Texts of all operations that drivers need, at random."""
    leaf = st.one_of(
        st.sampled_from(["smile", "squint", "crease_gain"]),
        st.integers(0, 9).map(str),
        st.floats(0.001, 99, allow_nan=False).map(lambda value: f"{value:.4g}"),
    )
    return st.recursive(
        leaf,
        lambda inner: st.one_of(
            st.tuples(inner, st.sampled_from("+-*/"), inner).map("".join),
            st.tuples(inner, st.sampled_from("+-*/"), inner).map(lambda t: f"({''.join(t)})"),
            inner.map("-({})".format),
            st.tuples(st.sampled_from(["min", "max"]), inner, inner).map(
                lambda t: f"{t[0]}({t[1]},{t[2]})"
            ),
        ),
        max_leaves=12,
    )


@settings(max_examples=300, deadline=None)
@given(expressions(), st.tuples(*[st.sampled_from([0.0, -0.0, 1.0, 0.3, -7.25, 10.0])] * 3))
def test_any_expression_gives_the_very_bits_that_python_gives(expression, numbers):
    values = dict(zip(("smile", "squint", "crease_gain"), numbers, strict=True))
    try:
        expected = evaluate(expression, values)
    except ZeroDivisionError:
        with pytest.raises(ZeroDivisionError):
            compile_keys([Key("key", expression)])(values)
        return
    (found,) = compile_keys([Key("key", expression)])(values)
    assert np.float64(expected).tobytes() == found.tobytes()
