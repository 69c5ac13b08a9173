"""The camera against geometry worked by hand, and L against differences of its own images."""

import numpy as np
import pytest

from vsctrl.errors import InputError
from vsctrl.servo import CUBE_LEDS, Camera, ConstantScrew, Target, pose

CAMERA = Camera(700.0, 500.0)


def test_the_leds_seen_from_in_front_of_the_cube():
    # 0.77 m before the centre, 0.645 m before the face: X = 700 · 0.125/0.645, Y = 500 · 0.075/…
    view = CAMERA.view(pose.from_euler_xyz([0, 0, -0.77], [0, 0, 0]), CUBE_LEDS.points)
    X, Y = 700 * 0.125 / 0.645, 500 * 0.075 / 0.645
    np.testing.assert_allclose(view.features, [-X, -Y, X, -Y, X, Y, -X, Y], rtol=1e-14)
    np.testing.assert_allclose(view.depths, 0.645, rtol=1e-14)


def test_a_camera_turned_by_a_quarter_about_its_axis():
    # Its x axis lies along the object's y: X = Fx y/z, Y = −Fy x/z.
    oTc = pose.from_euler_xyz([0, 0, -1.125], [0, 0, 90])
    view = CAMERA.view(oTc, CUBE_LEDS.points)
    np.testing.assert_allclose(view.features[:2], [-700 * 0.075, 500 * 0.125], rtol=1e-13)


def test_a_camera_that_moves_right_sees_the_point_move_left():
    here = CAMERA.view(pose.from_euler_xyz([0, 0, -0.77], [0, 0, 0]), CUBE_LEDS.points)
    right = CAMERA.view(pose.from_euler_xyz([0.01, 0, -0.77], [0, 0, 0]), CUBE_LEDS.points)
    np.testing.assert_allclose((right.features - here.features)[::2], -700 * 0.01 / 0.645)


def test_interaction_matrix_is_the_derivative_of_the_image_along_each_twist():
    oTc = pose.from_euler_xyz([-0.174, 0.044, -0.77], [2, 4.2, -0.2])
    view = CAMERA.view(oTc, CUBE_LEDS.points)
    L = CAMERA.interaction(*view)
    h = 1e-5  # central differences: h² truncation and eps/h rounding both below 1e-6 px here
    for j, T in enumerate(np.eye(6)):
        ahead = CAMERA.view(oTc @ pose.exp(h * T), CUBE_LEDS.points).features
        behind = CAMERA.view(oTc @ pose.exp(-h * T), CUBE_LEDS.points).features
        np.testing.assert_allclose(L[:, j], (ahead - behind) / (2 * h), atol=1e-5)


def test_batches_are_the_single_results():
    oTc = ConstantScrew(pose.from_euler_xyz([0, 0, -1], [1, 2, 3]), np.full(6, 0.1)).pose(
        np.linspace(0, 1, 5)
    )
    view = CAMERA.view(oTc, CUBE_LEDS.points)
    L = CAMERA.interaction(*view)
    assert view.features.shape == (5, 8)
    assert view.depths.shape == (5, 4)
    assert L.shape == (5, 8, 6)
    for k in range(5):
        one = CAMERA.view(oTc[k], CUBE_LEDS.points)
        np.testing.assert_allclose(view.features[k], one.features, rtol=1e-13)
        np.testing.assert_allclose(L[k], CAMERA.interaction(*one), rtol=1e-12, atol=1e-9)


def test_a_point_behind_the_camera_has_no_image():
    with pytest.raises(InputError, match=r"oTc: .* depth -0\.048 m.*choose a pose"):
        CAMERA.view(pose.from_euler_xyz([0, 0, -0.077], [0, 0, 0]), CUBE_LEDS.points)


def test_a_target_is_a_list_of_points_that_cannot_be_changed():
    with pytest.raises(InputError, match=r"points: .*shape \(4,\).*give \(n, 3\)"):
        Target(np.zeros(4))
    with pytest.raises(ValueError, match="read-only"):
        CUBE_LEDS.points[0, 0] = 1.0


def test_the_derivative_of_the_reference_pose_is_its_twist():
    T = np.array([0.1, -0.2, 0.3, 0.4, 0.5, -0.6])
    screw = ConstantScrew(pose.from_euler_xyz([1, 2, 3], [4, 5, 6]), T)
    t, h = np.array([0.0, 0.7]), 1e-6
    np.testing.assert_allclose(
        pose.log(pose.inverse(screw.pose(t - h)) @ screw.pose(t + h)) / (2 * h),
        screw.twist(t),
        atol=1e-8,
    )
