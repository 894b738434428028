"""Who is drawn by the scheme `people`, and that the older schemes draw whom they drew."""

from __future__ import annotations

import numpy as np
import pytest

from dataset_gen import population
from dataset_gen.conventions import sample_artist
from dataset_gen.population import CHILDREN, OWN_WAYS, STYLISED, sample_person
from dataset_gen.sampling import DEFAULT, SCHEMES, sample_face, sample_rng
from facs_rig import load_rig
from facs_rig.actions import TABLE
from facs_rig.folds import FAMILIES
from facs_rig.identity import ASYMMETRY, EARLIER, FEATURES, check_identity
from facs_rig.macros import years
from facs_rig.stylised import is_stylised

COUNT = 900


@pytest.fixture(scope="module")
def people():
    return [sample_person(sample_rng(21, k)) for k in range(COUNT)]


def share(chosen) -> float:
    return float(np.mean(list(chosen)))


def column(people, name):
    return np.array([who.get(name, 0.0) for who in people])


def creased(who):
    """The groups of creases that somebody has."""
    if who["wrinkles"] == -1:
        return set()
    return {family for family in FAMILIES if who.get(f"{family}_depth", 0.0) > -1}


def test_everybody_can_be(people):
    for who in people:
        check_identity(who)
        assert all(value == round(value, 4) for value in who.values())


def test_shares_of_creases_ways_and_styles(people):
    """Odds of a third are met by 0.333 ± 0.016, one standard deviation, in 900."""
    groups = np.array([len(creased(who)) for who in people])
    assert share(groups == 0) == pytest.approx(1 / 3, abs=0.06)
    assert share((groups > 0) & (groups < len(FAMILIES))) == pytest.approx(1 / 3, abs=0.06)
    own = share(any(name in who for name in TABLE) for who in people)
    assert own == pytest.approx(OWN_WAYS, abs=0.05)
    assert share(is_stylised(who) for who in people) == pytest.approx(STYLISED, abs=0.05)


def test_ages_are_even_but_for_children(people):
    ages = np.array([years(who["age"]) for who in people if not is_stylised(who)])
    assert ages.min() < 8
    assert ages.max() > 87
    assert share(ages < 18) == pytest.approx(CHILDREN, abs=0.06)
    thirds = np.histogram(ages, (18, 42, 66, 90))[0] / (ages >= 18).sum()
    np.testing.assert_allclose(thirds, 1 / 3, atol=0.07)


def test_what_belongs_together_varies_together(people):
    human = [who for who in people if not is_stylised(who)]
    for one, other, least in (
        ("upper_lip", "lower_lip", 0.3),
        ("nose_length", "nose_depth", 0.25),
        ("weight", "cheek_volume", 0.2),
        ("gender", "brow_depth", 0.2),
    ):
        found = np.corrcoef(column(human, one), column(human, other))[0, 1]
        assert found > least, (one, other)
    apart = np.corrcoef(column(human, "nose_length"), column(human, "lower_lip"))[0, 1]
    assert abs(apart) < 0.12
    plain = share(not who.get(f.name) for who in human for f in FEATURES)
    assert 0.2 < plain < 0.5


def test_left_is_a_little_unlike_right(people):
    unlike = np.array([[who.get(f.name, 0.0) for f in ASYMMETRY] for who in people])
    assert 0.1 < unlike.std() < 0.4
    assert abs(unlike.mean()) < 0.03


def test_the_same_seed_gives_the_same_person_and_parts_do_not_disturb_each_other(monkeypatch):
    def of(k):
        return sample_person(sample_rng(4, k))

    once = [of(k) for k in range(30)]
    assert once == [of(k) for k in range(30)]
    monkeypatch.setattr(population, "drawn_actions", lambda rng: {"smile_action_1": 1.0})
    for one, other in zip(once, [of(k) for k in range(30)], strict=True):
        others = [{n: v for n, v in who.items() if n not in TABLE} for who in (one, other)]
        assert others[0] == others[1]
    assert any(of(k).get("smile_action_1") == 1.0 for k in range(30))


def test_people_is_what_is_meant_where_nothing_is_said():
    rig = load_rig()
    assert SCHEMES[0] == DEFAULT == "people"
    one, other = (sample_face(rig, sample_rng(2, 1), 64, *scheme) for scheme in ((), ("people",)))
    assert one == other
    # the actions are those of sparse: one scheme can be compared with the other
    older = sample_face(rig, sample_rng(2, 1), 64, "sparse")
    assert one.parameters.aus == older.parameters.aus
    assert one.parameters.head == older.parameters.head


# The fifth sample of seed 11 as it has always been: actions, some parameters, the head's angles.
SPARSE = (
    {"outer_squint": 1.831, "smile": 3.929, "cheek_suck": 4.613, "brow_furrow": 5.696},
    {"gender": 0.1605, "age": 0.0063, "weight": 0.6225, "african": 0.7461, "head_shape": 0.2165,
     "forehead_height": 0.233, "eye_spacing": -0.6276, "eye_inner_corner": -0.7938},
    [-23.77, 3.32, 2.86],
)  # fmt: skip


@pytest.mark.parametrize("scheme", ["sparse", "smooth", "varied"])
def test_the_older_schemes_draw_whom_they_drew(scheme):
    """The detector's floors are measured on them."""
    drawn = sample_face(load_rig(), sample_rng(11, 4), 64, scheme).parameters
    aus, identity, head = SPARSE
    assert {name: round(value, 3) for name, value in drawn.aus.items()} == aus
    assert {name: drawn.identity[name] for name in identity} == identity
    assert np.degrees(drawn.head).round(2).tolist() == head
    assert {name: drawn.identity[name] for name in EARLIER} == EARLIER
    assert set(drawn.identity) <= {
        "gender", "age", "weight", "african", "asian", "caucasian", "wrinkles", *EARLIER,
        *(f.name for f in FEATURES),
    }  # fmt: skip


def test_every_head_is_on_its_page():
    """Children and stylised people, too. The page may cut 2 % of its side: it is shifted by lot."""
    rig = load_rig()
    size, outside = 256, []
    for k in range(40):
        drawn = sample_face(rig, sample_rng(8, k), size)
        places = drawn.camera.project(rig.pose(drawn.parameters))
        assert np.isfinite(places).all()
        head = places[rig.weights[:, 0] > 0.99]
        outside += [-head.min(), head.max() - size]
        side = (head.max(axis=0) - head.min(axis=0)).max()
        assert side > 0.55 * size
    assert max(outside) < 0.02 * size


def test_children_have_no_beards():
    bearded = {}
    for age in (-1.0, -0.6, 0.3):
        artists = [
            sample_artist(np.random.default_rng(k), {"gender": 1.0, "age": age}) for k in range(150)
        ]
        hairy = [a for a in artists if (a.beard, a.moustache) != ("none", "none")]
        bearded[age] = len(hairy)
        assert all(a.cut for a in artists)
    assert bearded[-1.0] == bearded[-0.6] == 0
    assert bearded[0.3] > 20
