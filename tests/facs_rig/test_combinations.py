"""Combinations stay sane: no skin that a viewer would notice is turned over or runs through other.

Every control alone, and random faces of ten controls each, on the default face, on people who do
all of it in ways of their own, and on random people who look about. The bars stand a little above
what is measured (the figures are in the comments), so that a face that gets worse fails; lower them
when it gets better.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dataset_gen.sampling import sample_identity
from facs_rig import CONTROL_NAMES, LANDMARKS, Camera, FaceParameters, rasterise
from facs_rig.actions import drawn_actions
from facs_rig.identity import EARLIER

MM = 1e-3
STRENGTHS = (2.5, 5.0, 10.0)
FACES = 60


@pytest.fixture(scope="module")
def groups(sanity):
    """Name -> parameters of the faces that are measured; the same in every run."""
    # right sides mirror left ones
    alone = [n for n in CONTROL_NAMES if not n.endswith("_right") or n == "jaw_right"]
    out = {f"alone at {x:g}": [FaceParameters({name: x}) for name in alone] for x in STRENGTHS}
    out["ten"] = [
        FaceParameters(sanity.random_expression(np.random.default_rng([3, k])))
        for k in range(FACES)
    ]
    out["ten, own ways"] = [
        replace(p, identity=drawn_actions(np.random.default_rng([5, k])))
        for k, p in enumerate(out["ten"])
    ]
    out["ten, anyone"] = [anyone(sanity, np.random.default_rng([4, k])) for k in range(FACES)]
    return out


def anyone(sanity, rng):
    aus = sanity.random_expression(rng)
    who = {**sample_identity(rng), **EARLIER}  # people of today: see test_people
    yaw, pitch = np.radians(np.clip(rng.normal(0, (12, 7)), -35, 25))
    return FaceParameters(aus, who, gaze=(float(yaw), float(pitch)))


@pytest.fixture(scope="module")
def measured(groups, rig, surface):
    """Group -> list of (folded, collapsed) of each face."""

    def measure(parameters):
        vertices, rest = rig.pose(parameters), rig.neutral(parameters.identity)
        return len(surface.folded(vertices, rest)), len(surface.collapsed(vertices, rest))

    return {name: np.array([measure(p) for p in faces]) for name, faces in groups.items()}


@pytest.fixture(scope="module")
def crossed(groups, rig, surface):
    """Group -> what `depths` says of each face."""
    pytest.importorskip("bpy")

    def measure(parameters):
        return depths(surface, rig.pose(parameters), rig.neutral(parameters.identity))

    return {name: np.array([measure(p) for p in faces]) for name, faces in groups.items()}


def depths(surface, vertices, rest):
    """Lips, lids and balls in millimetres, and the swallowed skin of lips in square millimetres."""
    lips, lids = surface.lip_depth(vertices)[1], surface.lid_depth(vertices)[1]
    balls = surface.ball_depth(vertices, rest)
    return np.array([lips / MM, lids / MM, balls / MM, surface.swallowed(vertices) / MM**2])


# Measured: none at 2.5; 2 at 5, of pucker; 77 in all and 23 at most at 10, of smile; ten at once
# 0.35 in the mean and 5 at most, in own ways 0.6 and 16; of random people 1.1 and 11.
@pytest.mark.parametrize(
    ("group", "mean", "most"),
    [("alone at 2.5", 0, 0), ("alone at 5", 0.2, 4), ("alone at 10", 3.6, 27),
     ("ten", 3.2, 39), ("ten, own ways", 3.2, 39), ("ten, anyone", 6.0, 77)],
)  # fmt: skip
def test_skin_does_not_fold_over(measured, group, mean, most):
    """Triangles, of 55,000 seen ones."""
    folded = measured[group][:, 0]
    assert folded.mean() <= mean
    assert folded.max() <= most


# Measured: none up to 5; 6 at 10, at most 4; ten at once 3, all in one face, under an eye; in own
# ways none; of random people 2.
@pytest.mark.parametrize(
    ("group", "total", "most"),
    [("alone at 2.5", 0, 0), ("alone at 5", 0, 0), ("alone at 10", 13, 6),
     ("ten", 3, 2), ("ten, own ways", 15, 9), ("ten, anyone", 7, 4)],
)  # fmt: skip
def test_skin_does_not_collapse(sanity, measured, group, total, most):
    collapsed = measured[group][:, 1]
    missed = (0, 3) if group == "ten" else (0, 0)  # since smiles raise the cheeks
    sanity.held((collapsed.sum(), collapsed.max()), (total, most), missed)


# Measured, of 150,000 pixels of face: ten at once none; of random people 32, all in one face.
@pytest.mark.parametrize(
    ("group", "total"), [("ten", 5), ("ten, own ways", 5), ("ten, anyone", 42)]
)
def test_the_inside_of_the_skin_is_not_seen(groups, rig, surface, group, total):
    """Pixels of pictures from the front that show skin from behind; every second face."""
    assert sum(surface.backs(rig.pose(parameters)) for parameters in groups[group][::2]) <= total


# Measured, of pictures 1400 pixels high: none of the default face, 18 of eight random people.
def test_a_closed_mouth_shows_neither_teeth_nor_tongue(groups, sanity, rig):
    inside = np.isin(rig.triangle_part, [rig.part_names.index(n) for n in ("teeth", "tongue")])
    mouth = np.unique(rig.triangles[inside])

    def seen(identity):
        vertices = rig.neutral(identity)
        camera = sanity.window(Camera.framing(vertices, 1400, 1400), vertices[mouth])
        owner = rasterise(vertices, rig.triangles, camera).triangle
        return int(inside[owner[owner >= 0]].sum())

    assert seen({}) == 0
    assert sum(seen(p.identity) for p in groups["ten, anyone"][:8]) < 30


# How deep skin goes into other skin, in millimetres. Lips that are rolled in or pressed together
# touch well inside the mouth; what counts is the mean, and that nothing gets deeper.
# Measured, mean and most: at 2.5 0.06 and 0.79, at 5 0.09 and 1.3, at 10 0.22 and 3.0 (all three
# lip_tighten); ten at once 0.50 and 3.4; of random people 0.34 and 2.1.
@pytest.mark.parametrize(
    ("group", "mean", "most"),
    [("alone at 2.5", 0.1, 1.2), ("alone at 5", 0.19, 1.7), ("alone at 10", 0.39, 3.6),
     ("ten", 0.58, 3.6), ("ten, own ways", 0.58, 3.6), ("ten, anyone", 0.34, 2.8)],
)  # fmt: skip
def test_lips_do_not_pass_through_each_other(crossed, group, mean, most):
    lips = crossed[group][:, 0]
    assert lips.mean() < mean
    assert lips.max() < most


# Square millimetres of one lip that are inside the other, of 2,000 that are seen at rest. Measured:
# 4.2 in the mean at 2.5, 16 at 5, 33 at 10 (a rolled-in lip alone 92, 269, 348); ten at once 32
# and 193 at most; of random people 31 and 480.
@pytest.mark.parametrize(
    ("group", "mean", "most"),
    [("alone at 2.5", 12, 145), ("alone at 5", 29, 380), ("alone at 10", 50, 480),
     ("ten", 53, 290), ("ten, own ways", 53, 290), ("ten, anyone", 43, 580)],
)  # fmt: skip
def test_lips_do_not_swallow_each_other(crossed, group, mean, most):
    swallowed = crossed[group][:, 3]
    assert swallowed.mean() < mean
    assert swallowed.max() < most


# Measured: none at 2.5; 0.43 closed (blink), 0.55 at 10; ten at once 0.55; of random people 0.87.
@pytest.mark.parametrize(
    ("group", "most"),
    [("alone at 2.5", 0), ("alone at 5", 0.52), ("alone at 10", 0.66), ("ten", 0.66),
     ("ten, own ways", 0.66), ("ten, anyone", 1.05)],
)  # fmt: skip
def test_lids_do_not_pass_through_each_other(crossed, group, most):
    """Millimetres that the upper goes into the lower: a closed eye's edges overlap."""
    assert crossed[group][:, 1].max() <= most


# Measured: 0.07 at 2.5, 0.16 at 5 and 0.15 at 10 (blink); ten at once 0.07 in the mean and 0.16
# at most; of random people who look about 0.08 and 0.41.
@pytest.mark.parametrize(
    ("group", "mean", "most"),
    [("alone at 2.5", 0.01, 0.09), ("alone at 5", 0.018, 0.2), ("alone at 10", 0.02, 0.2),
     ("ten", 0.085, 0.2), ("ten, own ways", 0.085, 0.2), ("ten, anyone", 0.1, 0.5)],
)  # fmt: skip
def test_lids_do_not_cut_the_eyeballs(crossed, group, mean, most):
    """Millimetres that the skin of lids is deeper in its ball than at rest."""
    balls = crossed[group][:, 2]
    assert balls.mean() < mean
    assert balls.max() < most


def test_at_rest_nothing_passes_through_anything(rig, surface):
    pytest.importorskip("bpy")
    rest = rig.neutral()
    assert surface.lip_depth(rest)[0] == 0
    assert surface.lid_depth(rest)[0] == 0


# --- the measures and the bars can fail ---

CLOSING = (
    {"shrug": 5.0, "pucker": 5.0}, {"purse": 5.0}, {"smile": 5.0, "shrug": 5.0},
    {"shrug": 5.0, "purse": 5.0, "lip_lock": 5.0},
)  # fmt: skip


def without(rig, parameters, names):
    """The upright face with the keys whose names start so, or with one of these, at zero."""
    values = rig.key_values(parameters)
    away = [k for k, key in enumerate(rig.keys) if key.name.startswith(names)]
    assert away
    return rig.shape(parameters) - np.tensordot(values[away], rig.key_deltas[away], axes=1)


def test_without_their_helper_keys_lips_are_worse(rig, surface):
    """Measured, mm² that lips swallow: 37 with the keys that part them, 290 without."""
    pytest.importorskip("bpy")
    faces = [FaceParameters(aus) for aus in CLOSING]
    with_keys = sum(surface.swallowed(rig.pose(p)) for p in faces) / MM**2
    bare = sum(surface.swallowed(without(rig, p, "lips_apart")) for p in faces) / MM**2
    assert with_keys < 85
    assert bare > 3 * 85


def test_without_their_arcs_lids_cut_the_eyeballs(rig, surface):
    """Measured: 0.07 mm with the arcs, 0.31 on straight lines."""
    pytest.importorskip("bpy")
    rest, half = rig.neutral(), FaceParameters({"blink": 2.5})
    arcs = tuple(key.name for key in rig.keys if key.name.endswith("_arc"))
    assert surface.ball_depth(rig.shape(half), rest) < 0.1 * MM
    assert surface.ball_depth(without(rig, half, arcs), rest) > 0.2 * MM


def test_lids_that_do_not_stop_pass_through_each_other(rig, surface):
    """Lids that go on by a third of their way. Measured: 1.27 mm."""
    pytest.importorskip("bpy")
    keys = [k for k, key in enumerate(rig.keys) if key.name.startswith("lid_upper")]
    closed = FaceParameters({"blink": 5.0})
    values = rig.key_values(closed)[keys]
    further = rig.shape(closed) + np.tensordot(values / 3, rig.key_deltas[keys], axes=1)
    assert surface.lid_depth(further)[1] > 1.05 * MM


def test_folds_collapses_and_insides_are_counted(rig, surface):
    """The tip of the nose turned inside out, and shrunk."""
    rest = rig.neutral()
    tip = rest[rig.landmarks[LANDMARKS.index("nose_tip")]]
    near = rig.parts["skin"] & (np.linalg.norm(rest - tip, axis=1) < 4 * MM)
    turned, shrunk = rest.copy(), rest.copy()
    turned[near] = tip + (rest[near] - tip) * [-1, 1, 1]
    shrunk[near] = tip + 0.01 * (rest[near] - tip)
    assert len(surface.folded(turned, rest)) > 30
    assert surface.backs(turned) > 50
    assert len(surface.collapsed(shrunk, rest)) > 30
    assert not len(surface.folded(rest, rest))
    assert not len(surface.collapsed(rest, rest))
    assert surface.backs(rest) == 0


def test_expressions_three_times_too_strong_fold_the_face(groups, rig, surface):
    rest = rig.neutral()
    folds = [len(surface.folded(rest + 3 * (rig.pose(p) - rest), rest)) for p in groups["ten"][:10]]
    assert np.mean(folds) > 30
