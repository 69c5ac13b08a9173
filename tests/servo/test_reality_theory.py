"""The simulator against closed forms: latency of any share of a period, predictor and integral.

On the slide e = L ξ exactly, so that the lag along the motion is figure 1 with a held twist, κ = ρ.
A measurement that is (d + f) periods old is ``(1 − f) S_{k−d} + f S_{k−d−1}``, as the twist is
constant in between; hence the characteristic polynomial ``z^{d+2} − z^{d+1} + κλTₛ((1−f) z + f)``.
"""

import numpy as np
import pytest
from scipy.optimize import brentq

import vsctrl as vs
from vsctrl import paper
from vsctrl.servo import simulate

V, TS, RHO = 0.04, 0.04, 1.15
AGES = [(0, 0.35), (1, 0.0), (1, 0.5), (2, 0.0), (2, 0.25), (3, 0.9)]


def slide(**changes):
    return simulate(paper.sliding().with_(**changes))


def released(lam, *, offset=-0.02, duration=4.0, **changes):
    """Lag along x of a camera that starts beside a reference at rest, (n,) in m."""
    run = slide(
        lam=lam, V=(0, 0, 0), k_ff=0.0, offset=(offset, 0, 0, 0, 0, 0), duration=duration,
        position=(0, 0, -0.77), euler_xyz_deg=(0, 0, 0), **changes,
    )  # fmt: skip
    assert run.status.ok, run.status.sentence
    return run.lag[:, 0]


def delayed(periods):
    """z^{−periods} of a twist that is held: coefficients of z⁰, z⁻¹, …"""
    d = int(periods + 1e-9)
    f = periods - d if periods - d > 1e-9 else 0.0
    return np.array([0.0] * d + [1 - f, f])


def characteristic(gain, periods):
    """``(z − 1) + κλTₛ z^{−periods}`` times a power of z, highest first."""
    out = gain * np.concatenate([[0.0], delayed(periods)])
    out[0] += 1.0
    out[1] -= 1.0
    return np.trim_zeros(out, "b")


def predicted(lam, kappa, periods, believed):
    """The same with a Smith predictor: ``(z−1)(1 + λTₛ W(z)) + κλTₛ z^{−periods}``.

    W = z⁻¹ + z⁻² + … over the believed number of periods, its last term the share that is left.
    """
    n = int(believed + 1e-9)
    W = np.array([0.0, *[1.0] * n, believed - n if believed - n > 1e-9 else 0.0])
    inner = lam * TS * W
    inner[0] += 1.0
    summed = np.convolve([1.0, -1.0], inner)
    late = kappa * lam * TS * np.concatenate([[0.0], delayed(periods)])
    out = np.zeros(max(len(summed), len(late)))
    out[: len(summed)] += summed
    out[: len(late)] += late
    return np.trim_zeros(out, "b")


def left_over(polynomial, S, start):
    """What the recursion of a polynomial leaves of a sequence, from a sample on."""
    out = np.convolve(S, polynomial)[len(polynomial) - 1 : len(S)]
    return out[max(start - len(polynomial) + 1, 0) :]


@pytest.mark.parametrize("placement", ["measurement", "aligned", "actuator"])
@pytest.mark.parametrize(("d", "f"), AGES)
def test_the_lag_obeys_the_recursion_of_any_latency(d, f, placement):
    S = released(
        4.0, latency=(d + f) * TS, depth_ratio=RHO, placement=placement, interaction="desired"
    )
    polynomial = characteristic(RHO * 4.0 * TS, d + f)
    # The measurement before t = 0 is that of t = 0, as though the camera had rested; a late robot
    # rests until its first command. From then on all is rounding of 20 mm.
    np.testing.assert_allclose(left_over(polynomial, S, len(polynomial) + d + 1), 0, atol=1e-13)
    # And of no other: one part in a thousand of a period would show.
    other = characteristic(RHO * 4.0 * TS, d + f + 1e-3)
    assert np.abs(left_over(other, S, len(other) + d + 1)).max() > 1e-9


@pytest.mark.parametrize(("d", "f"), AGES)
def test_a_small_offset_decays_by_the_slowest_root(d, f):
    lam = 1.5
    roots = np.roots(characteristic(RHO * lam * TS, d + f))
    slowest = roots[np.argmax(np.abs(roots))]
    assert slowest.imag == 0  # at this gain nothing oscillates
    S = released(lam, latency=(d + f) * TS, depth_ratio=RHO, duration=8.0)
    # After 100 frames 5 µm are left, known to 1e-10, and nothing of the other roots.
    assert (sorted(np.abs(roots))[-2] / slowest.real) ** 100 < 1e-10
    np.testing.assert_allclose(S[101:140] / S[100:139], slowest.real, rtol=1e-8)


@pytest.mark.parametrize("placement", ["measurement", "actuator"])
@pytest.mark.parametrize(("d", "f"), AGES)
def test_the_loop_is_unstable_where_a_root_leaves_the_circle(d, f, placement):
    def modulus(gain):
        return np.abs(np.roots(characteristic(gain, d + f))).max()

    limit = brentq(lambda gain: modulus(gain) - 1, 0.3, 5.0, xtol=1e-12)
    if not f:
        assert limit == pytest.approx(2 * np.sin(np.pi / (2 * (2 * d + 1))), rel=1e-9)

    def growth(gain):
        S = released(
            gain / TS, latency=(d + f) * TS, placement=placement, offset=1e-7, duration=12.0
        )
        return np.abs(S[-50:]).max() / np.abs(S[50:100]).max()

    for factor in (0.98, 1.02):
        expected = modulus(factor * limit) ** 201
        assert (expected < 1) == (factor < 1)
        # Windows of an oscillation, compared by their greatest.
        assert growth(factor * limit) == pytest.approx(expected, rel=0.1)


@pytest.mark.parametrize(("d", "f"), AGES)
def test_the_diagram_has_the_same_poles(d, f):
    lam = 5.0
    loop = vs.figure1.at(lam=lam, tau=(d + f) * TS, ell=1.0, ell_hat=1 / RHO, k_ff=0.0)
    poles = np.asarray(loop.sampled(TS).poles())
    roots = np.roots(characteristic(RHO * lam * TS, d + f))
    for root in roots:
        assert np.abs(poles - root).min() < 1e-7  # nearly double roots are known to √rounding
    assert np.abs(poles).max() == pytest.approx(np.abs(roots).max(), rel=1e-9)


@pytest.mark.parametrize("k_ff", [0.0, 0.7, 1.0])
@pytest.mark.parametrize("periods", [0.35, 1.5, 2.25, 3.9])
@pytest.mark.parametrize("placement", ["measurement", "aligned", "actuator"])
def test_the_error_on_a_ramp_for_any_latency(placement, periods, k_ff):
    lam = 2.5
    run = slide(
        lam=lam, latency=periods * TS, k_ff=k_ff, depth_ratio=RHO, duration=16.0,
        placement=placement,
    )  # fmt: skip
    lag = -V * (1 - k_ff * RHO) / (lam * RHO)
    if placement == "measurement":
        lag += V * periods * TS
    # The transient is below 1e-16 of 16 mm after 16 s at these poles; the rest is rounding.
    np.testing.assert_allclose(run.lag[-1], [lag, 0, 0, 0, 0, 0], atol=1e-12)


def test_a_fraction_of_a_period_moves_the_ramp_error_and_the_limit_in_between():
    ends = [
        slide(latency=periods * TS, duration=16.0).lag[-1, 0] for periods in (1, 1.25, 1.5, 1.75, 2)
    ]
    np.testing.assert_allclose(np.diff(ends), V * TS / 4, atol=1e-12)


@pytest.mark.parametrize(("tau", "tau_hat"), [(2.0, 2.0), (1.4, 1.4), (2.0, 1.3), (1.4, 3.0)])
@pytest.mark.parametrize(("k_ff", "dead_time"), [(0.0, 0.0), (1.0, 0.0), (1.0, 0.7)])
def test_the_error_on_a_ramp_with_a_smith_predictor(tau, tau_hat, k_ff, dead_time):
    # Of the delay of the robot only what the predictor believes of it counts.
    lam = 2.5
    run = slide(
        lam=lam, latency=tau * TS, predictor="smith", tau_hat=tau_hat * TS, k_ff=k_ff,
        depth_ratio=RHO, duration=16.0, dead_time=dead_time * TS,
    )  # fmt: skip
    lag = V * (tau * TS - tau_hat * TS / RHO - (1 - k_ff * RHO) / (RHO * lam))
    np.testing.assert_allclose(run.lag[-1], [lag, 0, 0, 0, 0, 0], atol=1e-12)


@pytest.mark.parametrize("dead_time", [0.0, 0.6])
@pytest.mark.parametrize(("tau", "tau_hat"), [(2.0, None), (1.4, None), (2.0, 1.3), (1.4, 3.0)])
def test_the_lag_obeys_the_recursion_with_a_smith_predictor(tau, tau_hat, dead_time):
    lam, kappa = 8.0, 0.9
    believed = tau_hat if tau_hat is not None else tau + dead_time
    S = released(
        lam, latency=tau * TS, dead_time=dead_time * TS, predictor="smith", depth_ratio=kappa,
        tau_hat=None if tau_hat is None else tau_hat * TS, interaction="desired",
    )  # fmt: skip
    # A late robot makes the motion of a punctual one, later: only the sum of both delays counts.
    polynomial = predicted(lam, kappa, tau + dead_time, believed)
    np.testing.assert_allclose(left_over(polynomial, S, 2 * len(polynomial)), 0, atol=1e-13)


def test_smith_is_stable_far_beyond_the_limit_and_a_wrong_one_only_to_its_own():
    d, lam = 2, 30.0
    perfect = released(lam, latency=d * TS, predictor="smith", offset=1e-5)
    # ŝ is exact: the camera moves like one without latency, d frames late; (1 − λTₛ)^k.
    np.testing.assert_allclose(perfect[: d + 8], 1e-5 * (1 - lam * TS) ** np.arange(d + 8),
                               atol=1e-12)  # fmt: skip

    def modulus(gain, believed):
        return np.abs(np.roots(predicted(gain, 1.0, d, believed))).max()

    for believed in (1.0, 1.6, 3.0):
        grid = np.linspace(0.5, 60, 2000)
        first = grid[np.argmax([modulus(gain, believed) > 1 for gain in grid])]
        limit = brentq(lambda g, b=believed: modulus(g, b) - 1, first - 0.1, first)
        for factor in (0.97, 1.03):
            S = released(
                factor * limit, latency=d * TS, predictor="smith", tau_hat=believed * TS,
                offset=1e-7, duration=12.0,
            )  # fmt: skip
            growth = np.abs(S[-50:]).max() / np.abs(S[150:200]).max()
            expected = modulus(factor * limit, believed) ** 101
            assert (growth < 1) == (expected < 1) == (factor < 1)
            # Windows of an oscillation, compared by their greatest: to a few percent.
            assert growth == pytest.approx(expected, rel=0.1)


@pytest.mark.parametrize("periods", [0.0, 1.6, 2.0])
@pytest.mark.parametrize(("k_ff", "placement"), [(0.0, "measurement"), (0.7, "aligned"),
                                                 (0.0, "actuator")])  # fmt: skip
def test_an_integral_nulls_the_error_that_is_measured_and_only_that(k_ff, placement, periods):
    run = slide(
        T_i=0.8, k_ff=k_ff, latency=periods * TS, depth_ratio=RHO, placement=placement,
        duration=24.0, position=(-0.48, 0.044, -0.77),
    )  # fmt: skip
    # Poles near e^{−1.3 t}: 1e-13 of 200 px after 24 s.
    np.testing.assert_allclose(run.measured_error[-1], 0, atol=1e-9)
    lag = V * periods * TS if placement == "measurement" else 0.0
    np.testing.assert_allclose(run.lag[-1], [lag, 0, 0, 0, 0, 0], atol=1e-12)


def test_an_integral_obeys_its_recursion():
    lam, T_i, d = 4.0, 0.5, 2
    S = released(lam, T_i=T_i, latency=d * TS, interaction="desired", duration=3.0)
    # λ(e + Tₛ/Tᵢ Σ e) with the present frame in the sum: λ(1 + (Tₛ/Tᵢ) z/(z − 1)).
    P = np.polyadd(
        np.concatenate([np.poly([1.0, 1.0]), np.zeros(d)]),
        lam * TS * np.array([1 + TS / T_i, -1.0]),
    )
    # From frame d on the measurement is S itself, and the sum has all of it in its first state.
    np.testing.assert_allclose(left_over(P, S, len(P) + d), 0, atol=1e-13)
    assert np.abs(np.roots(P)).max() < 1
