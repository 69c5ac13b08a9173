"""The loop in six degrees of freedom: M in closed form, the matrix law and its gain limits.

The simulations here are the package's own, where it has the calibration error in question, and
otherwise a fold written out below that shares no code with it.
"""

import math

import numpy as np
import pytest
import sympy as sp
from oracles.se3 import hat, log
from scipy.linalg import expm
from scipy.special import lambertw

import vsctrl as vs
from vsctrl import loop
from vsctrl.errors import InputError
from vsctrl.symbols import F_x, F_y, V_x, V_y, X, Y, k_ff, lam, tau, tau_hat, z

PLACEMENTS = ("measurement", "aligned", "actuator")
TWIST = sp.Matrix(sp.symbols("v_1:7", real=True))
RNG = np.random.default_rng(3)
F = 700.0


def interaction(image, depths, focal):
    """L of image points in pixels as the theory page prints it, (2n, 6)."""
    rows = []
    for (u, v), depth in zip(image, depths, strict=True):
        rows.append([-focal / depth, 0, u / depth, u * v / focal, -(focal + u**2 / focal), v])
        rows.append([0, -focal / depth, v / depth, focal + v**2 / focal, -u * v / focal, -u])
    return np.array(rows)


def seen(n, one_depth):
    image = RNG.uniform(-300, 300, (n, 2))
    return image, np.full(n, 0.7) if one_depth else RNG.uniform(0.4, 2.0, n)


# What M is -------------------------------------------------------------------------------------
@pytest.mark.parametrize("n", [3, 4, 9])
@pytest.mark.parametrize("rho", [0.5, 1.0, 1.7])
def test_a_uniform_depth_error_scales_the_translations_of_any_points(n, rho):
    image, depths = seen(n, one_depth=False)
    L, L_hat = interaction(image, depths, F), interaction(image, rho * depths, F)
    # L is in px/m and px/rad, with a condition number of some 1e3.
    np.testing.assert_allclose(np.linalg.pinv(L_hat) @ L, loop.depth_error_matrix(rho), atol=1e-10)
    np.testing.assert_array_equal(loop.depth_error_matrix(rho), np.diag([rho] * 3 + [1.0] * 3))


@pytest.mark.parametrize("n", [4, 9])
@pytest.mark.parametrize("phi", [0.8, 1.0, 1.3])
@pytest.mark.parametrize("rho", [1.0, 0.7])
def test_a_focal_error_couples_rotation_into_translation_at_one_depth(n, phi, rho):
    image, depths = seen(n, one_depth=True)
    L, L_hat = interaction(image, depths, F), interaction(image, rho * depths, phi * F)
    M = loop.depth_error_matrix(rho) @ loop.focal_error_matrix(phi, 0.7)
    np.testing.assert_allclose(np.linalg.pinv(L_hat) @ L, M, atol=1e-10)


def test_a_focal_error_is_no_scalar_and_the_theory_page_s_kappa_holds_for_slides_only():
    M = loop.focal_error_matrix(1.25, 0.7)
    assert np.abs(M - np.eye(6) / 1.25).max() > 0.2
    image, depths = seen(6, one_depth=False)  # translations along x and y at any depths
    L, L_hat = interaction(image, 1.1 * depths, 1.25 * F), interaction(image, depths, F)
    M = np.linalg.pinv(L) @ L_hat
    slide = np.array([0.3, -0.2, 0, 0, 0, 0])
    np.testing.assert_allclose(M @ slide, 1.1 / 1.25 * slide, atol=1e-12)
    np.testing.assert_allclose(M[:, 5], np.eye(6)[5], atol=1e-11)


def test_a_focal_error_at_different_depths_is_refused_since_m_is_then_no_matrix_for_all():
    with pytest.raises(InputError, match=r"not the same wherever .* list in common"):
        loop.calibration_matrix(vs.derive.Point(vs.derive.PIXELS), {F_x: 1.2 * F_x, F_y: 1.2 * F_y})


def test_of_all_planes_only_those_of_one_depth_have_such_a_matrix():
    """1/Z = aX + bY + c: the column of Ωy of L̂ is one of those of L combined for a = b = 0 only."""
    a, b, c, phi = sp.symbols("a b c phi", positive=True)
    n = sp.symbols("n:6")

    def equations(a, b):
        inverse = a * X + b * Y + c
        L = sp.Matrix(
            [[-inverse, 0, X * inverse, X * Y, -(1 + X**2), Y],
             [0, -inverse, Y * inverse, 1 + Y**2, -X * Y, -X]]
        )  # fmt: skip
        modelled = sp.Matrix([-(phi + X**2 / phi), -X * Y / phi])
        return [e for row in L * sp.Matrix(n) - modelled for e in sp.Poly(row, X, Y).coeffs()]

    assert sp.linsolve(equations(a, b), *n) == sp.linsolve(equations(a, 0), *n) == sp.S.EmptySet
    assert sp.linsolve(equations(0, b), *n) == sp.S.EmptySet
    assert sp.linsolve(equations(0, 0), *n) != sp.S.EmptySet


def test_other_features_have_their_own():
    rho = sp.Symbol("rho", positive=True)
    found = loop.calibration_matrix(vs.derive.Point(), {z: rho * z})
    assert found == sp.diag(rho, rho, rho, 1, 1, 1)
    with pytest.raises(InputError, match="never see all directions"):
        loop.calibration_matrix(vs.derive.VanishingPoint(), {})
    with pytest.raises(InputError, match="not rational in"):
        loop.calibration_matrix(vs.derive.PolarPoint(), {})


# The matrix law --------------------------------------------------------------------------------
@pytest.mark.parametrize("placement", PLACEMENTS)
@pytest.mark.parametrize("matrix", ["any", "depth", "focal"])
def test_the_law_stands_still_in_the_equations_of_motion(placement, matrix):
    """ξ′ = T − T*, T = −λM(ξ − τT* where the image is late) + k_ff M T*, with ξ′ = 0."""
    M = {
        "any": sp.Matrix(2, 2, sp.symbols("m:4")),
        "depth": loop.depth_error_matrix(),
        "focal": loop.focal_error_matrix(),
    }[matrix]
    T = TWIST[: M.rows, :]
    xi = loop.steady_lag(loop.diagram(placement), M, T)
    late = tau * T if placement == "measurement" else sp.zeros(M.rows, 1)
    applied = -lam * M * (xi - late) + k_ff * M * T
    assert (applied - T).applyfunc(sp.simplify) == sp.zeros(M.rows, 1)
    law = late - (lam * M).inv() * (sp.eye(M.rows) - k_ff * M) * T
    assert (xi - law).applyfunc(sp.simplify) == sp.zeros(M.rows, 1)


def test_a_multiple_of_the_identity_is_six_copies_of_figure_1():
    known = {"lam": 2.5, "tau": 0.08, "k_ff": 0.4}
    twist = np.array([0.04, 0.01, -0.02, 0.1, -0.2, 0.3])
    for placement in PLACEMENTS:
        one = float(loop.tracking_error(vs.Ramp(1), placement, kappa=1.3, **known))
        six = loop.steady_lag(loop.diagram(placement), 1.3 * np.eye(6), twist, **known)
        np.testing.assert_allclose(six, one * twist, rtol=1e-13)


def test_any_diagram_has_its_matrix_law_a_predictor_too():
    M = sp.Matrix(2, 2, sp.symbols("m:4"))
    T = TWIST[:2, :]
    xi = loop.steady_lag(loop.smith(), M, T)
    law = tau * T - M.inv() * (tau_hat * T + (sp.eye(2) - k_ff * M) * T / lam)
    assert (xi - law).applyfunc(sp.simplify) == sp.zeros(2, 1)
    assert loop.steady_lag(loop.pi(), M, T) == tau * T


# Against simulations ---------------------------------------------------------------------------
@pytest.mark.parametrize("placement", PLACEMENTS)
@pytest.mark.parametrize("rho", [0.8, 1.0, 1.3])
@pytest.mark.parametrize("feed", [0.0, 1.0])
def test_the_slide_of_the_paper_lags_as_the_law_says(placement, rho, feed):
    scenario = vs.paper.sliding(placement=placement).with_(depth_ratio=rho, k_ff=feed)
    lag = vs.simulate(scenario).lag[-1]
    law = loop.steady_lag(
        loop.diagram(placement), loop.depth_error_matrix(rho), [0.04, 0, 0, 0, 0, 0],
        lam=scenario.law.lam, tau=0.08, k_ff=feed,
    )  # fmt: skip
    # After 9 s e^{−1.9·9} = 4e-8 of the lag of 20 mm is left of the transient.
    np.testing.assert_allclose(lag, law, atol=2e-9)


def fold(points, twist, *, phi, rho, gain, feed, samples, frames):
    """Lag after some frames of 40 ms: camera (R, p) stepped by expm, L̂ at the desired image."""

    def look(pose):
        p = (points - pose[:3, 3]) @ pose[:3, :3]
        return F * p[:, :2] / p[:, 2:], p[:, 2]

    step = expm(hat(twist) * 0.04)
    pose = reference = np.eye(4)
    images = []
    for _ in range(frames):
        images.append(look(pose)[0])
        image, depths = look(reference)
        wanted = interaction(image, depths, F) @ twist
        late = images[max(0, len(images) - 1 - samples)]
        L_hat = interaction(image, rho * depths, phi * F)
        error = (late - image).ravel()
        T = np.linalg.lstsq(L_hat, feed * wanted - gain * error, rcond=None)[0]
        pose, reference = pose @ expm(hat(T) * 0.04), reference @ step
    return log(np.linalg.inv(reference) @ pose)


@pytest.mark.parametrize("feed", [0.0, 1.0])
@pytest.mark.parametrize(("phi", "rho"), [(1.2, 1.0), (0.85, 1.1)])
def test_a_slide_with_a_wrong_focal_length_lags_as_the_law_says_at_any_depths(phi, rho, feed):
    points = np.array([[-0.2, -0.2, 0.6], [0.2, -0.15, 0.8], [0.25, 0.2, 0.7], [-0.2, 0.2, 1.0]])
    twist = np.array([0.03, -0.02, 0, 0, 0, 0])
    lag = fold(points, twist, phi=phi, rho=rho, gain=2.5, feed=feed, samples=2, frames=400)
    law = loop.steady_lag(loop.figure1, rho / phi * np.eye(6), twist, lam=2.5, tau=0.08, k_ff=feed)
    np.testing.assert_allclose(lag, law, atol=1e-11)


@pytest.mark.parametrize("feed", [0.0, 1.0])
def test_any_small_twist_lags_as_the_law_says_up_to_its_square(feed):
    points = np.array([[-0.2, -0.2, 0.7], [0.2, -0.15, 0.7], [0.25, 0.2, 0.7], [-0.2, 0.2, 0.7]])
    M = loop.depth_error_matrix(1.1) @ loop.focal_error_matrix(1.2, 0.7)
    direction = np.array([0.5, -0.3, 0.2, 1.0, -0.7, 0.4])
    away = []
    for size in (4e-5, 2e-5):
        twist = size * direction
        lag = fold(points, twist, phi=1.2, rho=1.1, gain=2.5, feed=feed, samples=2, frames=300)
        law = loop.steady_lag(loop.figure1, M, twist, lam=2.5, tau=0.08, k_ff=feed)
        away.append(np.abs(lag - law).max())
        assert away[-1] < 5e-3 * np.abs(law).max()
    assert away[0] / away[1] == pytest.approx(4, rel=0.05)


# Gain limits -----------------------------------------------------------------------------------
def randoms():
    """Matrices with complex eigenvalues in the right half-plane."""
    rngs = [np.random.default_rng(seed) for seed in range(6)]
    return [np.eye(6) + 0.25 * rng.standard_normal((6, 6)) for rng in rngs]


@pytest.mark.parametrize("M", randoms())
def test_the_continuous_limit_is_where_a_root_of_lambert_crosses(M):
    limit = loop.matrix_gain_limit(M, 0.08)

    def rightmost(gain):
        x = -gain * 0.08 * np.linalg.eigvals(M)
        return max(lambertw(x, k).real.max() for k in range(-3, 4))

    assert rightmost(limit * (1 - 1e-7)) < 0 < rightmost(limit * (1 + 1e-7))


@pytest.mark.parametrize("M", randoms())
@pytest.mark.parametrize("samples", [0, 1, 2, 3])
def test_the_sampled_limit_is_where_the_whole_recursion_leaves_the_circle(M, samples):
    limit = loop.matrix_gain_limit(M, samples * 0.04, period=0.04)

    def radius(gain):
        """ξ ← ξ − λTₛMξ, d samples late, as one matrix of 6(d + 1) rows."""
        n = 6 * (samples + 1)
        whole = np.eye(n, k=-6)
        whole[:6] = 0
        whole[:6, :6] += np.eye(6)
        whole[:6, -6:] -= gain * 0.04 * M
        return np.abs(np.linalg.eigvals(whole)).max()

    assert radius(limit * (1 - 1e-6)) < 1 < radius(limit * (1 + 1e-6))
    assert radius(limit * 0.5) < 1


def test_a_uniform_depth_error_limits_as_the_larger_of_it_and_one():
    for rho in (0.5, 1.0, 1.6):
        found = loop.matrix_gain_limit(loop.depth_error_matrix(rho), 0.08, 0.04)
        expected = loop.gain_limit(0.08, period=0.04, kappa=max(rho, 1.0))
        assert found == pytest.approx(expected, rel=1e-13)


def test_a_direction_that_is_driven_away_or_not_at_all_leaves_no_stable_gain():
    assert loop.matrix_gain_limit(np.diag([1.0, -0.1]), 0.08) == 0
    assert loop.matrix_gain_limit(np.diag([1.0, 0.0]), 0.08) == 0
    assert loop.matrix_gain_limit([[0.0, 1.0], [-1.0, 0.0]], 0.08, period=0.04) == 0
    assert loop.matrix_gain_limit(np.eye(2), 0.0) == math.inf


def test_independent_depth_errors_of_two_per_cent_destabilise_a_centred_square():
    """Alternating errors turn an eigenvalue of M over; the same for all points they do no harm."""
    square = np.array([[-0.1, -0.1, 0.8], [0.1, -0.1, 0.8], [0.1, 0.1, 0.8], [-0.1, 0.1, 0.8]])
    image, depths = F * square[:, :2] / 0.8, square[:, 2]
    alternating = 1 + 0.02 * np.array([1, -1, 1, -1])

    def limit(rho):
        M = np.linalg.pinv(interaction(image, rho * depths, F)) @ interaction(image, depths, F)
        return loop.matrix_gain_limit(M, 0.08, 0.04)

    assert limit(alternating) == 0
    assert limit(1.02) == pytest.approx(loop.gain_limit(0.08, period=0.04, kappa=1.02), rel=1e-9)
    known = {"phi": 1.0, "gain": 0.5, "feed": 1.0, "samples": 2}
    slow = 1e-7 * np.array([1.0, -1.0, 0, 0, 0, 0])  # along the left eigenvector of that eigenvalue
    early, late = (
        np.abs(fold(square, slow, rho=alternating, frames=n, **known)).max() for n in (60, 120)
    )
    assert late > 10 * early
    early, late = (np.abs(fold(square, slow, rho=1.02, frames=n, **known)).max() for n in (60, 120))
    assert late < 2 * early


# Bad input -------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda: loop.steady_lag(loop.figure1, np.eye(6), [1, 2]), "6×6 and the twist has 2"),
        (lambda: loop.steady_lag(loop.figure1, [[1, 2]], [1]), "M is 1×2; give the square"),
        (
            lambda: loop.steady_lag(loop.figure1, np.eye(2) * math.nan, [1, 2]),
            r"M = (?s:.*)not usable",
        ),
        (lambda: loop.steady_lag(loop.figure1, [["1"]], [1]), "M = .*not usable; give finite"),
        (lambda: loop.steady_lag(loop.figure1, [[1, 2], [1]], [1, 2]), "M = .*rows of one"),
        (lambda: loop.steady_lag(loop.figure1, np.eye(2), ["1", 2]), "twist = .*not usable"),
        (lambda: loop.steady_lag(2.5, np.eye(2), [1, 2]), "2.5 is no diagram"),
        (lambda: loop.calibration_matrix(vs.derive.Point(), {z: "2*z"}), "not usable; give sym"),
        (lambda: loop.steady_lag(loop.figure1, np.eye(2), [1, 2], kappa=1), "kappa is the matrix"),
        (
            lambda: loop.steady_lag(loop.figure1, np.zeros((2, 2)), [1, 2], lam=1, tau=0, k_ff=1),
            "M is singular",
        ),
        (
            lambda: loop.steady_lag(loop.figure1, sp.ones(2, 2), [V_x, V_y]),
            "M is singular",
        ),
        (lambda: loop.matrix_gain_limit(sp.diag(lam, 1), 0.08), "holds symbols"),
        (lambda: loop.matrix_gain_limit(np.ones((2, 3)), 0.08), "M is 2×3"),
        (lambda: loop.matrix_gain_limit("M", 0.08), "M = 'M' is not usable"),
        (lambda: loop.depth_error_matrix(0), r"depth_error_matrix: rho = 0.*above 0"),
        (lambda: loop.focal_error_matrix(1.1, -1), r"focal_error_matrix: depth = -1.*above 0"),
        (lambda: loop.gain_limit(0.08, kappa=complex(math.nan, 1)), r"kappa = .*finite"),
    ],
)
def test_what_cannot_be_used_is_refused_with_a_sentence(ask, message):
    with pytest.raises(InputError, match=message):
        ask()


def test_a_diagram_without_calibration_has_no_matrix_law():
    plain = vs.Diagram([vs.Block("g", 1 / (lam * vs.symbols.s), "u -> y")])
    with pytest.raises(InputError, match="no function of κ"):
        loop.steady_lag(plain, np.eye(6), np.ones(6))
