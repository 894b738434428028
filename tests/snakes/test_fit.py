"""The whole stage: the sphere example of the thesis, and a face drawn by its own outline."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image, ImageDraw

from facs_rig import LANDMARKS, Camera, FaceParameters, load_rig, rasterise
from snakes import WORKING_SIZE, Tweakables, fit_offsets, head_box
from snakes.deltas import PixelDeltas
from snakes.fit import _apply, skin_smoother
from snakes.offsets import smoothing_matrix
from snakes.parts import carry_parts, even_skull, eyeballs
from snakes.render import expression_render


def silhouette(vertices, triangles, camera):
    return np.isfinite(rasterise(vertices, triangles, camera).depth)


def covered_by(a, b, size=400):
    v, u = np.mgrid[:size, :size] + 0.5 - size / 2
    return (u / a) ** 2 + (v / b) ** 2 <= 1


@pytest.mark.parametrize("axes", [(105, 120), (118, 128), (142, 146), (150, 130)])
def test_the_sphere_comes_closer_to_a_drawn_ellipse(scene, ball, axes):
    camera, parameters = scene.camera(), FaceParameters()
    fit = fit_offsets(scene.ellipse(*axes), ball, parameters, camera)
    wanted = covered_by(*axes)
    before = silhouette(ball.vertices, ball.triangles, camera) ^ wanted
    after = silhouette(ball.pose(parameters, fit.offsets), ball.triangles, camera) ^ wanted
    assert after.sum() < 0.7 * before.sum()
    assert fit.offsets.dtype == np.float32 and np.isfinite(fit.offsets).all()
    assert not fit.offsets[:, 2].any()  # parallel to the picture


def test_a_sphere_drawn_as_it_is_stays(scene, ball):
    fit = fit_offsets(scene.ellipse(130, 130), ball, FaceParameters(), scene.camera())
    assert np.linalg.norm(fit.offsets, axis=1).max() < 2e-3  # under a pixel of the working image


def test_the_sphere_of_the_thesis_with_three_soft_select_distances(scene):
    """On a ball of 1 cm: each output is closer to the drawing, greater distances are smoother."""
    sphere, camera = scene.Ball(radius=0.01), scene.camera(0.01)
    outline = scene.deformed_circle()
    page = Image.new("1", (scene.SIZE, scene.SIZE))
    ImageDraw.Draw(page).polygon([tuple(point) for point in outline], fill=1)
    wanted = np.asarray(page)
    smoother = smoothing_matrix(sphere.triangles, sphere.n_vertices)

    def off(vertices):
        return (silhouette(vertices, sphere.triangles, camera) ^ wanted).sum()

    closeness, roughness = [], []
    for distance in (0.6, 0.8, 1.0):
        settings = Tweakables(soft_select_distance=distance)
        fit = fit_offsets(scene.drawn(outline), sphere, FaceParameters(), camera, settings)
        closeness.append(off(sphere.vertices + fit.offsets) / off(sphere.vertices))
        rough = np.linalg.norm(fit.offsets - smoother @ fit.offsets, axis=1).mean()
        roughness.append(rough / np.linalg.norm(fit.offsets, axis=1).mean())
        assert not fit.unmatched
    assert closeness == sorted(closeness) and closeness[0] < 0.4 and closeness[-1] < 0.7
    assert roughness == sorted(roughness, reverse=True) and roughness[-1] < 0.7 * roughness[0]


def test_a_blank_drawing_moves_nothing(scene, ball):
    fit = fit_offsets(np.ones((400, 400)), ball, FaceParameters(), scene.camera())
    assert not fit.offsets.any() and not fit.contours and not fit.unmatched


def test_mirror_makes_the_offsets_symmetrical(scene, ball):
    drawing = scene.ellipse(142, 130)
    drawing[:, :200] = scene.ellipse(130, 130)[:, :200]
    camera, parameters = scene.camera(), FaceParameters()
    plain = fit_offsets(drawing, ball, parameters, camera).offsets
    mirrored = fit_offsets(drawing, ball, parameters, camera, Tweakables(mirror=True)).offsets
    flip = np.array([-1, 1, 1], dtype=np.float32)
    assert np.abs(plain[ball.mirror] * flip - plain).max() > 3e-3
    assert np.abs(mirrored[ball.mirror] * flip - mirrored).max() < 1e-6


def test_a_line_that_the_face_does_not_have_is_unmatched(scene, ball):
    drawing = scene.ellipse(130, 130)
    drawing[180:182, 170:230] = 0.0  # a scar in the middle of a flat region
    fit = fit_offsets(drawing, ball, FaceParameters(), scene.camera())
    assert fit.unmatched
    points = np.concatenate(fit.unmatched)
    scar = (np.abs(points[:, 1] - 181) < 6) & (points[:, 0] > 160) & (points[:, 0] < 240)
    assert scar.mean() > 0.9
    assert np.ptp(points[scar, 0]) > 40


def test_a_line_far_from_the_face_is_unmatched_and_pulls_nothing(scene, ball):
    drawing = scene.ellipse(130, 130)
    plain = fit_offsets(drawing, ball, FaceParameters(), scene.camera())
    far = drawing.copy()
    far[60:64, 60:64] = 1.0
    corner = np.ones_like(drawing)
    corner[66:100, 66:68] = 0.0  # inside the crop's corner, outside the face
    both = fit_offsets(np.minimum(drawing, corner), ball, FaceParameters(), scene.camera())
    assert not plain.unmatched and both.unmatched
    assert np.concatenate(both.unmatched)[:, 0].max() < 80
    assert np.allclose(both.offsets, plain.offsets, atol=1e-6)


def test_the_ground_rises_from_the_outline(scene, ball):
    small = scene.camera().cropped(50, 50, 350, 350, 91, 200)
    render = expression_render(ball, ball.vertices, small)
    assert render.lines.shape == render.shading.shape == render.covered.shape == (200, 91)
    row = render.lines[100]
    outline = int(np.argmin(row[:45]))
    assert abs(outline - (50 + 20 - 50) * 91 / 300) < 2  # the sphere's left edge is at u = 70
    assert np.all(np.diff(row[:outline]) < 0)
    assert not render.movable[ball.vertices[:, 2] < -0.01].any()
    assert render.movable[ball.vertices[:, 2] > 0.03].all()


def test_a_drawing_of_another_size_and_a_face_out_of_sight_are_refused(scene, ball):
    with pytest.raises(ValueError, match="400x400"):
        fit_offsets(np.ones((300, 400)), ball, FaceParameters(), scene.camera())
    away = Camera(400, 400, (1300.0, 1300.0), (900.0, 200.0))
    with pytest.raises(ValueError, match="outside the sketch"):
        fit_offsets(np.ones((400, 400)), ball, FaceParameters(), away)


@pytest.fixture(scope="module")
def face():
    """The head, wider than the default, drawn by its outline and placed as if aligned."""
    rig = load_rig()
    wide = rig.pose(FaceParameters(identity={"head_fat": 0.8, "head_width": 0.5}))
    camera = Camera.framing(wide, 400, 400)
    seen = silhouette(wide, rig.triangles, camera)
    inner = seen.copy()
    for axis in (0, 1):
        for shift in (-1, 1):
            inner &= np.roll(seen, shift, axis)
    drawing = np.where(seen & ~inner, 0.0, 1.0).astype(np.float32)
    return rig, drawing, camera, seen


def test_a_face_comes_closer_to_another_ones_outline(face):
    rig, drawing, camera, wanted = face
    parameters = FaceParameters()
    fit = fit_offsets(drawing, rig, parameters, camera)
    before = silhouette(rig.pose(parameters), rig.triangles, camera) ^ wanted
    after = silhouette(rig.pose(parameters, fit.offsets), rig.triangles, camera) ^ wanted
    assert after.sum() < 0.6 * before.sum()


def test_offsets_are_for_the_upright_head(face):
    rig, drawing, camera, _ = face
    turned = FaceParameters(head=(0.3, 0.1, 0.1))
    fit = fit_offsets(drawing, rig, turned, camera)
    skin = rig.parts["skin"]
    moved = (rig.pose(turned, fit.offsets) - rig.pose(turned))[skin]
    # In the posed face the skin moves parallel to the picture.
    assert np.abs(moved[:, 2]).max() < 1e-5
    assert np.abs(moved).max() > 1e-3


def test_the_fitted_face_has_no_folds(face):
    rig, drawing, camera, _ = face
    parameters = FaceParameters()
    fit = fit_offsets(drawing, rig, parameters, camera)
    triangles = rig.triangles[rig.parts["skin"][rig.triangles].all(axis=1)]

    def normals(vertices):
        a, b, c = (vertices[triangles[:, k]].astype(float) for k in range(3))
        return np.cross(b - a, c - a)

    before, after = normals(rig.pose(parameters)), normals(rig.pose(parameters, fit.offsets))
    cosine = np.einsum("ij,ij->i", before, after) / (
        np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    )
    assert cosine.min() > 0.0


def test_eyeballs_stay_round_and_teeth_stay(face, rng):
    rig = face[0]
    vertices = rig.neutral()
    eyes = eyeballs(rig)
    assert len(eyes) == 2
    offsets = np.cumsum(rng.normal(size=vertices.shape), axis=0) * 1e-5
    moved = carry_parts(rig, vertices, offsets)
    for eye in eyes:
        assert np.ptp(moved[eye], axis=0) == pytest.approx([0, 0, 0], abs=1e-12)
        assert np.abs(moved[eye]).max() > 0
    assert not moved[rig.parts["teeth"]].any()
    assert np.allclose(moved[rig.parts["skin"]], offsets[rig.parts["skin"]])
    lash = np.flatnonzero(rig.parts["lashes"])[0]
    skin = np.flatnonzero(rig.parts["skin"])
    nearest = skin[np.argmin(np.linalg.norm(vertices[skin] - vertices[lash], axis=1))]
    assert np.allclose(moved[lash], offsets[nearest])


def test_every_snake_type_and_curve_gives_a_finite_face(face):
    rig, drawing, camera, _ = face
    for changes in (
        {"snake_type": "fixed", "soft_select_curve": "smooth"},
        {"snake_type": "periodic", "soft_select_curve": "root"},
        {"soft_select_curve": "sphere", "low_depth_preference": 0.5, "mirror": True},
        {"soft_select_connected": True},
    ):
        fit = fit_offsets(drawing, rig, FaceParameters(), camera, Tweakables(**changes))
        assert np.isfinite(fit.offsets).all() and fit.offsets.any()
        assert list(fit.timings_s) == ["render", "contours", "snakes", "deltas", "offsets"]


def test_connected_a_lip_does_not_pull_the_other_lip(face):
    """One pixel on the lower lip is drawn lower; the upper lip takes part only through the air."""
    rig, _, camera, _ = face
    parameters = FaceParameters()
    posed = rig.pose(parameters)
    small = camera.cropped(*head_box(posed, camera), *WORKING_SIZE)
    movable = expression_render(rig, posed, small).movable
    upper, lower = (rig.landmarks[LANDMARKS.index(name)] for name in ("lip_top", "lip_bottom"))
    pixel = np.floor(small.project(posed[[lower]])).astype(np.intp)
    found = PixelDeltas(pixel, np.array([[0.0, 1.0]]), np.ones(1, dtype=np.intp))
    pulled = {}
    for connected in (False, True):
        settings = Tweakables(soft_select_distance=4.0, soft_select_connected=connected)
        offsets = _apply(found, rig, parameters, posed, movable, small, settings)
        pulled[connected] = -offsets[[lower, upper], 1]
    assert pulled[False][1] > 0.4 * pulled[False][0]
    assert pulled[True][1] < 0.1 * pulled[True][0]
    assert pulled[True][0] > 0.9 * pulled[False][0]


def test_the_skull_takes_broad_shapes_only(rng):
    """A dent over the skull is spread out; the face below the brows keeps what it was given."""
    rig = load_rig()
    smoother = skin_smoother(rig)
    skin = rig.neutral()[rig.parts["skin"]]
    crown = np.argmax(skin[:, 1])
    offsets = np.zeros((len(skin), 3))
    offsets[np.linalg.norm(skin - skin[crown], axis=1) < 0.02] = [0, -0.01, 0]
    below = skin[:, 1] < 0
    offsets[below] = rng.normal(0, 1e-3, (below.sum(), 3))
    even = even_skull(rig, smoother, offsets)
    np.testing.assert_array_equal(even[below], offsets[below])
    dent = np.linalg.norm(even[~below], axis=1)
    assert dent.max() < 0.006
    assert np.linalg.norm(offsets[~below], axis=1).max() == 0.01
    whole = np.tile([0.0, 0.002, 0.0], (len(skin), 1))  # a skull that moves as one is left alone
    np.testing.assert_allclose(even_skull(rig, smoother, whole), whole, atol=1e-9)
