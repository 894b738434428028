"""Whether the lines that made a control fire are found again."""

from __future__ import annotations

import numpy as np
import pytest

from classifiers import load_detector
from classifiers.detector import Detector
from classifiers.evidence import Evidence, evidence, occlusion
from classifiers.labels import mirror_order
from classifiers.runtime import Answers
from facs_rig import LANDMARKS, TWELVE
from facs_rig.common.box import Box

SMILE, FRONTALIS = TWELVE.index("smile"), TWELVE.index("frontalis")
LEFT = TWELVE.index("grimace_left")


class Counting:
    """Stands in for the networks: smiles are ink below the middle, raised brows the lack of ink
    above it, a grimace on the left ink on the right of the picture."""

    def run(self, ink: np.ndarray) -> Answers:
        half = ink.shape[1] // 2
        share = ink.mean(axis=2)
        logits = np.zeros((len(ink), len(TWELVE)))
        logits[:, SMILE] = 40 * share[:, half:].mean(axis=1)
        logits[:, FRONTALIS] = -40 * share[:, :half].mean(axis=1)
        logits[:, LEFT] = 40 * ink[:, :, half:].mean(axis=(1, 2))
        logits[:, TWELVE.index("grimace_right")] = 40 * ink[:, :, :half].mean(axis=(1, 2))
        none = np.zeros((len(ink), len(LANDMARKS), 2))
        turn, face = np.zeros((len(ink), 3)), np.full(len(ink), 5.0)
        found = np.full((len(ink), 2, 2, 4), -9.0)
        return Answers(logits, 0 * logits + 3, turn, none, none[..., 0], face, found)


@pytest.fixture
def detector(fresh_weights, monkeypatch) -> Detector:
    loaded = load_detector(fresh_weights)
    monkeypatch.setattr(loaded, "_networks", Counting())
    monkeypatch.setattr(loaded, "_temperatures", np.ones(len(TWELVE)))
    return loaded


@pytest.fixture
def ink(rng) -> np.ndarray:
    return (rng.random((64, 64)) ** 6).astype(np.float32)


def test_evidence_lies_where_the_control_was_read_from(detector, ink):
    heat = occlusion(ink, detector)
    assert heat.shape == (len(TWELVE), 64, 64) and heat.dtype == np.float32
    for k, sign in ((SMILE, 1), (FRONTALIS, -1)):
        above, below = heat[k, :26].mean(), heat[k, 38:].mean()
        there, elsewhere = (below, above) if k == SMILE else (above, below)
        assert sign * there > 10 * abs(elsewhere)
    right, left = heat[LEFT, :, 38:].mean(), heat[LEFT, :, :26].mean()
    assert right > 10 * abs(left)
    assert np.abs(heat[TWELVE.index("pucker")]).max() == 0


def test_a_mirrored_crop_has_the_mirrored_evidence(rng, monkeypatch):
    real = load_detector()
    monkeypatch.setattr(real, "_temperatures", 1.0)  # each side may be calibrated by itself
    ink = (rng.random((real.size, real.size)) ** 6).astype(np.float32)
    one, other = occlusion(ink, real), occlusion(np.ascontiguousarray(ink[:, ::-1]), real)
    assert np.abs(one).max() > 0.01
    tolerance = 1e-4 * np.abs(one).max()
    np.testing.assert_allclose(other[mirror_order(real.aus), :, ::-1], one, atol=tolerance)


def test_maps_lie_on_the_drawing_that_was_read(detector):
    drawing = np.ones((200, 300), np.float32)
    drawing[60:140:8, 80:220] = 0
    found = evidence(drawing, detector)
    assert found.detection == detector.detect(drawing)
    assert tuple(found.maps) == TWELVE
    page = found.on_page("smile")
    assert page.shape == drawing.shape and page.dtype == np.float32
    box = found.box
    v, u = np.mgrid[:200, :300] + 0.5
    inside = (abs(u - box.left - box.width / 2) < box.width / 2) & (
        abs(v - box.top - box.height / 2) < box.height / 2
    )
    assert (page[~inside] == 0).all() and (page[inside] != 0).any()
    below, above = v > box.top + 0.6 * box.height, v < box.top + 0.3 * box.height
    assert page[inside & below].mean() > 5 * abs(page[inside & above].mean())


def test_a_map_is_carried_to_any_view(rng):
    coarse = rng.normal(0, 1, (8, 8)).astype(np.float32)
    found = Evidence(None, (40, 60), Box.at(10, 5, 32, 32), {"smile": coarse})  # type: ignore
    exactly = found.within("smile", Box.at(10, 5, 32, 32), (8, 8))
    np.testing.assert_allclose(exactly, coarse, atol=1e-6)
    right = found.within("smile", Box.at(26, 5, 32, 32), (8, 8))
    np.testing.assert_allclose(right[:, :4], coarse[:, 4:], atol=1e-6)
    assert (right[:, 4:] == 0).all()
    slope = np.broadcast_to(np.arange(8.0), (8, 8))
    sloping = Evidence(None, (40, 60), Box.at(10, 5, 32, 32), {"smile": slope})  # type: ignore
    row = sloping.on_page("smile")[20]
    np.testing.assert_allclose(row[12:40], (np.arange(12, 40) + 0.5 - 10) / 4 - 0.5, atol=1e-6)
    assert (row[:10] == 0).all() and (row[42:] == 0).all()


def test_a_map_of_a_turned_box_is_carried_to_the_upright_page(rng):
    coarse = rng.normal(0, 1, (8, 8)).astype(np.float32)
    box = Box.at(10, 5, 32, 32, np.pi / 2)  # a quarter turn clockwise: its left is the page's top
    found = Evidence(None, (40, 60), box, {"smile": coarse})  # type: ignore
    upright = found.within("smile", Box.at(10, 5, 32, 32), (8, 8))
    np.testing.assert_allclose(upright, np.rot90(coarse, -1), atol=1e-6)
    same = found.within("smile", box, (8, 8))
    np.testing.assert_allclose(same, coarse, atol=1e-6)
    assert (found.on_page("smile")[:, :10] == 0).all()


def test_blank_paper_has_no_evidence(detector):
    found = evidence(np.ones((50, 50), np.float32), detector)
    assert all((heat == 0).all() for heat in found.maps.values())


def test_progress_counts_erasures(detector, ink):
    seen: list[tuple[int, int]] = []
    occlusion(ink, detector, lambda done, total: seen.append((done, total)))
    assert [done for done, _ in seen] == sorted({done for done, _ in seen})
    assert seen[-1][0] == seen[-1][1] > 100
