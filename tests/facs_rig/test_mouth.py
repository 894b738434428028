"""The mouth: what is seen of teeth and tongue, that they stay inside, the jaw's hinge, corners.

All of it is measured on posed vertices and on pictures of them; nothing here knows how the mouth is
made. Bars stand a little beside what is measured (the figures are in the comments, with those of
the mouth before it had single teeth).
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from facs_rig import LANDMARKS, Camera, FaceParameters, rasterise
from facs_rig.controls import ARKIT_NAMES
from facs_rig.identity import FEATURES
from facs_rig.paint import MATERIAL_NAMES, materials_at
from facs_rig.raster import barycentric
from facs_rig.rotation import rotation

MM = 1e-3
INSIDE = ("teeth", "gums", "tongue")
PIXELS = 10.0  # per millimetre, in pictures of the middle of the mouth
ETHNICITIES = ("asian", "african", "caucasian")
LIPS = ("smile", "grimace", "sneer", "lower_lip_depress", "pucker", "purse", "frown", "shrug",
        "lip_loosen", "lip_tighten", "lip_lock", "cheek_suck", "cheek_puff")  # fmt: skip
CORNERS = ("smile", "grimace", "sneer", "jaw_left", "jaw_right")


@pytest.fixture(scope="module")
def jaws(rig):
    """Name -> vertices of the upper and the lower teeth: those that stay and go with the jaw."""
    moved = rig.pose(FaceParameters({"jaw_open": 5.0})) - rig.neutral()
    far = np.linalg.norm(moved, axis=1) > MM
    teeth = rig.parts["teeth"]
    return {"upper": np.flatnonzero(teeth & ~far), "lower": np.flatnonzero(teeth & far)}


def place(rig, vertices, name):
    return vertices[rig.landmarks[LANDMARKS.index(name)]]


def seen_teeth(rig, jaws, aus, who=None, row="upper"):
    """Millimetres of the middle incisors that are seen from the front: mean of four columns."""
    vertices = rig.pose(FaceParameters(aus, who or {}))
    scale = PIXELS / MM
    camera = Camera(200, 1000, (scale, scale), (100.0, -0.015 * scale))
    owner = rasterise(vertices, rig.triangles, camera).triangle
    own = np.zeros(rig.n_vertices, dtype=bool)
    own[jaws[row]] = True
    columns = owner[:, [60, 70, 130, 140]]  # 3 and 4 mm from the middle
    return float((own[rig.triangles[:, 0]][columns] & (columns >= 0)).sum()) / 4 / PIXELS


# --- what is seen ---


# Measured, mm: 7.7 at jaw 3, 7.8 at jaw 6 (before: 0 at both); with the mouth open alone 2.15.
def test_an_open_smile_shows_the_upper_incisors(rig, jaws):
    for opening in (3.0, 4.5, 6.0):
        assert 7.0 < seen_teeth(rig, jaws, {"smile": 5.0, "jaw_open": opening}) < 10.0
    assert 1.5 < seen_teeth(rig, jaws, {"jaw_open": 6.0}) < 4.0


# Measured, mm that its middle hangs lower than 5 mm aside: -0.3 to 0 (with a drop: 2.7 to 3.7).
@pytest.mark.parametrize("who", [{}, {"gender": 1.0}, {"african": 1.0, "asian": 0.0}, {"age": 0.8}])
def test_an_open_smile_s_upper_lip_has_an_even_edge(rig, who):
    for opening in (3.0, 6.0):
        vertices = rig.pose(FaceParameters({"smile": 5.0, "jaw_open": opening}, who))
        scale = PIXELS / MM
        camera = Camera(200, 1000, (scale, scale), (100.0, -0.015 * scale))
        seen = rasterise(vertices, rig.triangles, camera).triangle
        inside = np.any([rig.parts[part] for part in INSIDE], axis=0)[rig.triangles[:, 0]]
        first = np.argmax(inside[seen] & (seen >= 0), axis=0)  # below the lip, of each column
        middle, aside = first[100], first[[50, 150]].mean()
        assert -1.5 < (middle - aside) / PIXELS < 2.0


# Measured, mm: 1.7 below 1.7 of the upper ones, which overlap them (before: 1.3, smooth).
def test_a_grimace_shows_the_lower_teeth(rig, jaws):
    shown = {"grimace": 5.0, "lower_lip_depress": 5.0}
    assert seen_teeth(rig, jaws, shown, row="lower") > 1.4


@pytest.mark.parametrize("name", ["smile", "grimace", "frown", "purse", "lip_lock", "shrug"])
def test_what_leaves_the_mouth_closed_shows_no_incisors(rig, jaws, name):
    assert seen_teeth(rig, jaws, {name: 5.0}) == 0
    assert seen_teeth(rig, jaws, {name: 5.0}, row="lower") == 0


def of_the_inside(rig):
    """(t,) bool: triangles of teeth, gums or tongue."""
    return np.isin(rig.triangle_part, [rig.part_names.index(name) for name in INSIDE])


def mouths_window(sanity, rig, vertices, size):
    """A picture of the whole face, of which only what may show teeth, gums or tongue is drawn."""
    mouth = vertices[np.unique(rig.triangles[of_the_inside(rig)])]
    return sanity.window(Camera.framing(vertices, size, size), mouth)


def pixels_inside(sanity, rig, vertices, size=1400):
    """Pixels of a picture from the front that show teeth, gums or tongue."""
    camera = mouths_window(sanity, rig, vertices, size)
    owner = rasterise(vertices, rig.triangles, camera).triangle
    return int(of_the_inside(rig)[owner[owner >= 0]].sum())


# Measured: none.
def test_a_closed_mouth_shows_nothing_of_anybody(sanity, rig):
    ends = itertools.product((0.0, 1.0), (0.0, 0.5, 1.0), (0.0, 1.0), ETHNICITIES)
    for gender, age, weight, ethnicity in ends:
        who = {"gender": gender, "age": age, "weight": weight}
        who |= {name: float(name == ethnicity) for name in ETHNICITIES}
        assert pixels_inside(sanity, rig, rig.neutral(who)) == 0, who


# Measured, of pictures 1400 pixels high: 2 pixels in all.
def test_features_at_their_ends_show_nothing_of_a_closed_mouth(sanity, rig):
    ends = [{f.name: end} for f in FEATURES for end in (-1.0, 1.0)]
    seen = [pixels_inside(sanity, rig, rig.neutral(who)) for who in ends]
    assert max(seen) <= 4
    assert sum(seen) <= 8


# --- teeth and tongue ---


def test_teeth_are_single_and_stand_in_an_arch(rig, jaws):
    """Seven on each side of each jaw, the molars behind the incisors and farther apart."""
    triangles = rig.triangles[rig.triangle_part == rig.part_names.index("teeth")]
    ends = np.concatenate([triangles[:, [a, b]] for a, b in ((0, 1), (1, 2))])
    n = rig.n_vertices
    tooth = connected_components(csr_matrix((np.ones(len(ends)), ends.T), shape=(n, n)))[1]
    rest = rig.neutral()
    for row in jaws.values():
        numbers = np.unique(tooth[row])
        assert len(numbers) == 14
        middles = np.array([rest[tooth == k].mean(axis=0) for k in numbers])
        order = np.argsort(np.abs(middles[:, 0]))
        across, deep = np.abs(middles[order, 0]), middles[order, 2]
        assert (np.diff(across[::2]) > 0.5 * MM).all() and (np.diff(deep[::2]) < 0).all()
        assert 0.038 < 2 * across[-1] < 0.06
        assert 0.030 < deep[0] - deep[-1] < 0.045
        for k in numbers:  # narrower at the gum than where it meets its neighbour
            own = rest[tooth == k]
            assert np.ptp(own, axis=0)[1] > 5 * MM


def test_upper_teeth_overlap_the_lower_ones_and_stay_with_the_skull(rig, jaws):
    rest = rig.neutral()
    middle = {k: v[np.abs(rest[v, 0]) < 4 * MM] for k, v in jaws.items()}
    edge = rest[middle["upper"]][:, 1].min()
    assert 1 * MM < rest[middle["lower"]][:, 1].max() - edge < 4 * MM
    assert rest[middle["lower"]][:, 2].max() < rest[middle["upper"]][:, 2].max() - 1 * MM
    moved = rig.pose(FaceParameters({name: 5.0 for name in (*LIPS, *CORNERS, "jaw_open")})) - rest
    assert np.abs(moved[jaws["upper"]]).max() < 1e-5


def test_the_tongue_lies_behind_the_lower_teeth_and_moves_with_the_jaw(rig, jaws):
    tongue = np.flatnonzero(rig.parts["tongue"])
    for aus in ({}, {"jaw_open": 5.0}, {"jaw_open": 10.0}, {"jaw_left": 5.0, "jaw_open": 3.0}):
        face = rig.pose(FaceParameters(aus))
        front = jaws["lower"][np.argsort(-rig.neutral()[jaws["lower"], 2])[:60]]
        behind = face[front][:, 2].mean() - face[tongue][:, 2].max()
        assert 1 * MM < behind < 16 * MM
    tip = tongue[np.argmax(rig.neutral()[tongue, 2])]
    moved = rig.pose(FaceParameters({"jaw_open": 5.0})) - rig.neutral()
    tooth = jaws["lower"][np.argmax(rig.neutral()[jaws["lower"], 2])]
    assert np.linalg.norm(moved[tip] - moved[tooth]) < 3 * MM
    assert moved[tip, 1] < -10 * MM


def test_the_tongue_s_tip_is_round(rig):
    """Half as wide 4 mm behind the tip as where it is widest, at most, and nowhere square."""
    face = rig.neutral()[rig.parts["tongue"]]
    ahead = face[:, 2].max() - face[:, 2]
    widths = [np.ptp(face[ahead < far * MM, 0]) for far in (1.0, 2.5, 5.0, 12.0)]
    assert widths[0] < 10 * MM
    assert (np.diff(widths) > 1.5 * MM).all()


def test_the_tongue_comes_out_over_the_lower_lip(sanity, rig):
    """ARKit's tongueOut; no control of ours puts it out."""
    out = rig.neutral().copy()
    for name, value in (("jawOpen", 0.7), ("tongueOut", 1.0)):
        out += value * rig.arkit_deltas[ARKIT_NAMES.index(name)]
    tongue = rig.parts["tongue"]
    lip = place(rig, out, "lip_bottom")
    assert out[tongue][:, 2].max() > lip[2] + 8 * MM
    assert pixels_inside(sanity, rig, out) > 3000


# --- nothing passes through the face ---


def pierced(sanity, rig, surface, vertices, yaws=(0.0, 0.7, -0.7), size=700):
    """Pixels that show teeth, gums or tongue in front of skin that is seen when the face is at
    rest: what a picture without them shows there is the outside of lips or cheeks."""
    inside = of_the_inside(rig)
    is_outer = np.zeros(len(rig.triangles), dtype=bool)
    is_outer[np.flatnonzero(rig.triangle_part == 0)[surface.seen]] = True
    total = 0
    for yaw in yaws:
        turned = (vertices @ rotation((yaw, 0.0, 0.0)).T).astype(np.float32)
        camera = mouths_window(sanity, rig, turned, size)
        whole = rasterise(turned, rig.triangles, camera).triangle
        shown = (whole >= 0) & inside[whole]
        without = rasterise(turned, rig.triangles[~inside], camera).triangle
        outside = (without >= 0) & is_outer[np.flatnonzero(~inside)][without]
        total += int((shown & outside).sum())
    return total


# Measured: 8 pixels of 2 x 490,000 at most, at the corner of a smile with jaw 10, else none.
@pytest.mark.parametrize("name", LIPS)
def test_teeth_and_tongue_stay_inside_at_every_opening(sanity, rig, surface, name):
    for opening in (0.0, 3.0, 6.0, 10.0):
        aus = {name: 5.0, "jaw_open": opening}
        assert pierced(sanity, rig, surface, rig.pose(FaceParameters(aus)), (0.0, 0.7)) <= 12, aus


# With teeth that go as far as the source has them, 65 pixels beside the corner.
@pytest.mark.parametrize("name", ["jaw_left", "jaw_right", "jaw_forward"])
def test_teeth_stay_inside_when_the_jaw_is_pushed_as_far_as_it_goes(sanity, rig, surface, name):
    for with_what in ({}, {"smile": 5.0}, {"grimace": 5.0}):
        aus = {name: 10.0, **with_what}
        assert pierced(sanity, rig, surface, rig.pose(FaceParameters(aus))) <= 12, aus


def test_teeth_and_tongue_stay_inside_of_random_faces_of_anybody(sanity, rig, surface):
    from dataset_gen.sampling import sample_identity

    found = []
    for k in range(24):
        rng = np.random.default_rng([16, k])
        aus = {name: float(rng.uniform(0, 5)) for name in rng.choice(LIPS, 4, replace=False)}
        aus |= {"jaw_open": float(rng.uniform(0, 10)), "jaw_left": float(rng.uniform(0, 4))}
        who = sample_identity(rng)
        found.append(pierced(sanity, rig, surface, rig.pose(FaceParameters(aus, who))))
    assert sum(found) <= 20
    assert max(found) <= 20


def test_teeth_that_come_out_are_found(sanity, rig, surface, jaws):
    pushed = rig.neutral().copy()
    pushed[jaws["upper"]] += [0, 0, 15 * MM]
    assert pierced(sanity, rig, surface, pushed) > 500


def test_an_open_mouth_is_closed_behind_and_dark(rig):
    """No pixel between the lips looks through the head, and none is of the skin's colour."""
    for aus in (
        {"jaw_open": 6.0},
        {"jaw_open": 10.0, "lip_loosen": 3.0},
        {"smile": 5.0, "jaw_open": 8.0},
    ):
        for pitch in (0.0, 0.35, -0.35):
            face = rig.pose(FaceParameters(aus))
            turned = (face @ rotation((0.0, pitch, 0.0)).T).astype(np.float32)
            camera = Camera.framing(turned, 700, 700)
            owner = rasterise(turned, rig.triangles, camera).triangle
            tops, lows = (camera.project(turned[rig.landmarks[[LANDMARKS.index(n)]]])[0]
                          for n in ("lip_inner_top", "lip_inner_bottom"))  # fmt: skip
            v = np.arange(round(tops[1]) + 2, round(lows[1]) - 2)
            u = np.full(len(v), round(tops[0]))
            own = owner[v, u]
            assert (own >= 0).all()
            weights = barycentric(turned, rig.triangles, camera, own, u + 0.5, v + 0.5)
            points = np.einsum("kc,kcd->kd", weights, rig.neutral()[rig.triangles[own]])
            found = materials_at(rig, points, rig.triangle_part[own])
            assert MATERIAL_NAMES.index("skin") not in found


# --- the jaw ---


def rigid(start, end):
    """Angle (radians) about the x axis and root mean square of what is left, of the best turn."""
    a, b = ((p - p.mean(axis=0))[:, 1:] for p in (start.astype(float), end.astype(float)))
    angle = np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum())
    c, s = np.cos(angle), np.sin(angle)
    left = a @ np.array([(c, s), (-s, c)]) - b
    return angle, np.sqrt(np.mean(np.sum(left**2, axis=1)))


# Measured, mm off a rigid turn at 2.5, 5 and 10: teeth 0.00, 0.00, 0.05; chin 0.10, 0.18, 0.29.
def test_the_jaw_turns_about_its_hinge(rig, jaws):
    rest = rig.neutral()
    chin = np.flatnonzero(rig.parts["skin"] & (np.abs(rest[:, 0]) < 0.02))
    chin = chin[np.linalg.norm(rest[chin] - place(rig, rest, "chin"), axis=1) < 0.018]
    angles = []
    for opening in (2.5, 5.0, 10.0):
        face = rig.pose(FaceParameters({"jaw_open": opening}))
        angle, left = rigid(rest[jaws["lower"]], face[jaws["lower"]])
        angles.append(angle)
        assert left < (0.1 if opening <= 5 else 0.5) * MM
        of_chin, left = rigid(rest[chin], face[chin])
        assert left < (0.6 if opening <= 5 else 1.6) * MM
        assert of_chin == pytest.approx(angle, rel=0.12)
    assert np.degrees(angles[1]) == pytest.approx(17.1, abs=0.5)
    np.testing.assert_allclose(np.array(angles) / angles[1], [0.5, 1.0, 2.0], atol=0.06)


def test_the_jaw_s_hinge_lies_before_the_ear_and_glides_forward(rig, jaws):
    """Where the teeth's turn leaves the joint, it has moved forward by some millimetres."""
    rest, face = rig.neutral(), rig.pose(FaceParameters({"jaw_open": 5.0}))
    teeth = jaws["lower"]
    angle, _ = rigid(rest[teeth], face[teeth])
    turn = rotation((0.0, angle, 0.0))
    hinge = rig.joints()["jaw"]
    arm = rest[teeth].mean(axis=0) - hinge
    glide = (face[teeth].mean(axis=0) - hinge) - turn @ arm
    assert 2 * MM < glide[2] < 9 * MM
    assert abs(glide[0]) < 0.1 * MM and abs(glide[1]) < 5 * MM


def test_lower_lip_and_chin_follow_the_teeth(rig, jaws):
    rest = rig.neutral()
    for opening in (3.0, 5.0, 8.0):
        face = rig.pose(FaceParameters({"jaw_open": opening}))
        moved = {n: place(rig, face, n) - place(rig, rest, n) for n in ("lip_inner_bottom", "chin")}
        tooth = jaws["lower"][np.argmax(rest[jaws["lower"], 2])]
        off = moved["lip_inner_bottom"] - (face - rest)[tooth]
        assert np.linalg.norm(off) < 0.25 * np.linalg.norm((face - rest)[tooth])


# --- the corners ---


def folded_near_corners(rig, surface, aus):
    face, rest = rig.pose(FaceParameters(aus)), rig.neutral()
    ids = surface.folded(face, rest)
    middle = face[surface.triangles[ids]].mean(axis=1)
    corners = [place(rig, face, f"mouth_corner_{side}") for side in ("left", "right")]
    away = np.min([np.linalg.norm(middle - corner, axis=1) for corner in corners], axis=0)
    return int((away < 0.015).sum()) if len(ids) else 0


# Measured: 34, all of smiles, and none of grimace, sneer and jaw alone or together (before: 24, of
# grimaces, too).
def test_no_skin_folds_over_at_the_corners(rig, surface):
    pairs = [*itertools.combinations(CORNERS, 2), *((name,) for name in CORNERS)]
    faces = [
        dict.fromkeys(names, 5.0) for names in pairs if set(names) != {"jaw_left", "jaw_right"}
    ]
    counts = [folded_near_corners(rig, surface, aus) for aus in faces]
    assert sum(counts) <= 40


def thickness(rig, vertices):
    """(2,) metres from the border of the upper and the lower lip to the seam, near the left
    corner: at a sixth of the lip's half width from the corner."""
    upper, lower = (rig.stroke_points(vertices, f"lip_{edge}") for edge in ("upper", "lower"))
    seam = rig.curves["lip_line"].points(vertices)
    corner = seam[np.argmax(seam[:, 0])]
    x = corner[0] * 5 / 6
    heights = []
    for line in (upper, seam, lower):
        half = line[line[:, 0] > 0]
        half = half[np.argsort(half[:, 0])]
        heights.append(np.interp(x, half[:, 0], half[:, 1]))
    return np.array([heights[0] - heights[1], heights[1] - heights[2]])


# Measured, mm: 1.5 and 5.8 at rest, 0.8 and 3.6 in a smile (before: 1.2 and 5.2, 0.35 and 2.6).
def test_lips_keep_their_thickness_near_the_corners(rig):
    rest = thickness(rig, rig.neutral())
    for name in ("smile", "grimace"):
        now = thickness(rig, rig.pose(FaceParameters({name: 5.0})))
        assert (now > 0.5 * rest).all(), (name, now, rest)


# Measured, mm: 1.8 aside, 3.0 up, 2.9 forward (before: 0.6, 2.3, 0.2).
def test_a_smile_raises_the_cheeks(rig):
    rest, face = rig.neutral(), rig.pose(FaceParameters({"smile": 5.0}))
    eye, corner = place(rig, rest, "pupil_left"), place(rig, rest, "mouth_corner_left")
    apple = np.array([1.2 * eye[0], corner[1] + 0.45 * (eye[1] - corner[1])])
    skin = np.flatnonzero(rig.parts["skin"] & (rest[:, 2] > 0.05))
    near = skin[np.linalg.norm(rest[skin, :2] - apple, axis=1) < 0.006]
    moved = (face - rest)[near].mean(axis=0)
    assert moved[2] > 2 * MM and moved[1] > 2.5 * MM
