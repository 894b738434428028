"""What of a fitted face stays at rest, held against the covariances written out."""

from __future__ import annotations

import numpy as np
import pytest

from facs_rig import LANDMARKS, FaceParameters, load_rig
from facs_rig.fitted_keys import FITTED_REGIONS, offsets_at
from snakes.at_rest import ALIKE, SIZE, _at_rest, expression_keys
from snakes.parts import carry_parts, eyeballs, keep_lids_on_eyes

SYMMETRY = 0.8


@pytest.fixture(scope="module")
def rig():
    return load_rig()


def pulled(rig, face: FaceParameters, at: str, by=(0.0, 0.003, 0.001)) -> np.ndarray:
    """Offsets as a fit makes them: the skin within some centimetres of a landmark moves."""
    shape = rig.shape(face)
    away = np.linalg.norm(shape - shape[rig.landmarks[LANDMARKS.index(at)]], axis=1)
    skin = np.exp(-((away / 0.015) ** 2))[:, None] * np.array(by)
    offsets = keep_lids_on_eyes(rig, shape, carry_parts(rig, shape, skin))
    return offsets.astype(np.float32)


def crooked(rig, points: np.ndarray) -> float:
    """Millimetres between a face and its mirror image, over the skin."""
    skin = rig.parts["skin"]
    return 1e3 * np.linalg.norm((points - points[rig.mirror] * (-1, 1, 1))[skin], axis=1).mean()


@pytest.mark.parametrize("symmetry", [0.0, 0.5, 0.8, 1.0])
def test_the_split_is_that_of_two_gaussians(rig, symmetry):
    rng = np.random.default_rng(3)
    offsets = rng.normal(0, 0.003, (rig.n_vertices, 3))
    shown = rng.uniform(0, 4e-5, rig.n_vertices) * (rng.random(rig.n_vertices) < 0.7)
    found = _at_rest(rig, offsets, shown, symmetry)
    rho = min(symmetry, ALIKE)
    for k in rng.choice(rig.n_vertices, 40, replace=False):
        pair = [k, rig.mirror[k]]
        if pair[0] == pair[1]:  # in the middle, its own mirror image
            continue
        rest = SIZE**2 * np.array([[1, rho], [rho, 1]])
        both = np.stack([offsets[k], offsets[pair[1]] * (-1, 1, 1)])
        wanted = rest @ np.linalg.solve(rest + np.diag(shown[pair]), both)
        assert found[k] == pytest.approx(wanted[0], abs=1e-9)


def test_without_expression_all_stays(rig):
    rest = FaceParameters()
    assert expression_keys(rig, rest, pulled(rig, rest, "mouth_corner_left"), SYMMETRY) == ()
    smiling = FaceParameters({"smile": 5.0})
    nothing = np.zeros((rig.n_vertices, 3), np.float32)
    assert expression_keys(rig, smiling, nothing, SYMMETRY) == ()


def test_what_no_action_moves_stays(rig):
    smiling = FaceParameters({"smile": 5.0})
    offsets = pulled(rig, smiling, "forehead")
    rest = offsets_at(offsets, expression_keys(rig, smiling, offsets, SYMMETRY), {})
    assert np.abs(rest - offsets).max() < 3e-4


def test_a_crooked_smile_is_less_crooked_at_rest(rig):
    smiling = FaceParameters({"smile": 5.0})
    offsets = pulled(rig, smiling, "mouth_corner_left")
    keys = expression_keys(rig, smiling, offsets, SYMMETRY)
    assert [key.name for key in keys] == [FITTED_REGIONS["lower"]]
    assert keys[0].shares == {"smile": 1.0} and keys[0].drawn == {"smile": 5.0}
    at_rest = rig.shape(FaceParameters(), offsets_at(offsets, keys, {}))
    assert crooked(rig, at_rest) < 0.5 * crooked(rig, rig.shape(FaceParameters(), offsets))
    assert np.allclose(offsets_at(offsets, keys, smiling.aus), offsets, atol=1e-7)


def test_mirrored_drawings_split_alike(rig):
    face = FaceParameters({"smile_left": 4.0, "brow_furrow": 3.0})
    turned = FaceParameters({"smile_right": 4.0, "brow_furrow": 3.0})
    offsets = pulled(rig, face, "mouth_corner_left")
    mirrored = (offsets * (-1, 1, 1))[rig.mirror].astype(np.float32)
    a = offsets_at(offsets, expression_keys(rig, face, offsets, SYMMETRY), {})
    b = offsets_at(mirrored, expression_keys(rig, turned, mirrored, SYMMETRY), {})
    assert np.abs((a * (-1, 1, 1))[rig.mirror] - b).max() < 2e-5


def test_each_region_takes_its_own(rig):
    face = FaceParameters({"smile": 5.0, "brow_furrow": 4.0, "wince": 3.0})
    offsets = pulled(rig, face, "mouth_corner_left") + pulled(rig, face, "brow_inner_left")
    keys = {key.name: key for key in expression_keys(rig, face, offsets, SYMMETRY)}
    assert set(keys[FITTED_REGIONS["lower"]].shares) == {"smile"}
    assert set(keys[FITTED_REGIONS["upper"]].shares) == {"brow_furrow"}
    height = rig.neutral()[:, 1]
    for name, above in ((FITTED_REGIONS["upper"], True), (FITTED_REGIONS["lower"], False)):
        far = np.argmax(np.linalg.norm(keys[name].offsets, axis=1))
        assert (height[far] > height[rig.landmarks[LANDMARKS.index("nose_tip")]]) == above


def test_eyeballs_stay_where_they_are(rig):
    face = FaceParameters({"blink": 5.0, "frontalis": 5.0})
    offsets = pulled(rig, face, "eye_outer_left")
    for key in expression_keys(rig, face, offsets, SYMMETRY):
        for eye in eyeballs(rig):
            assert not key.offsets[eye].any()
