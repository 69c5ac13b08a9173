"""Features of poses against poses that move, SciPy's rotation vectors and ViSP's matrices."""

import warnings
from functools import cache

import numpy as np
import pytest
from oracles.moving import COLUMNS, finite_difference, reframed
from scipy.spatial.transform import Rotation
from sympy import eye, lambdify

from vsctrl.derive import Feature, ThetaU, Translation, emit, interaction_matrix
from vsctrl.errors import InputError

SIZE = 120
ROTATIONS = ("cdRc", "cRcd")
FRAMES = ("cdtc", "ctcd", "cto")


def poses(rng, angle=None, size=SIZE):
    """cMcd, (size, 4, 4), turned by the angle, or by up to 3 rad, about any axis."""
    axis = rng.normal(size=(size, 3))
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    angles = rng.uniform(0.1, 3, size) if angle is None else np.full(size, angle)
    cMcd = np.broadcast_to(np.eye(4), (size, 4, 4)).copy()
    cMcd[:, :3, :3] = Rotation.from_rotvec(axis * angles[:, None]).as_matrix()
    cMcd[:, :3, 3] = rng.uniform(-1, 1, (size, 3))
    return cMcd


def theta_u(rotation):
    """(3, n) of cMcd, by SciPy."""

    def measure(cMcd):
        R = cMcd[:, :3, :3]
        if rotation == "cdRc":
            R = np.swapaxes(R, 1, 2)
        return Rotation.from_matrix(R).as_rotvec().T

    return measure


def translation(frame):
    def measure(cMcd):
        M = np.linalg.inv(cMcd) if frame == "cdtc" else cMcd
        return M[:, :3, 3].T

    return measure


@cache
def compiled(feature):
    return lambdify(feature.arguments, interaction_matrix(feature).tolist(), cse=True)


def evaluated(feature, values):
    """(k, 6, n) in doubles, through SymPy's own printer."""
    L = compiled(feature)(*values)
    shape = np.broadcast(*values).shape
    return np.array([[np.broadcast_to(e, shape) for e in row] for row in L], dtype=float)


def cross_matrices(a):
    """[a]×, (n, 3, 3) of (3, n)."""
    x, y, z = a
    o = np.zeros_like(x)
    return np.moveaxis(np.array([[o, -z, y], [z, o, -x], [-y, x, o]]), 2, 0)


def visp_theta_u(rotation, s):
    """vpFeatureThetaU::interaction, https://github.com/lagadic/visp."""
    theta = np.linalg.norm(s, axis=0)
    u = cross_matrices(s / theta)

    def sinc(a):
        return np.sin(a) / a

    factor = 1 - sinc(theta) / sinc(theta / 2) ** 2
    U2 = np.eye(3) + factor[:, None, None] * (u @ u)
    Lw = cross_matrices(s / 2) + (U2 if rotation == "cdRc" else -U2)
    return np.moveaxis(np.concatenate([np.zeros_like(Lw), Lw], axis=2), 0, 2)


@pytest.mark.parametrize("angle", [None, 1e-2, 1e-5, 3.1])
@pytest.mark.parametrize("rotation", ROTATIONS)
def test_theta_u_is_the_rate_of_a_camera_that_turns(rotation, angle):
    where, measure = poses(np.random.default_rng(31), angle), theta_u(rotation)
    L = evaluated(ThetaU(rotation), measure(where))
    for column in range(6):
        rate = finite_difference(measure, where, column, 1e-3, reframed)
        # Roundings of s over h leave 1e-12; h⁴ = 1e-12 times a fifth derivative.
        np.testing.assert_allclose(L[:, column], rate, atol=1e-8, err_msg=COLUMNS[column])


@pytest.mark.parametrize("rotation", ROTATIONS)
def test_theta_u_is_the_matrix_of_visp(rotation):
    rng = np.random.default_rng(32)
    s = theta_u(rotation)(poses(rng))
    # Also beyond π, where no rotation matrix leads, as far as the singularity at 2π.
    for values in (s, s * 2):
        ours, published = evaluated(ThetaU(rotation), values), visp_theta_u(rotation, values)
        np.testing.assert_allclose(ours, published, rtol=1e-11, atol=1e-14)


@pytest.mark.parametrize("rotation", ROTATIONS)
def test_theta_u_is_regular_at_the_goal(rotation):
    feature, sign = ThetaU(rotation), 1 if rotation == "cdRc" else -1
    exact = feature.interaction.subs(dict.fromkeys(feature.arguments, 0))
    assert exact[:, 3:] == sign * eye(3) and exact[:, :3].is_zero_matrix
    namespace = {}
    exec(emit(feature), namespace)
    printed = namespace[f"theta_u_{rotation}_interaction"]
    expected = np.hstack([np.zeros((3, 3)), sign * np.eye(3)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for nothing in (0.0, np.zeros(4), np.float64(0), 1e-200, 1e-160, np.full(2, 1e-155), 5e-9):
            L = printed(nothing, nothing, nothing)
            # Of first order in s.
            np.testing.assert_allclose(L, np.broadcast_to(expected, L.shape), atol=6e-9)


@pytest.mark.parametrize("rotation", ROTATIONS)
def test_theta_u_is_regular_at_pi_and_singular_at_two_pi(rotation):
    feature, sign = ThetaU(rotation), 1 if rotation == "cdRc" else -1
    half, whole = ([[0.0], [angle], [0.0]] for angle in (np.pi, 2 * np.pi - 1e-6))
    # At π about y, the factor of [u]×² is 1: L_ω = ±u uᵀ + [θu]×/2.
    expected = [[0, 0, np.pi / 2], [0, sign, 0], [-np.pi / 2, 0, 0]]
    at = evaluated(feature, np.array(half))[:, 3:, 0]
    np.testing.assert_allclose(at, expected, atol=1e-15)
    assert np.max(np.abs(evaluated(feature, np.array(whole)))) > 1e6


@pytest.mark.parametrize("rotation", ROTATIONS)
def test_a_small_angle_is_right_to_second_order(rotation):
    """L_ω = ±(I + [s]×²/12) + [s]×/2 up to s⁴/720."""
    rng, sign = np.random.default_rng(33), 1 if rotation == "cdRc" else -1
    for size in (1e-1, 1e-2, 1e-3):
        s = rng.uniform(-size, size, (3, SIZE))
        S = cross_matrices(s)
        series = np.moveaxis(sign * (np.eye(3) + S @ S / 12) + S / 2, 0, 2)
        ours = evaluated(ThetaU(rotation), s)[:, 3:]
        np.testing.assert_allclose(ours, series, atol=9 * size**4 / 720 + 1e-15)


@pytest.mark.parametrize("angle", [None, 0.0, 1e-7, np.pi])
@pytest.mark.parametrize("frame", FRAMES)
def test_translation_is_the_rate_of_a_camera_that_moves(frame, angle):
    where, measure = poses(np.random.default_rng(34), angle), translation(frame)
    feature = Translation(frame)
    values = measure(where)
    if frame == "cdtc":
        values = np.concatenate([values, theta_u("cdRc")(where)])
    L = evaluated(feature, values)
    for column in range(6):
        rate = finite_difference(measure, where, column, 1e-3, reframed)
        # s is linear or sinusoidal in the motion; 1e-16 of it over h.
        np.testing.assert_allclose(L[:, column], rate, atol=3e-12, err_msg=COLUMNS[column])


def test_translation_is_the_matrix_of_visp():
    """vpFeatureTranslation: [cdRc 0] for cdMc, [−I [t]×] for cMcd and cMo."""
    where = poses(np.random.default_rng(35))
    zero, cdRc = np.zeros((SIZE, 3, 3)), np.swapaxes(where[:, :3, :3], 1, 2)
    s = np.concatenate([translation("cdtc")(where), theta_u("cdRc")(where)])
    published = np.moveaxis(np.concatenate([cdRc, zero], axis=2), 0, 2)
    np.testing.assert_allclose(evaluated(Translation(), s), published, atol=1e-14)
    for frame in ("ctcd", "cto"):
        t = translation(frame)(where)
        minus = np.broadcast_to(-np.eye(3), (SIZE, 3, 3))
        published = np.moveaxis(np.concatenate([minus, cross_matrices(t)], axis=2), 0, 2)
        np.testing.assert_array_equal(evaluated(Translation(frame), t), published)


@pytest.mark.parametrize("rotation", ROTATIONS)
@pytest.mark.parametrize("frame", ["cdtc", "ctcd"])
def test_pose_servoing_decays_to_the_goal(frame, rotation):
    """T = −λ L⁺ e with e = s − s*, s* = 0, in small steps: |e| falls as exp(−λ t)."""
    where = poses(np.random.default_rng(36), size=1)
    features, measures = (
        (Translation(frame), ThetaU(rotation)),
        (
            translation(frame),
            theta_u(rotation),
        ),
    )
    start = np.concatenate([m(where)[:, 0] for m in measures])
    for _ in range(200):
        t, r = (m(where) for m in measures)
        cdRc = theta_u("cdRc")(where)
        L = np.concatenate(
            [
                evaluated(features[0], [*t, *cdRc] if frame == "cdtc" else t)[..., 0],
                evaluated(features[1], r)[..., 0],
            ]
        )
        twist = -np.linalg.solve(L, np.concatenate([t, r])[:, 0])
        for column in range(6):
            where = reframed(where, column, 0.01 * twist[column])
    left = np.concatenate([m(where)[:, 0] for m in measures])
    # Steps of 0.01 taken one axis after the other are of first order.
    np.testing.assert_allclose(np.linalg.norm(left), np.exp(-2) * np.linalg.norm(start), rtol=0.05)


def test_the_arguments_and_names_say_what_they_are():
    for rotation in ROTATIONS:
        feature = ThetaU(rotation)
        assert feature.name == f"theta_u_{rotation}"
        assert " ".join(map(str, feature.arguments)) == "thetau_x thetau_y thetau_z"
        assert interaction_matrix(feature).free_symbols == set(feature.arguments)
        assert feature == ThetaU(rotation) and hash(feature) == hash(ThetaU(rotation))
    assert str(Translation("cto").arguments) == str(Translation("ctcd").arguments)
    assert " ".join(map(str, Translation().arguments)) == "t_x t_y t_z thetau_x thetau_y thetau_z"
    assert isinstance(Translation(), Feature)


def test_an_unknown_convention_ends_in_a_sentence():
    with pytest.raises(InputError, match=r"rotation = 'cdrc' .*did you mean 'cdRc'.*choose one of"):
        ThetaU("cdrc")
    with pytest.raises(InputError, match="frame = 'cdMc' is no frame of a pose feature"):
        Translation("cdMc")
