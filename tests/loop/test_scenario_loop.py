"""The loop of a scenario, held to runs of the simulator, which share nothing of its dynamics."""

import numpy as np
import pytest
from effort import share
from oracles.linear_scenarios import SIZE, random_scenario
from scipy.optimize import brentq

import vsctrl as vs
from vsctrl.errors import InputError
from vsctrl.loop.scenario_loop.elements import Filter
from vsctrl.loop.scenario_loop.kalman import steady_filter
from vsctrl.servo.estimation.image_filter import ImageFilter
from vsctrl.servo.simulate import simulated

FILTERS = ("velocity", "acceleration")
SLIDE = vs.paper.sliding()


def drawn(seed, low=0.3, high=1.25):
    """A random scenario with its gain at a random share of the limit of its loop, and that share.

    Gains within 3 % of the limit are left out, at which a run would have to be very long to tell.
    """
    rng = np.random.default_rng(seed)
    scenario = random_scenario(rng)
    limit = vs.loop.of(scenario).gain_limit
    of_limit = rng.uniform(low, high)
    if abs(of_limit - 1) < 0.03:
        of_limit = low
    if 0 < limit < np.inf:
        scenario = scenario.with_(lam=of_limit * limit)
    return scenario


def small(run):
    """The frames before the lag is too large to be linear."""
    large = np.abs(run.lag).max(axis=1) > 30 * SIZE
    return int(np.argmax(large)) if large.any() else len(large)


@pytest.mark.parametrize("seed", range(share(240)))
def test_the_predicted_lag_is_that_of_the_run_at_every_frame(seed):
    scenario = drawn(seed)
    loop, run = vs.loop.of(scenario), simulated(scenario)
    n = small(run)
    size = max(float(np.abs(run.lag[:n]).max()), SIZE)
    difference = np.abs(loop.predicted[:n] - run.lag[:n]).max(axis=1) / size
    if scenario.predictor.predictor in FILTERS:
        # Its gain is another one at the start, which is forgotten as fast as the loop settles.
        if loop.growth**50 < 1e-3:
            assert difference[-1] < 1e-2
    else:
        assert difference.max() < 1e-4


@pytest.mark.parametrize("seed", range(1000, 1000 + share(80)))
def test_a_loop_called_stable_settles_and_no_other_does(seed):
    scenario = drawn(seed)
    loop = vs.loop.of(scenario)
    frames = int(min(3000, 40 / abs(np.log(loop.growth)))) + 40
    still = scenario.with_(kind="hold", drift=(0.0,) * 6, duration=frames * scenario.vision.period)
    run = simulated(still)
    size = np.abs(run.lag).max(axis=1)
    if loop.is_stable:
        assert size[-1] < 1e-2 * size.max()
    else:
        assert len(size) < frames or size[-20:].max() > 10 * size[:20].max()


@pytest.mark.parametrize("seed", range(2000, 2000 + share(80)))
def test_the_steady_lag_is_that_of_a_long_run(seed):
    scenario = drawn(seed, 0.1, 0.6)
    loop = vs.loop.of(scenario)
    if loop.steady_lag is None or scenario.predictor.predictor in FILTERS:
        return
    frames = min(int(30 / abs(np.log(loop.growth))) + 40, 4000)
    run = simulated(scenario.with_(duration=frames * scenario.vision.period))
    np.testing.assert_allclose(loop.steady_lag, run.lag[-1], atol=1e-4 * SIZE + 1e-12)


GAIN_LIMITS = [
    {}, {"latency": 0.0}, {"latency": 0.093}, {"dead_time": 0.05}, {"time_constant": 0.1},
    {"T_i": 1.0}, {"predictor": "smith", "tau_hat": 0.06}, {"depth_ratio": 1.3},
    {"focal_ratio": 1.2}, {"hand_eye": (0.0, 0.0, 0.02, 0.1, 0.0, 0.0)},
    {"placement": "actuator", "latency": 0.07},
    {"dead_time": 0.02, "time_constant": 0.05, "T_i": 2.0},
    {"predictor": "velocity", "depth_ratio": 1.2}, {"scheme": "pose"},
    {"features": "polar", "depth_ratio": 1.2},
]  # fmt: skip


@pytest.mark.parametrize("fields", GAIN_LIMITS, ids=str)
def test_the_gain_limit_is_where_the_simulated_camera_neither_comes_nor_goes(fields):
    """The growth of a run let go along the critical direction, bisected over the gain."""
    loop = vs.loop.of(SLIDE.with_(**fields))
    direction, limit, depth = loop.critical, loop.gain_limit, 0.7
    # Of a complex pair the one mode is nearly as slow as the other, and has to die out.
    frames = 3000 if direction.kappa.imag else 500
    along = direction.vectors[0].real * ([depth] * 3 + [1.0] * 3)
    scenario = SLIDE.with_(kind="hold", offset=tuple(SIZE * along), **fields)

    def growth(gain):
        run = simulated(scenario.with_(lam=gain, duration=frames * 0.04))
        size = np.linalg.norm(run.lag, axis=1)
        n = 2 * frames // 5
        window = np.hanning(n)
        return np.log((window @ size[-n:] ** 2) / (window @ size[-2 * n : -n] ** 2))

    found = brentq(growth, 0.999 * limit, 1.001 * limit, rtol=1e-5)
    assert found == pytest.approx(limit, rel=1e-4)


@pytest.mark.parametrize("fields", GAIN_LIMITS, ids=str)
def test_the_map_of_a_frame_has_the_poles_of_the_sampled_diagram(fields):
    loop = vs.loop.of(SLIDE.with_(lam=4.0, **fields))
    for direction in loop.directions:
        if direction.kappa.imag:
            with pytest.raises(InputError, match="complex pair"):
                loop.system(direction)
            continue
        twin = loop.sampled(direction)
        eigenvalues = loop.frames(direction).eigenvalues
        poles = twin.poles()  # and what blocks share is in them twice
        for z in eigenvalues[np.abs(eigenvalues) > 1e-2]:
            assert np.abs(poles - z).min() < 1e-6 / abs(z) ** 2
        assert twin.is_stable == (loop.frames(direction).spectral_radius < 1)


def test_the_limit_of_figure_1_is_its_closed_form_with_any_calibration():
    for ratio in (0.8, 1.0, 1.3):
        loop = vs.loop.of(SLIDE.with_(depth_ratio=ratio))
        exact = float(vs.loop.gain_limit(tau=0.08, period=0.04, kappa=max(ratio, 1.0)))
        assert loop.gain_limit == pytest.approx(exact, rel=1e-9)
        lag = vs.loop.steady_lag(
            vs.loop.figure1, vs.loop.depth_error_matrix(ratio), (0.04, 0, 0, 0, 0, 0),
            lam=SLIDE.law.lam, tau=0.08, k_ff=1,
        )  # fmt: skip
        np.testing.assert_allclose(loop.steady_lag, lag, atol=1e-12)


def test_a_pair_of_directions_that_turn_into_each_other_has_the_limit_of_its_complex_kappa():
    angle = 0.1
    loop = vs.loop.of(SLIDE.with_(hand_eye=(0.0, 0.0, 0.0, angle, 0.0, 0.0)))
    kappa = np.exp(1j * angle)
    assert any(abs(each.kappa - kappa) < 1e-8 for each in loop.directions)
    exact = float(vs.loop.gain_limit(tau=0.08, period=0.04, kappa=kappa))
    assert loop.gain_limit == pytest.approx(exact, rel=1e-7)


@pytest.mark.parametrize("kind", FILTERS)
def test_the_steady_gain_is_what_the_filter_of_the_simulator_comes_to(kind):
    order = {"velocity": 2, "acceleration": 3}[kind]
    image_filter = ImageFilter(kind, 0.04, 0.0, 50.0, 0.5)
    for _ in range(400):
        image_filter.update(np.zeros(1), True, np.ones(1, dtype=bool), np.zeros(1))
    P = image_filter.covariance[0]  # after the correction, K = P Hᵀ/R
    gain = steady_filter(Filter(order, 50.0, 0.5), 0.04, 0.0).gain
    np.testing.assert_allclose(gain, P[:, 0] / 0.25, rtol=1e-6)


def test_what_is_not_linear_or_not_constant_is_listed_with_its_reason():
    scenario = SLIDE.with_(
        size_px=(2000, 2000), jitter=0.01, missed=0.1, noise_px=0.3, quantum_px=0.1, outliers=0.01,
        lam_zero=4.0, lam_slope=1.0, smooth=2.0, depth="estimated", drift=(0.01, 0, 0, 0, 0, 0),
        sway=3.0, speed_limit=1.0, reference_depth_ratio=1.1,
    )  # fmt: skip
    assert list(vs.loop.of(scenario).left_out) == [
        "camera.size_px", "target.sway", "law.depth", "law.lam_zero", "law.smooth",
        "vision.jitter", "vision.missed", "vision.noise_px", "vision.quantum_px",
        "vision.outliers", "reference_image.reference_depth_ratio", "robot.speed_limit",
    ]  # fmt: skip
    assert not vs.loop.of(SLIDE).left_out


def test_points_on_a_line_have_no_loop():
    with pytest.raises(InputError, match="cannot tell all motions"):
        vs.loop.of(SLIDE.with_(points=tuple((x, 0.0, 0.0) for x in (-0.1, 0.0, 0.1, 0.2))))
