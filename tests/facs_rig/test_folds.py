"""A person's own creases: drawn or set by hand, in the asset, and what they do to the face."""

import numpy as np
import pytest

from facs_rig import CONTROLS, FaceParameters, folds, load_rig
from facs_rig.folds import DEEPEST, FAMILIES, GROOVES, PARAMETERS, drawn_creases, groove_weights
from facs_rig.grooves import CREASES, LINES, PLAIN, WAYS, grooves, names_of
from facs_rig.identity import IDENTITY, check_identity, crease_gain

MM = 1e-3
NONE = {f"{family}_depth": -1.0 for family in FAMILIES}
CREASED = [c.name for c in CONTROLS if c.creases]


@pytest.fixture(scope="module")
def rig():
    return load_rig()


def drawn(seed: int, share: float = 1.0) -> dict[str, float]:
    return drawn_creases(np.random.default_rng(seed), share)


def raised(rig, who: dict[str, float]) -> np.ndarray:
    """(crease keys, u, 3) what a person's creases do to rig.motions.skin_at, for each control."""
    motions = rig.motions
    own = motions.keys_of(motions.who([who]))[1] if who else motions.skin_keys
    return own.toarray().reshape(own.shape[0], -1, 3)


def likeness(a: np.ndarray, b: np.ndarray) -> float:
    """The correlation of two people's displacements."""
    return float((a * b).sum() / np.sqrt((a * a).sum() * (b * b).sum()))


# --- what is drawn --------------------------------------------------------------------------------


def test_a_seed_gives_the_same_creases_and_another_others(rig):
    assert drawn(1) == drawn(1)
    assert drawn(1) != drawn(2)
    first, again, other = (raised(rig, drawn(k)) for k in (1, 1, 2))
    assert np.array_equal(first, again)
    assert np.abs(first - other).max() > 1 * MM


def test_people_are_not_recognised_by_their_creases(rig):
    """How like two people's creases are; with one set for everybody it is 1."""
    people = [raised(rig, drawn(k)) for k in range(12)]
    pairs = [likeness(a, b) for k, a in enumerate(people) for b in people[:k]]
    assert np.mean(pairs) < 0.6
    assert np.max(pairs) < 0.9


def test_left_is_not_like_right(rig):
    """But the default person's left is."""

    def sides(who):
        whole = [k for k, name in enumerate(CREASED) if not name.endswith(("_left", "_right"))]
        both = np.zeros((len(whole), rig.n_vertices, 3), np.float32)
        both[:, rig.motions.skin_at] = raised(rig, who)[whole]
        return likeness(both, both[:, rig.mirror] * np.float32([-1, 1, 1]))

    assert sides({}) > 0.999
    assert np.mean([sides(drawn(k)) for k in range(8)]) < 0.9


def test_drawn_creases_are_what_an_identity_may_have():
    for k in range(200):
        who = drawn(k, share=(k % 3) / 2)
        assert set(who) <= set(PARAMETERS)
        check_identity(who)
        weights = np.array(list(groove_weights(who).values()))
        assert np.isfinite(weights).all() and len(weights) == len(GROOVES)
        assert -1 <= weights.min() and weights.max() <= DEEPEST


def test_share_is_how_many_families_crease_at_all():
    def share_of(share):
        return np.mean([drawn(k, share)[f"{f}_depth"] > -1 for k in range(200) for f in FAMILIES])

    assert share_of(0.0) == 0.0
    assert share_of(0.5) == pytest.approx(0.5, abs=0.05)
    assert share_of(1.0) == 1.0


def test_depths_run_from_hardly_any_to_deep():
    depths = [drawn(k)[f"{family}_depth"] for k in range(100) for family in FAMILIES]
    assert np.quantile(depths, 0.1) < -0.5
    assert np.quantile(depths, 0.9) > 0.5


# --- what they do ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CREASED)
def test_without_any_crease_the_face_is_as_smooth_as_without_wrinkles(rig, name):
    who = {**drawn(5), **NONE}
    without = rig.pose(FaceParameters({name: 5.0}, who))
    assert np.abs(without - rig.pose(FaceParameters({name: 5.0}, {"wrinkles": -1.0}))).max() < 4e-5
    assert np.abs(without - rig.pose(FaceParameters({name: 5.0}))).max() > 0.3 * MM


def test_the_default_person_is_as_the_keys_are(rig):
    assert groove_weights({}) == {}
    assert rig.key_deltas_of({name: 0.0 for name in PARAMETERS}) is rig.key_deltas
    # That its lines add up to its keys is what the tests of a face without creases say.
    plain = folds._amounts((0.0,) * len(PARAMETERS), 1.0)
    assert np.array_equal(plain, np.broadcast_to(folds._DEFAULT, plain.shape))


@pytest.mark.parametrize("family", FAMILIES)
def test_a_family_deepens_with_its_depth_and_leaves_the_others(rig, family):
    own = [
        any(group in FAMILIES[family][1] for group in control.creases)
        for control in CONTROLS
        if control.creases
    ]
    faces = [raised(rig, {f"{family}_depth": d}) for d in (-1.0, -0.5, 0.0, 0.5, 1.0)]
    for low, high in zip(faces[:-1], faces[1:], strict=True):
        deep, deeper = ((face[own] ** 2).sum((1, 2)) for face in (low, high))
        assert (deeper > 1.02 * deep).all()
        assert np.abs(high - low)[~np.array(own)].max() < 1e-6


@pytest.mark.parametrize("trait", ["number", "place", "length", "branching", "skew"])
@pytest.mark.parametrize("family", FAMILIES)
def test_every_parameter_changes_the_skin_a_little_at_a_time(rig, family, trait):
    steps = np.linspace(-1, 1, 17)
    faces = np.stack([raised(rig, {f"{family}_{trait}": float(x)}) for x in steps])
    most = np.abs(faces).max()
    assert np.abs(faces[0] - faces[-1]).max() > 0.2 * MM
    assert np.abs(np.diff(faces, axis=0)).max() < 0.7 * most


def test_skew_makes_the_left_deeper(rig):
    face = raised(rig, {f"{family}_skew": 1.0 for family in FAMILIES})
    x = rig.neutral()[rig.motions.skin_at, 0]
    left, right = x > 0.01, x < -0.01
    assert (face[:, left] ** 2).sum() > 4 * (face[:, right] ** 2).sum()


def test_one_sided_creases_add_up_to_those_of_both_sides(rig):
    names = [key.name for key in rig.keys if key.name.endswith("_creases")]
    keys = raised(rig, drawn(3))
    for control in CONTROLS:
        stem, _, side = control.name.rpartition("_")
        if control.creases and side == "left":
            both, left, right = (
                keys[names.index(f"{name}_creases")]
                for name in (stem, f"{stem}_left", f"{stem}_right")
            )
            assert np.abs(left + right - both).max() < 1e-5


def test_nothing_is_deeper_than_age_and_wrinkles_made_it_before(rig):
    """However deep a person's own creases are."""
    most = {f"{family}_depth": 1.0 for family in FAMILIES} | {"crease_seed": 7.0}
    old = {"age": 1.0, "wrinkles": 1.0}
    for who in (most, most | old):
        gain = crease_gain(who)
        amounts = gain * (np.array(list(groove_weights(who).values())) + 1)
        assert amounts.max() < DEEPEST + gain + 1e-6
    assert np.abs(raised(rig, most | old)).max() < 6 * MM


def test_how_deep_single_lines_are_is_known_by_name():
    """As dataset_gen.conventions, which draws them, asks."""
    plain = folds.line_depths({})
    assert len(plain) == 2 * sum(map(len, CREASES.values())) and set(plain.values()) == {1.0}
    assert set(folds.line_depths({**drawn(4), **NONE}).values()) == {0.0}
    few = folds.line_depths({"worry_number": -1.0, "crow_skew": 0.5})
    assert few["worry_1_left"] == 1.0 and few["worry_3_left"] == 0.0
    assert few["crow_up_0_left"] > 1 > few["crow_up_0_right"]


# --- folds at rest --------------------------------------------------------------------------------


def test_folds_at_rest_need_age(rig):
    names = tuple(folds.REST_FOLDS)
    for known in ({}, {"age": 0.3}, {"age": -1.0}, {"age": 1.0, "age_shows": 0.0}):
        assert not any(folds.REST_FOLDS[name](known) for name in names)
    growing = [[folds.REST_FOLDS[name]({"age": a}) for name in names]
               for a in (0.4, 0.7, 1.0)]  # fmt: skip
    assert (np.diff(growing, axis=0) > 0).all()
    bare = {"age": 1.0, "wrinkles": -1.0}
    assert not any(folds.REST_FOLDS[name](bare) for name in names)


def test_old_faces_without_it_have_none(rig):
    """Whose age does not show: faces of files of before."""
    at = len(rig.identity_deltas) - len(folds.REST_FOLDS)
    assert np.abs(rig.identity_deltas[at:]).max() > 0.3 * MM
    old = {"age": 1.0, "age_shows": 0.0}
    assert np.abs(rig.neutral(old) - rig.neutral({**old, "wrinkles": -1.0})).max() == 0
    shown = rig.neutral({"age": 1.0}) - rig.neutral({"age": 1.0, "wrinkles": -1.0})
    assert 0.3 * MM < np.abs(shown).max() < 3 * MM


# --- the table ------------------------------------------------------------------------------------


def test_every_groove_is_in_the_asset_for_every_control_that_raises_it(rig):
    found = set(zip(rig.motions.variant_names, (rig.keys[k].name for k in rig.motions.parents),
                    strict=True))  # fmt: skip
    for control in CONTROLS:
        sides = ("left", "right") if control.side == "both" else (control.side,)
        wanted = {
            (f"{name} {side}", f"{control.name}_creases")
            for group in control.creases
            for name, *_ in names_of(group)
            for side in sides
        }
        assert wanted <= found


def test_groups_and_parameters_are_complete():
    grouped = [group for _, groups in FAMILIES.values() for group in groups]
    assert sorted(grouped) == sorted(LINES) == sorted(CREASES)
    known = {feature.name: feature for feature in IDENTITY}
    assert set(PARAMETERS) <= set(known)
    assert all(known[name].default == 0 for name in PARAMETERS)


def test_a_line_is_only_what_it_may_be():
    line = LINES["lip_radial"][-1]
    with pytest.raises(ValueError, match="branched"):
        grooves(line, "branched")
    for lines in LINES.values():
        for line in lines:
            assert grooves(line, PLAIN) == (line.crease,)
            for way in line.ways:
                assert way in WAYS
                assert grooves(line, way) != (line.crease,)
