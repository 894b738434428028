"""People who fold and act in their own way: variants of keys, details of the skin, growth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from facs_rig import FaceParameters, variants
from facs_rig.derivatives import surface_points
from facs_rig.identity import CAGE_TARGETS, target_weights
from facs_rig.moves import FINEST, dense, packed
from facs_rig.rig import ASSET, FaceRig

FACE = FaceParameters({"smile": 4.0, "frontalis": 5.0, "blink": 2.0}, {"age": 0.4, "gender": 0.8})


def with_variants(rows: list[tuple[str, str]], seed: int = 0) -> FaceRig:
    """The rig with random variants of keys, (name, the key's name) each, instead of its own."""
    with np.load(ASSET) as shipped:
        rig = FaceRig(dict(shipped))
    names = [key.name for key in rig.keys]
    parents = np.array([names.index(parent) for _, parent in rows])
    rng = np.random.default_rng(seed)
    m = rig.motions
    on_cage = int((parents < m.split).sum())

    def some(count: int, width: int, used: int) -> sp.csr_matrix:
        rows = rng.normal(0, 1e-3, (count, width)) * (rng.random((count, width)) < 0.1)
        rows[:, used:] = 0  # joints stay where the identity puts them
        return sp.csr_matrix(rows, dtype=np.float32)

    rig.motions = replace(
        m,
        parents=parents,
        variant_names=tuple(name for name, _ in rows),
        cage_variants=some(on_cage, m.cage_keys.shape[1], 3 * rig._m),
        skin_variants=some(len(rows) - on_cage, *[m.skin_keys.shape[1]] * 2),
    )
    return rig


ROWS = [("broad", "smile"), ("crooked", "smile"), ("heavy", "blink"), ("deep", "frontalis_creases"),
        ("twice", "smile_creases")]  # fmt: skip


@pytest.fixture(scope="module")
def rig():
    return with_variants(ROWS)


@pytest.fixture
def kinds(monkeypatch):
    """What of ROWS the person of FACE has; nobody else has any."""
    kinds = {"broad": 0.7, "crooked": -0.4, "deep": 1.5, "twice": -1.0}
    monkeypatch.setattr(variants, "SOURCES", (lambda who: kinds if "age" in who else {},))
    return kinds


def test_a_persons_keys_are_the_mean_ones_and_what_is_his_of_their_variants(kinds, rig):
    own, mean = rig.key_deltas_of(FACE.identity), rig.key_deltas
    names = [key.name for key in rig.keys]
    cage = rig.motions.cage_variants.toarray().reshape(3, -1, 3)[:, : rig._m]
    wanted = rig._refined(np.ascontiguousarray(0.7 * cage[:1] - 0.4 * cage[1:2]))[0]
    smile = names.index("smile")
    np.testing.assert_allclose(own[smile] - mean[smile], wanted, atol=1e-6)
    folds = names.index("smile_creases")
    u = rig.motions.skin_variants[1].toarray().reshape(-1, 3)
    np.testing.assert_allclose((own - mean)[folds, rig.motions.skin_at], -u, atol=1e-6)
    others = [k for k, name in enumerate(names) if name not in ("smile", "smile_creases",
                                                                "frontalis_creases")]  # fmt: skip
    np.testing.assert_array_equal(own[others], mean[others])
    assert rig.key_deltas_of({"gender": 0.8}) is mean


def test_every_way_to_pose_uses_the_persons_own_keys(kinds, rig):
    wanted = rig.neutral(FACE.identity) + np.tensordot(
        rig.key_values(FACE), rig.key_deltas_of(FACE.identity), axes=1
    )
    default = rig.neutral(FACE.identity) + np.tensordot(
        rig.key_values(FACE), rig.key_deltas, axes=1
    )
    assert np.abs(wanted - default).max() > 1e-3
    other = FaceParameters(FACE.aus, {"gender": 0.8})
    np.testing.assert_allclose(rig.shape(FACE), wanted, atol=1e-6)
    np.testing.assert_allclose(rig.pose(FACE), wanted, atol=1e-6)
    batch = rig.pose_batch([FACE, other, FACE])
    np.testing.assert_allclose(batch[0], wanted, atol=1e-6)
    np.testing.assert_allclose(batch[1], rig.pose(other), atol=1e-6)
    moved = rig.moves([(FaceParameters({}, FACE.identity), FACE)])[0]
    np.testing.assert_allclose(moved, wanted - rig.neutral(FACE.identity), atol=1e-6)
    matrix, cage, *_ = rig.linear_parts(FACE.identity)
    smooth = replace(FACE, identity={**FACE.identity, "wrinkles": -1.0})
    own = target_weights(smooth.identity)[CAGE_TARGETS:]  # on the skin, such as brows
    np.testing.assert_allclose(
        matrix @ rig.cage(smooth) + np.tensordot(own, rig.identity_deltas[CAGE_TARGETS:], axes=1),
        rig.shape(smooth),
        atol=1e-6,
    )


def test_points_of_the_surface_move_by_the_persons_own_keys(kinds, rig):
    at = np.arange(0, rig.n_vertices, 500)
    points = surface_points(rig, at[:, None], np.ones((len(at), 1)), FACE.identity)
    np.testing.assert_allclose(points.keys, rig.key_deltas_of(FACE.identity)[:, at], atol=1e-6)
    mean = surface_points(rig, at[:, None], np.ones((len(at), 1)))
    np.testing.assert_allclose(mean.keys, rig.key_deltas[:, at], atol=1e-6)
    np.testing.assert_allclose(mean.identity, rig.identity_deltas[:, at], atol=1e-6)


def test_packed_movements_come_back_to_half_a_step():
    rng = np.random.default_rng(1)
    stack = rng.normal(0, 1, (3, 40, 3)) * np.array([1e-4, 1e-2, 0.3])[:, None, None]
    stack[1, 5:] = 0
    arrays = packed("some", np.concatenate([stack, 0 * stack[:1]]))
    assert arrays["some_delta"].dtype == np.int16
    steps = arrays["some_step"]
    assert steps[0] == steps[3] == FINEST and (np.log2(steps) % 1 == 0).all()
    back = dense(arrays, "some", 40).reshape(4, 40, 3)
    for row, step, found in zip(stack, steps, back, strict=False):
        assert np.abs(row - found).max() <= step / 2 * (1 + 1e-6)
    assert not back[3].any() and len(dense(packed("no", np.zeros((0, 40, 3))), "no", 40)) == 0
