"""Hats: closed surfaces off the skin, whatever the head, and hair that keeps under them."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from facs_rig import FaceParameters, load_rig
from facs_rig.common.errors import InputError
from facs_rig.hair.cut import ANGLES
from facs_rig.hair.hat import Hat, crown_on, hat_mesh, pressed
from facs_rig.hair.head import head_of
from facs_rig.hair.presets import PRESETS, preset
from facs_rig.hair.shell import shell_on

RIG = load_rig()
SOMEBODY = {"gender": 1.0, "age": 0.6, "head_width": 0.6, "head_height": -0.5}
PLAIN = Hat(0.3 + 0.15 * np.cos(ANGLES), np.full((48, 8), 0.02), np.zeros(48))
PEAK = 0.06 * np.clip(np.cos(ANGLES), 0, 1)


@pytest.mark.parametrize("brim", [0 * PEAK, PEAK, PEAK * 0 + 0.08], ids=["none", "peak", "brim"])
@pytest.mark.parametrize("who", [{}, SOMEBODY], ids=["nobody", "somebody"])
def test_a_hat_is_two_closed_surfaces_off_the_skin(brim, who):
    made = hat_mesh(RIG, who, replace(PLAIN, brim=brim, droop=0.3))
    solid = trimesh.Trimesh(made.points, made.triangles, process=False)
    assert solid.is_watertight and solid.is_winding_consistent
    assert [part.volume > 0 for part in solid.split()] == [True, True]
    head = head_of(RIG, who)
    crown = crown_on(head, PLAIN)
    away = crown.points.astype(float) - head.middle
    far = np.linalg.norm(away, axis=1)
    assert (far > head.rays(head.skull, away / far[:, None]) + 0.001).all()
    assert (far[crown.outer] - far[crown.inner]).min() > 0.01


def test_a_brim_juts_out_and_droops_as_much_as_it_says():
    bare, wide = (hat_mesh(RIG, {}, replace(PLAIN, brim=np.full(48, b), droop=0.5))
                  for b in (0.0, 0.09))  # fmt: skip
    assert 0.085 < np.ptp(wide.points[:, 0]) / 2 - np.ptp(bare.points[:, 0]) / 2 < 0.095
    assert 0.03 < bare.points[:, 1].min() - wide.points[:, 1].min() < 0.05


@pytest.mark.parametrize("cuff", [0.0, 0.005], ids=["ribbon", "fold"])
def test_a_band_goes_up_from_the_rim_and_stands_off_as_it_says(cuff):
    banded = replace(PLAIN, band=0.04, cuff=cuff)
    made = hat_mesh(RIG, SOMEBODY, banded)
    solid = trimesh.Trimesh(made.points, made.triangles, process=False)
    assert solid.is_watertight and solid.is_winding_consistent
    head = head_of(RIG, SOMEBODY)
    crown = crown_on(head, banded)
    outer = crown.points[crown.outer].astype(float)
    far = np.linalg.norm(outer - head.middle, axis=-1)
    off = far - head.rays(head.covered, (outer - head.middle) / far[..., None])
    first = int((made.shade[crown.outer] < 0.9).all(axis=0).argmax())  # the crease above it
    assert np.allclose(off[:, first + 1 :], 0.02 + cuff, atol=2e-3)
    assert np.allclose(off[:, first], 0.02, atol=2e-3)
    assert 0.035 < (outer[:, first + 1, 1] - outer[:, -1, 1]).mean() < 0.05
    shade = made.shade[crown.outer[:, first + 1 :]]
    assert (shade == 1).all() if cuff else (shade < 0.6).all()


def test_a_peak_shows_where_it_begins_and_a_cap_its_seams():
    cap, bare = (hat_mesh(RIG, {}, replace(PLAIN, brim=brim)) for brim in (PEAK, 0 * PEAK))
    assert cap.hat.peaked and not bare.hat.peaked
    crown = crown_on(head_of(RIG, {}), PLAIN)
    assert len(np.unique(cap.shade[crown.outer[:, 5]])) == 2  # seams, and what is between them
    assert len(np.unique(bare.shade[crown.outer[:, 5]])) == 1


def test_cloth_is_as_dark_as_it_says():
    light, hatched, black = (
        np.mean(hat_mesh(RIG, {}, replace(PLAIN, colour=c)).colour) for c in (0.0, 0.45, 1.0)
    )
    assert light > 0.6 and 0.08 < hatched < 0.2 and black < 0.02


def test_it_follows_the_head():
    made = hat_mesh(RIG, SOMEBODY, PLAIN)
    assert np.abs(made.on(RIG.neutral(SOMEBODY)) - made.points).max() < 1e-5
    shifted = RIG.pose(FaceParameters({"frontalis": 8.0, "jaw_open": 9.0}, SOMEBODY))
    assert np.abs(made.on(shifted) - made.points).max() < 1e-4  # no action moves it


@pytest.mark.parametrize("name", PRESETS)
def test_hair_under_a_hat_does_not_come_through(name):
    cut, head = pressed(preset(name), PLAIN, head_of(RIG, {})), head_of(RIG, {})
    hair, crown = shell_on(head, cut), crown_on(head, PLAIN)
    away = hair.points[hair.outer].reshape(-1, 3) - head.middle
    far = np.linalg.norm(away, axis=1)
    ways = away / far[:, None]
    azimuth = np.arctan2(ways[:, 0], ways[:, 2])
    rim = np.interp(azimuth, ANGLES, PLAIN.edge, period=2 * np.pi)
    above = head.height(away[:, 1] + head.middle[1] - head.eyes[1]) > rim + 0.05
    assert above.any()
    hat = head.rays(head.covered, ways) + 0.02
    assert (far[above] < hat[above] - 0.002).all()
    assert len(crown.points) and all(ball.line[0, 1] < PLAIN.edge.min() for ball in cut.balls)


@pytest.mark.parametrize(
    ("field", "value"),
    [("edge", np.full(48, 1.2)), ("thick", np.zeros((48, 1))), ("brim", np.full(48, -0.1)),
     ("brim", np.full(48, np.nan)), ("colour", 1.5), ("droop", np.inf),
     ("band", -0.01), ("cuff", np.nan)],
)  # fmt: skip
def test_what_is_no_hat_is_refused(field, value):
    with pytest.raises(InputError):
        replace(PLAIN, **{field: value})
