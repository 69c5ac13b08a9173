"""s*(t) and ds*/dt against the paper's developed forms, the chain rule and a camera that moves."""

import numpy as np
import pytest
from scipy.linalg import expm
from sympy import Matrix, Symbol, cos, lambdify, limit, simplify, sin, symbols, zeros

from vsctrl.derive import (
    PIXELS,
    Feature,
    Point,
    interaction_matrix,
    reference,
    rotation_reference,
    translation_reference,
)
from vsctrl.errors import InputError
from vsctrl.symbols import (
    F_x,
    F_y,
    V_x,
    V_y,
    V_z,
    X,
    Y,
    d_x,
    d_y,
    d_z,
    omega,
    r_x,
    r_y,
    r_z,
    t,
    x,
    x_0,
    y,
    y_0,
    z,
    z_0,
)

V, r = (V_x, V_y, V_z), (r_x, r_y, r_z)


@pytest.fixture(scope="module")
def screw():
    return reference(Point(PIXELS), V=V, omega=omega, r=r)


@pytest.fixture(scope="module")
def cube():
    """Section 4.2: the axis is parallel to y at the distance d along the optical axis."""
    return rotation_reference(Point(PIXELS), d=(0, 0, d_z), omega=omega, r=(0, 1, 0))


def test_section_4_1():
    slide = translation_reference(Point(PIXELS), V=(V_x, 0, 0))
    expected = Matrix([(x_0 - V_x * t) / z_0 * F_x, y_0 / z_0 * F_y])
    assert simplify(slide.s - expected) == zeros(2, 1)
    assert simplify(slide.s_dot - Matrix([-F_x * V_x / z_0, 0])) == zeros(2, 1)


def test_section_4_2(cube):
    C, S = cos(omega * t), sin(omega * t)
    depth = x_0 * S + (z_0 - d_z) * C + d_z
    expected = Matrix([(x_0 * C - (z_0 - d_z) * S) / depth * F_x, y_0 / depth * F_y])
    assert simplify(cube.s - expected) == zeros(2, 1)
    assert Matrix([-omega * d_z, 0, 0, 0, omega, 0]).as_immutable() == cube.twist


def test_derivative_of_section_4_2_in_starred_coordinates(cube):
    xs, ys, zs = cube.points[0]
    expected = Matrix(
        [
            -F_x * omega * (xs**2 + zs**2 - d_z * zs) / zs**2,
            -F_y * omega * ys * xs / zs**2,
        ]
    )
    assert simplify(cube.s_dot - expected) == zeros(2, 1)
    assert cube.start == ((x_0, y_0, z_0),)


def test_the_derivative_is_the_interaction_matrix_times_the_screw(screw, vanishes):
    """Along every constant screw: ds*/dt = L(s*, z*) T*."""
    T = Matrix([*V, *(omega * component for component in r)])
    starred = {X: screw.s[0], Y: screw.s[1], z: screw.points[0][2]}
    L = interaction_matrix(Point(PIXELS)).subs(starred)
    assert all(vanishes(entry) for entry in screw.s_dot - L * T)
    # The same with one sign of the screw wrong must not pass.
    assert not vanishes((screw.s_dot - L * T.subs(V_z, -V_z))[0])


def test_a_slow_screw_tends_to_the_translation(screw):
    plain = translation_reference(Point(PIXELS), V=V)
    for slow, straight in zip(screw.points[0], plain.points[0], strict=True):
        assert limit(slow, omega, 0).expand() == straight
    assert plain.s == Matrix(
        [F_x * (x_0 - V_x * t) / (z_0 - V_z * t), F_y * (y_0 - V_y * t) / (z_0 - V_z * t)]
    )


def test_rotation_is_the_screw_of_its_velocity(vanishes):
    d = (d_x, d_y, d_z)
    turn = rotation_reference(Point(PIXELS), d=d, omega=omega, r=r)
    same = reference(Point(PIXELS), V=-omega * Matrix(r).cross(Matrix(d)), omega=omega, r=r)
    assert (turn.twist - same.twist).expand() == zeros(6, 1)
    assert all(vanishes(entry) for entry in turn.points[0] - same.points[0])


@pytest.mark.parametrize("seed", range(20))
def test_against_a_camera_on_the_screw(screw, seed):
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    velocity, start = rng.uniform(-0.05, 0.05, 3), rng.uniform([-0.2, -0.2, 0.7], [0.2, 0.2, 1.2])
    speed, now, focal = rng.uniform(-0.3, 0.3), rng.uniform(0, 2), np.array([700.0, 650.0])
    generator = np.zeros((4, 4))
    generator[:3, :3] = np.cross(np.eye(3), -speed * axis)  # row i is e_i × a: the matrix of a ×
    generator[:3, 3] = -velocity

    def image(when):
        p = expm(generator * when) @ [*start, 1]
        return p[:2] / p[2] * focal

    names = [*V, *r, x_0, y_0, z_0, omega, t, F_x, F_y]
    values = [*velocity, *axis, *start, speed, now, *focal]
    s, s_dot = (lambdify(names, list(vector))(*values) for vector in (screw.s, screw.s_dot))
    np.testing.assert_allclose(s, image(now), atol=1e-9)
    # Central differences, extrapolated: error h⁴ ~ 1e-8 times a small fifth derivative.
    h = 1e-2
    wide = (image(now + h) - image(now - h)) / (2 * h)
    near = (image(now + h / 2) - image(now - h / 2)) / h
    np.testing.assert_allclose(s_dot, (4 * near - wide) / 3, atol=1e-5)


def test_several_points_start_under_their_own_names():
    second = symbols("a b c", positive=True)
    gap = Feature("gap", (second[2] - z,), ((x, y, z), second))
    path = translation_reference(gap, V=V)
    assert path.start[1] == symbols("a_0 b_0 c_0", positive=True)
    assert path.s[0] == Symbol("c_0", positive=True) - z_0
    assert path.s_dot[0] == 0


def test_the_time_may_be_a_number_or_a_difference(cube):
    t_1, t_0 = symbols("t_1 t_0", real=True)
    motion = {"d": (0, 0, d_z), "omega": omega, "r": (0, 1, 0)}
    at = rotation_reference(Point(PIXELS), t=2, **motion)
    assert simplify(at.s_dot - cube.s_dot.subs(t, 2)) == zeros(2, 1)
    later = rotation_reference(Point(PIXELS), t=t_1 - t_0, **motion)
    assert simplify(later.s_dot - later.s.diff(t_1)) == zeros(2, 1)


def test_it_shows_itself_in_a_notebook(cube):
    assert r"\frac{ds^*}{dt}" in cube._repr_latex_()


def test_a_screw_that_depends_on_time_is_refused():
    with pytest.raises(InputError, match="V depends on the time t"):
        translation_reference(Point(PIXELS), V=(cos(t), 0, 0))
    with pytest.raises(InputError, match="has length 2, not 1"):
        reference(Point(PIXELS), V=V, omega=omega, r=(0, 0, 2))
