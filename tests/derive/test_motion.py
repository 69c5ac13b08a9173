"""The motion of a point against the matrix exponential, the differential equation and the paper."""

import math
import re

import numpy as np
import pytest
from scipy.linalg import expm
from sympy import Matrix, Rational, cos, diff, eye, limit, simplify, sin, zeros

from vsctrl.derive import point_motion, rotation, rotation_about, skew
from vsctrl.errors import InputError
from vsctrl.symbols import V_x, V_y, V_z, d_x, d_y, d_z, omega, r_x, r_y, r_z, t, x, y, z

p, V, r, d = Matrix([x, y, z]), Matrix([V_x, V_y, V_z]), Matrix([r_x, r_y, r_z]), [d_x, d_y, d_z]
SEEDS = range(30)


def cross_matrix(a):
    """r̃ as printed under eq. 11."""
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def unit(rng):
    a = rng.normal(size=3)
    return a / np.linalg.norm(a)


def eq_17(about):
    """p + G (p − about) with G = −sin ωt r̃ + (1 − cos ωt) r̃², by cross products only."""
    arm = p - Matrix(about)
    once = r.cross(arm)
    return p - sin(omega * t) * once + (1 - cos(omega * t)) * r.cross(once)


def test_skew_is_the_printed_matrix():
    assert skew(r).tolist() == cross_matrix((r_x, r_y, r_z)).tolist()


@pytest.mark.parametrize("axis", [(0, 1, 0), (Rational(2, 3), Rational(-1, 3), Rational(2, 3))])
def test_eq_13_is_the_matrix_exponential(axis):
    r_tilde = Matrix(cross_matrix(axis).tolist())
    assert simplify((-t * r_tilde).exp() - rotation(axis, t)) == zeros(3)


@pytest.mark.parametrize("seed", SEEDS)
def test_eq_13_equals_expm_for_a_random_axis(seed):
    rng = np.random.default_rng(seed)
    axis, theta = unit(rng), rng.uniform(-7, 7)
    ours = np.array(rotation(axis, theta).tolist(), dtype=float)
    np.testing.assert_allclose(ours, expm(-theta * cross_matrix(axis)), atol=1e-13)


def test_eq_13_is_a_rotation_for_every_axis(vanishes):
    R = rotation(r, omega * t)
    assert all(vanishes(entry) for entry in R.T * R - eye(3))
    assert vanishes(R.det() - 1)


def test_eq_14_solves_eq_11(vanishes):
    path = point_motion(p, V, omega, r, t)
    assert all(vanishes(entry) for entry in diff(path, t) + V + omega * r.cross(path))
    assert path.subs(t, 0).expand() == p.as_immutable()


@pytest.mark.parametrize("seed", SEEDS)
def test_eq_14_equals_the_exponential_of_the_screw(seed):
    rng = np.random.default_rng(seed)
    axis, speed, elapsed = unit(rng), rng.uniform(-2, 2), rng.uniform(-3, 3)
    start, velocity = rng.normal(size=(2, 3))
    generator = np.zeros((4, 4))
    generator[:3, :3], generator[:3, 3] = -speed * cross_matrix(axis), -velocity
    expected = (expm(generator * elapsed) @ [*start, 1])[:3]
    ours = np.array(point_motion(start, velocity, speed, axis, elapsed), dtype=float).ravel()
    np.testing.assert_allclose(ours, expected, atol=1e-12)


def test_eq_16_is_the_limit_of_eq_14():
    path = point_motion(p, V, omega, r, t)
    assert [limit(entry, omega, 0).expand() for entry in path] == list(p - V * t)


@pytest.mark.parametrize("nothing", [0, 0.0])
def test_without_rotation_eq_14_is_eq_16_exactly(nothing):
    assert point_motion(p, V, nothing, r, t) == (p - V * t).as_immutable()
    assert rotation_about(p, d, nothing, r, t) == p.as_immutable()


def test_eq_17():
    assert (rotation_about(p, d, omega, r, t) - eq_17(d)).expand() == zeros(3, 1)


def test_eq_17_needs_the_opposite_of_the_printed_velocity(vanishes):
    needed = -omega * r.cross(Matrix(d))
    path = point_motion(p, needed, omega, r, t)
    assert all(vanishes(entry) for entry in path - eq_17(d))


def test_the_printed_velocity_turns_about_the_opposite_point(vanishes):
    printed = omega * r.cross(Matrix(d))
    path = point_motion(p, printed, omega, r, t)
    assert all(vanishes(entry) for entry in path - eq_17([-d_x, -d_y, -d_z]))
    assert not any(vanishes(entry) for entry in path - eq_17(d))


def test_the_axis_of_eq_17_stands_still():
    at_axis = rotation_about(d, d, omega, (0, 1, 0), t)
    assert at_axis == Matrix(d).as_immutable()


def test_developed_form_of_section_4_2():
    C, S = cos(omega * t), sin(omega * t)
    expected = Matrix([x * C - (z - d_z) * S, y, x * S + (z - d_z) * C + d_z])
    path = rotation_about(p, (0, 0, d_z), omega, (0, 1, 0), t)
    assert (path - expected).expand() == zeros(3, 1)


@pytest.mark.parametrize(
    ("axis", "sentence"),
    [
        ((0, 2, 0), "The axis r = (0, 2, 0) has length 2, not 1; divide it by its length."),
        ((0, 0.7, 0.7), "has length 0.989949, not 1; divide it by its length."),
        ((2 * cos(t), 0, 2 * sin(t)), "has length 2, not 1"),
        ((0, 0, 0), "has length 0, not 1; for a pure translation give any unit axis and omega = 0"),
        ((0, 1), "r = (0, 1) is not a vector; give its three components."),
        ("xyz", "r = 'xyz' is not a vector"),
        (1, "r = 1 is not a vector"),
        (("r_x", 0, 0), "r[0] = 'r_x' is not a finite number or a SymPy expression"),
        ((math.nan, 0, 0), "r[0] = nan is not a finite number"),
        ((0, math.inf, 0), "r[1] = inf is not a finite number"),
    ],
)
def test_a_bad_axis_ends_in_a_sentence(axis, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)):
        rotation(axis, 1)


def test_a_screw_that_depends_on_time_is_refused():
    with pytest.raises(InputError, match="V depends on the time t, but eq"):
        point_motion(p, (cos(t), 0, 0), omega, r, t)
    with pytest.raises(InputError, match="omega depends on the time t"):
        rotation_about(p, d, omega * t, r, t)


def test_an_axis_along_numpy_rounding_is_accepted():
    axis = np.array([1.0, 2.0, 3.0]) / np.sqrt(14)
    assert rotation(axis, 0).shape == (3, 3)
