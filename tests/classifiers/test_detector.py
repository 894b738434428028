"""The detector on networks that were exported a moment ago, and what it does with bad input."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from classifiers import load_detector
from classifiers.detector import BARED, DOUBT, Detector, Reading, surer
from classifiers.finding import Face
from classifiers.labels import ACTIVE, FULL, mirror_order
from classifiers.plausible import FARTHEST
from classifiers.preprocess import FACE_MARGIN, as_page
from classifiers.runtime import THREADS, WEIGHTS, Answers, checksum, open_session, read_description
from classifiers.training import shards
from facs_rig import LANDMARKS, TWELVE
from facs_rig.common.box import Box


@pytest.fixture(scope="module")
def detector(fresh_weights) -> Detector:
    return load_detector(fresh_weights)


@pytest.fixture(scope="module")
def drawing(cartoons) -> np.ndarray:
    return shards.load(cartoons, limit=1).drawings[0] / np.float32(255)


def test_a_detection_is_complete_and_in_range(detector, drawing):
    found = detector.detect(drawing)
    for mapping in (found.probabilities, found.active, found.intensities):
        assert tuple(mapping) == TWELVE
    assert all(0 <= p <= 1 for p in found.probabilities.values())
    assert all(type(active) is bool for active in found.active.values())
    for name, value in found.intensities.items():
        assert value == 0 if not found.active[name] else ACTIVE <= value <= FULL
    assert tuple(found.landmarks) == LANDMARKS
    assert len(found.head) == 3 and all(abs(angle) < np.pi for angle in found.head)
    assert 0 <= found.face_probability <= 1
    assert tuple(found.confidences) == LANDMARKS
    assert all(0 <= p <= 1 for p in found.confidences.values())
    assert bool(found.faces) != bool(found.trouble)
    assert set(found.expression()) == {name for name in TWELVE if found.active[name]}


@pytest.mark.parametrize("shape", [(1, 1), (3, 700), (1400, 900)])
def test_any_page_size_will_do(detector, shape):
    page = np.ones(shape, np.float64)
    page[shape[0] // 3 : shape[0] // 2 + 1, shape[1] // 3 : shape[1] // 2 + 1] = 0.2
    found = detector.detect(page)
    assert np.isfinite(list(found.landmarks.values())).all()


def test_a_blank_page_is_read_without_complaint(detector):
    assert np.isfinite(detector.detect(np.ones((64, 64), np.float32)).face_probability)


def test_the_same_drawing_gives_the_same_answer(detector, drawing):
    assert detector.detect(drawing) == detector.detect(drawing)


def test_size_and_paper_around_the_drawing_hardly_matter(detector, drawing):
    a = detector.read(as_page(drawing))
    bigger = np.pad(np.kron(drawing, np.ones((3, 3), np.float32)), 150, constant_values=1)
    b = detector.read(as_page(bigger))
    np.testing.assert_allclose((b.landmarks - 150) / 3, a.landmarks, atol=1.0)
    np.testing.assert_allclose(b.angles, a.angles, atol=0.02)


def test_the_second_look_of_a_mirrored_crop_is_the_mirrored_answer(detector, rng):
    crop = rng.random((detector.size, detector.size), np.float32) ** 4
    a, b = detector.look_both_ways(crop), detector.look_both_ways(crop[:, ::-1])
    np.testing.assert_allclose(b.logits, a.logits[:, mirror_order(TWELVE)], atol=1e-4)
    np.testing.assert_allclose(b.angles, a.angles * (-1, 1, -1), atol=1e-5)
    order = mirror_order(LANDMARKS)
    np.testing.assert_allclose(b.landmarks, a.landmarks[:, order] * (-1, 1) + (1, 0), atol=1e-4)


def reading(**changes) -> Reading:
    """An answer in which nothing is active."""
    count = len(TWELVE)
    nothing = {
        "logits": np.full(count, -40.0),
        "intensities": np.full(count, 0.2),
        "angles": np.zeros(3),
        "landmarks": np.zeros((len(LANDMARKS), 2)),
        "spreads": np.ones(len(LANDMARKS)),
        "face": 3.0,
        "box": Box.at(10, 20, 30, 30),
    }
    return Reading(**(nothing | changes))


def test_thresholds_and_the_rules_of_conflicts_decide(detector, monkeypatch):
    k = {name: i for i, name in enumerate(TWELVE)}
    logits = np.full(len(TWELVE), -40.0)
    intensities = np.full(len(TWELVE), 0.2)
    for name, value in (("smile", 7.3), ("grimace_left", 4.0), ("grimace_right", 2.5)):
        logits[k[name]], intensities[k[name]] = 40, value
    both = reading(logits=logits, intensities=intensities)
    found = detector.interpret(both)
    assert found.expression() == pytest.approx({"grimace": 2.5, "grimace_left": 1.5, "smile": 5.0})
    logits[k["grimace_right"]] = -0.5  # in doubt beside a certain left: it is the left alone
    monkeypatch.setitem(detector._thresholds, "grimace_right", 0.05)
    one = detector.interpret(both)
    assert one.expression() == pytest.approx({"grimace_left": 4.0, "smile": 5.0})
    logits[k["sneer"]] = 40  # certain but faint: an active control is at least at 1
    assert detector.interpret(both).intensities["sneer"] == ACTIVE
    logits[k["wince"]], intensities[k["wince"]] = -0.5, 3  # the sneer's folds again
    monkeypatch.setitem(detector._thresholds, "wince", 0.05)
    assert not detector.interpret(both).active["wince"]


def test_confidence_is_the_chance_to_be_within_two_percent_of_the_faces_height(detector, rng):
    places = np.zeros((len(LANDMARKS), 2))
    places[LANDMARKS.index("chin"), 1] = 200
    spreads = rng.uniform(0.5, 20, len(LANDMARKS))
    found = detector.interpret(reading(landmarks=places, spreads=spreads))
    for name, spread in zip(LANDMARKS, spreads, strict=True):
        distances = rng.exponential(spread, 4000)
        assert found.confidences[name] == pytest.approx(np.mean(distances < 4), abs=0.04)


def test_the_others_on_the_page_are_told(detector):
    other = Face(Box.at(100, 0, 10, 10), 0.8)
    alone = detector.interpret(reading())
    assert alone.faces == (Face(Box.at(10, 20, 30, 30), alone.face_probability),)
    assert alone.left_out() == ""
    two = detector.interpret(reading(others=(other,)))
    assert two.left_out().startswith("Another face is drawn on the page; the largest was read")
    three = detector.interpret(reading(others=(other, other)))
    assert three.left_out().startswith("2 other faces are drawn")
    assert two.faces_to_json(np.diag([2, 3, 1]))[1] == {
        "box": [200, 0, 220, 30],
        "probability": 0.8,
    }
    none = detector.interpret(reading(face=-30.0, others=(other,)))
    assert none.faces == () and none.left_out() == ""


class Blobs:
    """Stands in for the networks: a face is a black square, seen if its middle is black.

    The finder believes every blob. `certain` false: as networks that never find anything.
    """

    def __init__(self, certain=True, collapsed=False) -> None:
        self.certain, self.collapsed, self.looks = certain, collapsed, 0

    def run(self, ink: np.ndarray) -> Answers:
        self.looks += 1
        n, size = ink.shape[:2]
        cells = 8
        found = np.full((n, cells, cells, 4), -9.0)
        landmarks = np.full((n, len(LANDMARKS), 2), 0.5)
        face = np.full(n, -6.0)
        for k, page in enumerate(ink):
            labels, _ = ndimage.label(ndimage.binary_fill_holes(page > 0.3))
            blobs = []
            for v, u in ndimage.find_objects(labels):
                side = u.stop - u.start  # square: what is missing was cut off above
                blobs.append((side, (u.start + u.stop) / 2, v.stop - side / 2))
            for side, u, v in blobs:
                i, j = (min(max(int(x / size * cells), 0), cells - 1) for x in (v, u))
                offset = u / size * cells - j - 0.5, v / size * cells - i - 0.5
                share = side * FACE_MARGIN / size
                found[k, i, j] = (6.0 if self.certain else -9.0), *offset, np.log(share)
            if blobs:
                side, u, v = max(blobs)
                if any(page[min(int(y), size - 1), int(x)] > 0.3 for _, x, y in blobs):
                    face[k] = 12.0  # as sure as of an upright face
                if not self.collapsed:
                    landmarks[k] = (np.array([u, v]) + side * CORNERS) / size
        none = np.zeros((n, len(TWELVE)))
        spreads = np.full((n, len(LANDMARKS)), -4.0)
        return Answers(none - 9, none, np.zeros((n, 3)), landmarks, spreads, face, found)


# Where the stand-in sees landmarks on a square of side 1: right and left edge, top and bottom.
CORNERS = np.array(
    [
        (
            0.5 if name.endswith("_left") else -0.5 if name.endswith("_right") else 0.0,
            0.5 if "chin" in name or "jaw" in name else -0.5,
        )
        for name in LANDMARKS
    ]
)


def page_with(*squares, shape=(300, 500)) -> np.ndarray:
    """Black squares (left, top, side) on white; a negative side leaves the middle white."""
    page = np.ones(shape, np.float32)
    for left, top, side in squares:
        width = abs(side)
        page[max(top, 0) : top + width, max(left, 0) : left + width] = 0
        if side < 0:
            hole = slice(top + width // 4, top + width - width // 4)
            page[hole, left + width // 4 : left + width - width // 4] = 1
    return page


@pytest.fixture
def seeing(detector, monkeypatch):
    """The detector with other networks."""

    def exchange(networks):
        monkeypatch.setattr(detector, "_networks", networks)
        return detector

    return exchange


def assert_box(face: Face, left, top, side, within=0.06):
    """The face's box is that of a square, with the margin of `face_box`."""
    width = side * FACE_MARGIN
    expected = left - (width - side) / 2, top - (width - side) / 2, width
    box = face.box
    np.testing.assert_allclose((box.left, box.top, box.width), expected, atol=within * side)


def test_the_largest_of_several_faces_is_read(seeing):
    squares = [(20, 30, 60), (150, 40, 120), (380, 180, 90)]
    found = seeing(Blobs()).detect(page_with(*squares))
    assert len(found.faces) == 3
    for face, square in zip(found.faces, (squares[1], squares[2], squares[0]), strict=True):
        assert_box(face, *square, within=0.2 if face is not found.faces[0] else 0.06)
    assert found.left_out().startswith("2 other faces")
    np.testing.assert_allclose(found.landmarks["pupil_left"], (270, 40), atol=4)
    np.testing.assert_allclose(found.landmarks["chin"], (210, 160), atol=4)


def test_a_small_face_in_a_corner_is_read_from_near(seeing):
    page = page_with((20, 40, 64), shape=(600, 600))
    page[560:565, 20:580] = 0  # a line at the bottom widens what is looked at first
    found = seeing(Blobs()).detect(page)
    assert_box(found.faces[0], 20, 40, 64)


def test_what_is_no_face_from_near_is_given_up_for_the_next(seeing):
    found = seeing(Blobs()).detect(page_with((20, 30, -200), (330, 60, 120)))
    assert_box(found.faces[0], 330, 60, 120)
    assert len(found.faces) == 1 and found.face_probability > 0.5
    nothing = seeing(Blobs()).detect(page_with((20, 30, -200)))
    assert nothing.face_probability < 0.5
    assert nothing.faces == ()


def test_without_a_sure_face_all_ink_is_taken_for_one(seeing):
    blind = Blobs(certain=False)
    found = seeing(blind).detect(page_with((150, 40, 120)))
    assert blind.looks == 3  # all ink, all ink again, and who it is
    assert_box(found.faces[0], 150, 40, 120)
    assert len(found.faces) == 1


def test_landmarks_in_one_spot_leave_the_box_as_it_was_found(seeing):
    found = seeing(Blobs(collapsed=True)).detect(page_with((150, 40, 120), (10, 10, 40)))
    assert_box(found.faces[0], 150, 40, 120, within=0.1)
    whole = seeing(Blobs(certain=False, collapsed=True)).read(1 - page_with((150, 40, 120)))
    assert whole.box.width == pytest.approx(120 * 1.06, rel=0.03)


def test_a_face_may_be_cut_off_by_the_pages_edge(seeing):
    found = seeing(Blobs()).detect(page_with((150, -40, 160), shape=(300, 400)))
    assert_box(found.faces[0], 150, -40, 160)
    assert found.landmarks["forehead"][1] < -30


def test_where_the_head_is_can_be_told(seeing):
    page = page_with((150, 40, 120), (380, 180, 90))
    found = seeing(Blobs()).detect(page, Box.at(340, 160, 140, 135))
    assert_box(found.faces[0], 380, 180, 90)
    assert len(found.faces) == 1


class Near(Blobs):
    """Finds nothing in a crop that more than one blob fills, where it takes all of them for a face
    and does not know well where its landmarks are."""

    def run(self, ink: np.ndarray) -> Answers:
        answers = super().run(ink)
        for k, page in enumerate(ink):
            black = ndimage.binary_fill_holes(page > 0.3)
            v, u = np.nonzero(black)
            side = max(np.ptp(u), np.ptp(v)) if len(u) else 0
            if ndimage.label(black)[1] > 1 and side > 0.7 * len(page):
                middle = np.array([u.min() + u.max(), v.min() + v.max()]) / 2
                answers.found[k, ..., 0] = -9
                answers.landmarks[k] = (middle + side * CORNERS) / len(page)
                answers.spreads[k] = np.log(2 * DOUBT)
        return answers


HAIR, FACE = (100, 10, -110), (105, 150, 100)


def test_what_is_in_doubt_is_looked_at_from_farther_off(seeing, monkeypatch):
    monkeypatch.setattr("classifiers.detector.nose_ink", lambda *_: 1.0)  # a square has none
    page = page_with(HAIR, FACE, shape=(300, 300))
    detector = seeing(Near())
    near = detector.read(1 - page, farther=())
    assert near.box.width == pytest.approx(240 * FACE_MARGIN, rel=0.04)
    found = detector.detect(page)
    assert_box(found.faces[0], *FACE)
    np.testing.assert_allclose(found.landmarks["chin"], (155, 250), atol=4)
    told = detector.detect(page, near.box)  # somebody said how large it is
    assert told.faces[0].box.width == pytest.approx(near.box.width, rel=0.04)


def test_a_sure_reading_is_not_looked_at_from_farther_off(seeing):
    networks = Near()
    detector = seeing(networks)
    counts = []
    for farther in ((), (2.0,)):
        networks.looks = 0
        detector.read(1 - page_with(FACE, shape=(300, 300)), farther=farther)
        counts.append(networks.looks)
    assert counts[0] == counts[1]


def test_a_surer_reading_counts_if_it_is_of_the_same_face():
    vague, sure = (reading(spreads=np.full(len(LANDMARKS), s)) for s in (1.8, 1.2))
    assert surer(sure, vague) and not surer(vague, sure)
    assert not surer(replace(sure, box=Box.at(80, 20, 30, 30)), vague)
    assert not surer(replace(sure, face=-1.0), vague)
    bare = Box.at(12, 22, BARED * 30, BARED * 30)
    hidden = replace(vague, apart=2 * FARTHEST)
    assert surer(replace(sure, box=bare, spreads=BARED * sure.spreads), hidden)
    assert not surer(sure, hidden)  # as large as it was
    assert not surer(replace(sure, box=bare, spreads=vague.spreads), hidden)
    nothing = replace(hidden, face=-1.0)
    assert not surer(replace(sure, box=bare, spreads=BARED * sure.spreads), nothing)


def test_no_drawing_no_detection(detector):
    with pytest.raises(ValueError, match="grey image"):
        detector.detect(np.ones((8, 8, 3), np.float32))


def test_a_detector_is_loaded_once_for_each_number_of_threads(fresh_weights):
    one = load_detector(fresh_weights, threads=1)
    assert load_detector(str(fresh_weights), 1) is one
    assert load_detector(fresh_weights) is load_detector(fresh_weights, THREADS) is not one
    with pytest.raises(ValueError, match="at least one thread, not 0"):
        load_detector(threads=0)


def signed(model):
    return model | {"checksum": checksum(model)}


@pytest.mark.parametrize("name", ["model.json", "detector.onnx"])
def test_a_flipped_bit_is_one_sentence(tmp_path, name):
    """Wherever it is; of a description it may also be between its words, where it says nothing."""
    shutil.copytree(WEIGHTS, tmp_path / "copy")
    path = tmp_path / "copy" / name
    whole = path.read_bytes()
    known = read_description(WEIGHTS)
    rng = np.random.default_rng(0)
    for place in {0, 1, 20, len(whole) - 2, *rng.integers(0, len(whole), 150).tolist()}:
        content = bytearray(whole)
        content[place] ^= 1 << place % 8
        path.write_bytes(content)
        try:
            model = read_description(path.parent)
            open_session(path.parent / model["weights"], model["sha256"], 1)
        except ValueError as error:
            assert f"{name} " in str(error) and "install the package again" in str(error)
            assert "\n" not in str(error)
        else:
            assert name == "model.json" and model == known


def test_a_description_is_the_same_however_it_is_written_down(tmp_path):
    model = read_description(WEIGHTS)
    (tmp_path / "model.json").write_text(json.dumps(model, sort_keys=True))
    assert read_description(tmp_path) == model
    (tmp_path / "model.json").write_text(json.dumps(model | {"face_temperature": 9.0}))
    with pytest.raises(ValueError, match="is damaged: install the package again"):
        read_description(tmp_path)


def test_damaged_or_missing_weights_are_named(fresh_weights, tmp_path):
    with pytest.raises(ValueError, match=r"model\.json is missing"):
        Detector(tmp_path)
    folder = tmp_path / "copy"
    shutil.copytree(fresh_weights, folder)
    weights = folder / "detector.onnx"
    weights.write_bytes(weights.read_bytes()[:-1])
    with pytest.raises(ValueError, match=r"detector\.onnx is damaged"):
        Detector(folder)
    weights.unlink()
    with pytest.raises(ValueError, match=r"detector\.onnx cannot be read"):
        Detector(folder)
    description = folder / "model.json"
    model = json.loads(description.read_text())
    description.write_text(json.dumps(signed(model | {"format": 99})))
    with pytest.raises(ValueError, match="format 99"):
        Detector(folder)
    description.write_text("{")
    with pytest.raises(ValueError, match=r"model\.json is damaged"):
        Detector(folder)
    description.write_text("[]")
    with pytest.raises(ValueError, match=r"model\.json is damaged"):
        Detector(folder)
    description.write_text(json.dumps({"format": model["format"], "weights": "detector.onnx"}))
    with pytest.raises(ValueError, match=r"model\.json lacks .*aus.*thresholds"):
        Detector(folder)


@pytest.mark.parametrize("names", ["aus", "landmarks"])
def test_weights_that_belong_to_another_description_are_named(fresh_weights, tmp_path, names):
    folder = tmp_path / "copy"
    shutil.copytree(fresh_weights, folder)
    model = json.loads((folder / "model.json").read_text())
    model[names] = model[names][:-1]
    (folder / "model.json").write_text(json.dumps(signed(model)))
    with pytest.raises(ValueError, match=r"detector\.onnx does not belong to the model\.json"):
        Detector(folder)
