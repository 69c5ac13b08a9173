"""SE(3) against SciPy's dense matrix functions and mpmath, which share no formula with it."""

import math

import mpmath
import numpy as np
import pytest
from oracles.se3 import hat
from scipy.linalg import expm, logm
from scipy.spatial.transform import Rotation

from vsctrl.servo import pose

RNG = np.random.default_rng(7)


def twist(angle):
    axis = RNG.normal(size=3)
    return np.concatenate([RNG.normal(size=3), angle * axis / np.linalg.norm(axis)])


ANGLES = [0.0, 1e-300, 1e-12, 1e-6, 1e-3, 0.5, 1 - 1e-15, 1.0, 1 + 1e-15, 2.0, 3.0]
NEAR_PI = [math.pi - 1e-3, math.pi - 1e-7, math.pi - 1e-12, math.pi]


@pytest.mark.parametrize("angle", [*ANGLES, *NEAR_PI, 5.0, 20.0])
def test_exp_is_the_matrix_exponential(angle):
    for T in (twist(angle) for _ in range(10)):
        # expm scales and squares: a few ulp per squaring.
        np.testing.assert_allclose(pose.exp(T), expm(hat(T)), atol=1e-14 * (1 + angle))
        np.testing.assert_allclose(pose.exp_one(T.tolist()), pose.exp(T), atol=4e-15)


@pytest.mark.parametrize("angle", [1e-9, 1e-3, 0.3, 0.99, 1 - 1e-9, 1.0, 1 + 1e-9, 1.01, 3.1])
def test_no_digits_are_lost_where_the_formula_changes(angle):
    # ω along z, v along x: (vx, vy) of the result are a and θ b; v along z is not turned.
    # The coefficient c alone: v perpendicular to ω enters t as c ŵ² v = −c θ² v.
    with mpmath.workdps(40):
        theta = mpmath.mpf(angle)
        c = float((theta - mpmath.sin(theta)) / theta**3)
        d = float((1 - theta * mpmath.sin(theta) / (2 * (1 - mpmath.cos(theta)))) / theta**2)
    _, b, measured_c = pose._coefficients(np.array(angle))
    assert measured_c == pytest.approx(c, rel=4e-15)
    assert b == pytest.approx(2 * math.sin(angle / 2) ** 2 / angle**2, rel=4e-15)
    # and d through log: t = x̂, ω = θ ẑ gives v_x = 1 − d θ².
    oTc = np.eye(4)
    oTc[:3, :3] = Rotation.from_rotvec([0, 0, angle]).as_matrix()
    oTc[0, 3] = 1.0
    assert pose.log(oTc)[0] == pytest.approx(1 - d * angle**2, abs=1e-15)


@pytest.mark.parametrize("angle", [*ANGLES, *NEAR_PI[:-1]])
def test_log_undoes_the_matrix_exponential(angle):
    for T in (twist(angle) for _ in range(10)):
        # Near π a rounding of R moves v by 1/θ of it, not more.
        np.testing.assert_allclose(pose.log(expm(hat(T))), T, atol=3e-14)


def test_log_is_the_matrix_logarithm():
    for angle in (0.2, 1.0, 2.5):
        g = pose.exp(twist(angle))
        np.testing.assert_allclose(hat(pose.log(g)), np.real(logm(g)), atol=1e-13)


def test_log_at_half_a_turn_keeps_the_angle_and_gives_the_motion_back():
    for axis in np.vstack([np.eye(3), RNG.normal(size=(10, 3))]):
        g = np.eye(4)
        g[:3, :3] = Rotation.from_rotvec(np.pi * axis / np.linalg.norm(axis)).as_matrix()
        g[:3, 3] = RNG.normal(size=3)
        T = pose.log(g)
        assert np.linalg.norm(T[3:]) == pytest.approx(np.pi, abs=1e-14)
        np.testing.assert_allclose(expm(hat(T)), g, atol=1e-13)


def test_batches_are_the_single_results():
    T = np.array([[twist(a) for a in (0.0, 1e-8, 0.7)], [twist(a) for a in (1.0, 2.0, 3.1)]])
    g = pose.exp(T)
    assert g.shape == (2, 3, 4, 4)
    for i in np.ndindex(2, 3):
        # BLAS may sum a batch in another order than one matrix: an ulp.
        np.testing.assert_allclose(g[i], pose.exp(T[i]), atol=1e-15)
        np.testing.assert_allclose(pose.log(g)[i], pose.log(g[i]), atol=1e-15)
        np.testing.assert_allclose(pose.adjoint(g)[i], pose.adjoint(g[i]), atol=1e-15)
    np.testing.assert_allclose(pose.inverse(g), np.linalg.inv(g), atol=1e-14)


def test_adjoint_carries_a_twist_through_a_motion():
    g, T = pose.exp(twist(2.0)), twist(0.8)
    np.testing.assert_allclose(
        g @ expm(hat(T)) @ np.linalg.inv(g), expm(hat(pose.adjoint(g) @ T)), atol=1e-13
    )


def test_euler_angles_are_intrinsic_xyz_in_degrees():
    oTc = pose.from_euler_xyz([1, 2, 3], [10, -20, 30])
    expected = Rotation.from_euler("XYZ", [10, -20, 30], degrees=True).as_matrix()
    np.testing.assert_allclose(oTc[:3, :3], expected, atol=1e-15)
    np.testing.assert_array_equal(oTc[:, 3], [1, 2, 3, 1])
    both = pose.from_euler_xyz(np.zeros((2, 3)), [[10, -20, 30], [0, 0, 0]])
    np.testing.assert_allclose(both[0, :3, :3], expected, atol=1e-15)
