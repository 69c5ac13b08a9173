"""The filter on the image against Riccati's equation, a dense textbook filter and chance itself."""

import math

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.linalg import expm, solve_discrete_are, solve_discrete_lyapunov
from scipy.stats import chi2

from vsctrl.errors import InputError
from vsctrl.servo.estimation.image_filter import ImageFilter, process_covariance, transition

T = 0.04
MODELS = [("velocity", 2), ("acceleration", 3)]


def chain(order):
    """Continuous model: the derivative of each state is the next one, noise drives the last."""
    return np.eye(order, k=1), np.eye(order)[-1]


def run(filter_, images, rates=None, fresh=None, visible=None):
    """Estimates of all frames, as two arrays (n, m)."""
    n, m = images.shape
    rates = np.zeros((n, m)) if rates is None else rates
    fresh = np.ones(n, bool) if fresh is None else fresh
    visible = np.ones((n, m), bool) if visible is None else visible
    out = [filter_.update(images[k], bool(fresh[k]), visible[k], rates[k]) for k in range(n)]
    return np.array([e.s for e in out]), np.array([e.rate for e in out])


@pytest.mark.parametrize("order", [2, 3])
def test_discrete_model_is_the_exponential_and_the_integral_of_the_continuous_one(order):
    A, b = chain(order)

    def spread(t):
        column = expm(A * t) @ b
        return np.outer(column, column)

    for dt in (0.04, 0.013, 2.0):
        np.testing.assert_allclose(transition(order, dt), expm(A * dt), rtol=1e-13, atol=1e-15)
        Q, _ = quad_vec(spread, 0, dt, epsrel=1e-12)
        np.testing.assert_allclose(process_covariance(order, dt), Q, rtol=1e-10)


@pytest.mark.parametrize(("model", "order"), MODELS)
def test_covariance_and_gain_end_where_the_riccati_equation_says(model, order):
    q, r = 300.0, 0.5
    A, b = chain(order)
    F = expm(A * T)
    Q = q**2 * quad_vec(lambda t: np.outer(expm(A * t) @ b, expm(A * t) @ b), 0, T)[0]
    h = np.eye(order)[:1]
    predicted = solve_discrete_are(F.T, h.T, Q, np.array([[r**2]]))
    gain = predicted @ h.T / (predicted[0, 0] + r**2)
    corrected = predicted - gain @ h @ predicted

    filter_ = ImageFilter(model, T, 0.0, q, r)
    run(filter_, np.zeros((400, 1)))
    # solve_discrete_are is good to about 1e-9 here; the transient has died out to rounding.
    np.testing.assert_allclose(filter_.covariance[0], corrected, rtol=1e-7)
    # The gain is what a jump of one pixel does to the estimate.
    jump = filter_.update(np.ones(1), True, np.ones(1, bool), np.zeros(1))
    assert jump.s[0] == pytest.approx(gain[0, 0], rel=1e-8)
    assert jump.rate[0] == pytest.approx(gain[1, 0], rel=1e-8)


def dense(order, d, q, r, images, rates, taken):
    """Kalman filter of one coordinate on the augmented state (x_k, s_k−1, …, s_k−d).

    The image of frame k shows s_{k−d}, the last component; the input enters s of the present. It
    starts at frame 0 with one image and, as all s before are s_0, as many copies of it; its rates
    are unknown, with the wide deviations that the module states. Joseph's form.
    Returns s and v of all frames, and the last covariance of x.
    """
    A, b = chain(order)
    n = order + d
    F = np.zeros((n, n))
    F[:order, :order] = expm(A * T)
    if d:
        F[order, 0] = 1
        F[order + 1 :, order : n - 1] = np.eye(d - 1)
    Q = np.zeros((n, n))
    noise = quad_vec(lambda t: np.outer(expm(A * t) @ b, expm(A * t) @ b), 0, T)[0]
    Q[:order, :order] = q**2 * noise
    H = np.eye(n)[n - 1 if d else 0]
    is_s = np.array([1.0] + [0.0] * (order - 1) + [1.0] * d)
    x = images[0] * is_s
    P = r**2 * np.outer(is_s, is_s)
    P[1, 1] = (1e5 * r / T) ** 2
    if order == 3:
        P[2, 2] = (1e3 * r / T**2) ** 2
    s, v = [], []
    for k in range(len(images)):
        if k:
            x, P = F @ x + np.eye(n)[0] * T * rates[k], F @ P @ F.T + Q
        if taken[k]:
            K = P @ H / (H @ P @ H + r**2)
            kept = np.eye(n) - np.outer(K, H)
            x, P = x + K * (images[k] - H @ x), kept @ P @ kept.T + r**2 * np.outer(K, K)
        s.append(x[0])
        v.append(x[1])
    return np.array(s), np.array(v), P[:order, :order]


@pytest.mark.parametrize(("model", "order"), MODELS)
@pytest.mark.parametrize("d", [0, 1, 2, 4])
def test_it_is_the_dense_filter_on_the_augmented_state(model, order, d):
    # Random data is as good as any: both are the same linear function of it.
    rng = np.random.default_rng(7 + d)
    n, q, r = 60, 200.0, 0.7
    images = rng.normal(0, 50, n)
    images[: d + 1] = images[0]  # the first image is repeated until the second arrives
    rates = rng.normal(0, 300, n)
    fresh, visible = rng.random(n) > 0.2, rng.random(n) > 0.2
    fresh[0] = visible[0] = True
    filter_ = ImageFilter(model, T, d * T, q, r)
    s, v = run(filter_, images[:, None], rates[:, None], fresh, visible[:, None])
    taken = fresh & visible & (np.arange(n) > d)
    expected, slope, P = dense(order, d, q, r, images, rates, taken)
    # The wide start leaves six digits of the first covariances to either way of computing them;
    # what that does fades away as the start does.
    np.testing.assert_allclose(s[:, 0], expected, rtol=1e-5, atol=1e-3)
    np.testing.assert_allclose(v[:, 0], slope, rtol=1e-5, atol=2e-2)
    np.testing.assert_allclose(s[40:, 0], expected[40:], rtol=1e-7, atol=1e-5)
    np.testing.assert_allclose(filter_.covariance[0], P, rtol=1e-7)


def camera_path(t):
    """What the camera's own motion has moved the images by, px."""
    return np.stack([80 * np.sin(2 * t), -30 * t + 20 * t**2], axis=-1)


def scene(n, latency, own):
    """Images as the simulator shows them, camera's rates, and the truth, for a path of the target.

    The camera's rate is constant between frames, so its path is a polygon through the frames.
    """
    t = np.arange(n) * T
    corners = camera_path(t)
    rates = np.diff(corners, axis=0, prepend=corners[:1]) / T

    def image(times):
        moved = [np.interp(times, t, corners[:, i]) for i in range(2)]
        return np.stack(moved, axis=-1) + own(times[:, None])

    return image(np.maximum(0, t - latency)), rates, image(t), t


@pytest.mark.parametrize("latency", [0.0, 0.04, 0.08, 0.1, 0.011, 0.173])
def test_a_ramp_and_a_parabola_are_tracked_without_bias_at_any_latency(latency):
    ramp = lambda t: np.array([30.0, -70.0]) + np.array([55.0, -120.0]) * t  # noqa: E731
    bend = lambda t: ramp(t) + np.array([40.0, 90.0]) * t**2  # noqa: E731
    slope = np.array([55.0, -120.0])
    images, rates, truth, t = scene(250, latency, ramp)
    s, v = run(ImageFilter("velocity", T, latency, 1000.0, 0.1), images, rates)
    # The first rate is off by 1e-10 of itself for the finite start; rounding of 400 px the rest.
    np.testing.assert_allclose(s[50:], truth[50:], atol=1e-8)
    np.testing.assert_allclose(v[50:], np.broadcast_to(slope, v[50:].shape), atol=1e-6)

    images, rates, truth, t = scene(250, latency, bend)
    s, v = run(ImageFilter("acceleration", T, latency, 5000.0, 0.1), images, rates)
    expected = slope + 2 * np.array([40.0, 90.0]) * t[:, None]
    np.testing.assert_allclose(s[100:], truth[100:], atol=1e-8)
    np.testing.assert_allclose(v[100:], expected[100:], atol=1e-6)


@pytest.mark.parametrize("latency", [0.08, 0.1])
def test_two_images_make_a_rate_and_three_an_acceleration(latency):
    start = math.floor(latency / T) + 1  # the frame of the second image, as old as it is
    images, rates, truth, _ = scene(40, latency, lambda t: np.array([5.0, 5.0]) - 90 * t)
    s, v = run(ImageFilter("velocity", T, latency, 1e-3, 0.1), images, rates)
    np.testing.assert_allclose(v[start - 1], 0)
    np.testing.assert_allclose(v[start:], -90, rtol=1e-6)
    np.testing.assert_allclose(s[start:], truth[start:], atol=1e-4)
    images, rates, truth, _ = scene(40, latency, lambda t: np.array([5.0, 5.0]) - 90 * t**2)
    s, v = run(ImageFilter("acceleration", T, latency, 1e-3, 0.1), images, rates)
    # The acceleration's prior of 1000 r/T² shares a millionth with what it cannot know.
    np.testing.assert_allclose(s[start + 1 :], truth[start + 1 :], rtol=1e-4, atol=1e-3)


def test_after_two_images_the_rate_is_as_uncertain_as_their_difference():
    # The noise of both images, and what the target may have done between them.
    q, r = 30.0, 0.1
    filter_ = ImageFilter("velocity", T, 0.0, q, r)
    run(filter_, np.zeros((2, 1)))
    P = np.array([[r**2, r**2 / T], [r**2 / T, 2 * r**2 / T**2 + q**2 * T / 3]])
    # The unknown rate's variance was 2.5e9 times as large: rounding leaves seven digits of it.
    np.testing.assert_allclose(filter_.covariance[0], P, rtol=1e-5)
    # Joseph's form keeps the image's own, where the plain update would leave six.
    np.testing.assert_allclose(filter_.covariance[0, 0], P[0], rtol=1e-8)


@pytest.mark.parametrize(("model", "order"), MODELS)
@pytest.mark.parametrize("latency", [0.0, 0.08, 0.1])
def test_errors_are_as_large_as_the_covariance_says(model, order, latency):
    # Normalised estimation error squared at the present frame, for a target that moves as the
    # model says, with the continuous truth sampled at the fractional age of the image.
    rng = np.random.default_rng(20)
    m, n, q, r = 3000, 40, 400.0, 0.6
    A, b = chain(order)
    steps = 10  # truth on a grid of 4 ms, which every age above is a multiple of
    dt = T / steps
    late = round(latency / dt)
    F = expm(A * dt)
    Q = q**2 * quad_vec(lambda t: np.outer(expm(A * t) @ b, expm(A * t) @ b), 0, dt)[0]
    root = np.linalg.cholesky(Q)
    x = rng.normal(size=(m, order)) * np.array([50.0, 100.0, 300.0][:order])
    truth = np.empty((steps * (n - 1) + 1, m, order))
    truth[0] = x
    for i in range(1, len(truth)):
        truth[i] = truth[i - 1] @ F.T + rng.normal(size=(m, order)) @ root.T
    shown = np.maximum(0, np.arange(n) * steps - late)
    images = truth[shown, :, 0] + r * rng.normal(size=(n, m))
    images[shown == 0] = images[0]
    visible = rng.random((n, m)) > 0.15
    visible[shown == 0] = visible[0]

    filter_ = ImageFilter(model, T, latency, q, r)
    s, v = run(filter_, images, visible=visible)
    error = np.stack([s[-1], v[-1]], axis=1) - truth[-1, :, :2]
    seen = filter_.known
    P = filter_.covariance[seen][:, :2, :2]
    nees = np.einsum("mi,mij,mj->m", error[seen], np.linalg.inv(P), error[seen])
    low, high = chi2.ppf([1e-3, 1 - 1e-3], 2 * seen.sum()) / seen.sum()
    assert low < nees.mean() < high


def test_a_white_velocity_has_the_textbook_spread_without_images():
    # Images stop: the variance of the rate grows by q² per second, that of a random walk.
    filter_ = ImageFilter("velocity", T, 0.0, 100.0, 0.5)
    run(filter_, np.zeros((200, 1)))
    before = filter_.covariance[0, 1, 1]
    run_on = [filter_.update(np.zeros(1), False, np.ones(1, bool), np.zeros(1)) for _ in range(50)]
    assert filter_.covariance[0, 1, 1] - before == pytest.approx(100.0**2 * 50 * T, rel=1e-9)
    assert run_on[-1].rate == pytest.approx(0, abs=1e-12)


def test_a_repeated_first_image_is_counted_once():
    # Five periods of latency: six frames show the same noise, which is one measurement.
    filter_ = ImageFilter("velocity", T, 5 * T, 10.0, 0.5)
    _, v = run(filter_, np.full((6, 2), 3.0))
    once = filter_.covariance
    # The position then is as uncertain as the image, the unknown rate times the latency, and what
    # the target may do by then.
    wide = 0.5**2 * (1 + (1e5 * 5) ** 2) + 10**2 * (5 * T) ** 3 / 3
    assert once[0, 0, 0] == pytest.approx(wide, rel=1e-12)
    assert not v.any()


def test_hidden_coordinates_coast_and_never_seen_ones_say_so():
    images, rates, truth, _ = scene(120, 0.1, lambda t: np.array([5.0, 5.0]) + 60 * t)
    visible = np.ones((120, 2), bool)
    visible[60:75, 0] = False
    images[60:75, 0] = np.nan
    s, v = run(ImageFilter("velocity", T, 0.1, 1.0, 0.1), images, rates, visible=visible)
    np.testing.assert_allclose(s[60:75], truth[60:75], atol=1e-5)
    np.testing.assert_allclose(v[60:75], 60, rtol=1e-6)

    filter_ = ImageFilter("velocity", T, 0.1, 1.0, 0.1)
    assert filter_.known.shape == (0,)
    visible[:, 1] = False
    s, v = run(filter_, images, rates, visible=visible)
    assert filter_.known.tolist() == [True, False]
    assert not s[:, 1].any()
    assert not v[:, 1].any()
    assert np.isinf(filter_.covariance[1, 1, 1])


def test_a_longer_wait_costs_the_spread_of_the_prediction():
    # The steady covariance at t_k is that of the delayed state carried on: F P Fᵀ + Q(latency).
    here, late = (ImageFilter("velocity", T, x, 50.0, 0.5) for x in (0.0, 0.09))
    run(here, np.zeros((300, 1)))
    run(late, np.zeros((300, 1)))
    F, A = np.array([[1, 0.09], [0, 1]]), np.eye(2, k=1)
    Q = 50.0**2 * quad_vec(lambda t: expm(A * t)[:, 1:] @ expm(A * t)[:, 1:].T, 0, 0.09)[0]
    expected = F @ here.covariance[0] @ F.T + Q
    np.testing.assert_allclose(late.covariance[0], expected, rtol=1e-9)


def test_noise_of_a_still_target_is_passed_on_as_the_gain_says():
    # The estimate is a linear filter of white noise: its variance by Lyapunov's equation.
    q, r, latency = 100.0, 0.5, 0.06
    A, b = chain(2)
    F = expm(A * T)
    Q = q**2 * quad_vec(lambda t: np.outer(expm(A * t) @ b, expm(A * t) @ b), 0, T)[0]
    P = solve_discrete_are(F.T, np.eye(2)[:, :1], Q, np.array([[r**2]]))
    K = P[:, 0] / (P[0, 0] + r**2)
    closed = (np.eye(2) - np.outer(K, [1, 0])) @ F
    X = solve_discrete_lyapunov(closed, r**2 * np.outer(K, K))
    ahead = expm(A * latency)
    expected = np.sqrt(np.diag(ahead @ X @ ahead.T))
    noise = np.random.default_rng(3).normal(0, r, (150, 4000))
    s, v = run(ImageFilter("velocity", T, latency, q, r), noise)
    # 4000 draws: a standard deviation is known to 1/√8000 = 1.1 %.
    np.testing.assert_allclose([s[-1].std(), v[-1].std()], expected, rtol=0.045)


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        (("speed", T, 0.0, 1.0, 1.0), "model: 'speed' is none; choose 'velocity'"),
        (("velocity", 0.0, 0.0, 1.0, 1.0), "period: 0 cannot be used; give a time above"),
        (("velocity", T, -0.1, 1.0, 1.0), r"latency: -0\.1 cannot be used; give a time of 0"),
        (("velocity", T, 0.0, 0.0, 1.0), "process: 0 cannot be used; give an intensity"),
        (("velocity", T, 0.0, 1.0, float("nan")), "measurement: nan cannot be used"),
    ],
)
def test_values_out_of_range_are_refused_in_a_sentence(values, sentence):
    with pytest.raises(InputError, match=sentence):
        ImageFilter(*values)
