"""The depth observer against geometry, and its precision against the Cramér–Rao bound."""

import numpy as np
import pytest
from scipy.linalg import expm

from vsctrl.errors import InputError
from vsctrl.servo.estimation.depth_observer import RANGE, DepthObserver

FX, FY = 700.0, 640.0
POINTS = np.array([[-0.2, -0.1, 0.9], [0.25, -0.15, 1.3], [0.2, 0.2, 1.0], [-0.1, 0.3, 1.7]])
ALL = np.ones(4, bool)


def motion(V, Omega, t):
    """Pose after a constant twist for a time t, by SciPy's matrix exponential."""
    x, y, z = Omega
    hat = np.array([[0, -z, y, V[0]], [z, 0, -x, V[1]], [-y, x, 0, V[2]], [0, 0, 0, 0]])
    return expm(hat * t)


def seen_from(pose, points=POINTS):
    """Points in the camera frame, and their image."""
    p = (points - pose[:3, 3]) @ pose[:3, :3]
    return p, (np.array([FX, FY]) * p[:, :2] / p[:, 2:]).ravel()


def travel(observer, steps, noise=None, visible=None):
    """Feed the images along the poses that the steps lead to; returns the last true depths."""
    pose = np.eye(4)
    for k, step in enumerate([np.eye(4), *steps]):
        pose = pose @ step
        p, image = seen_from(pose)
        if noise is not None:
            image = image + noise[k]
        observer.update(image, step, ALL if visible is None else visible[k])
    return p[:, 2]


@pytest.mark.parametrize(
    ("V", "Omega"),
    [
        ((0.1, 0, 0), (0, 0, 0)),
        ((0, 0, 0.3), (0, 0, 0)),
        ((0, 0, -0.3), (0, 0, 0)),
        ((0.1, -0.2, 0.3), (0.4, -0.5, 0.6)),
        ((3.0, 1.0, 2.0), (2.0, -3.0, 5.0)),
    ],
)
def test_one_exact_image_after_a_translation_gives_the_exact_depth(V, Omega):
    # A guess off by −40 … +60 %, a frame of 40 ms. The guess counts (1e-5 px/parallax of at least
    # 0.5 px)² ≲ 4e-10 of the whole.
    observer = DepthObserver(FX, FY, POINTS[:, 2] * [0.6, 1.6, 1.3, 0.8], 0.0, 0.5)
    true = travel(observer, [motion(V, Omega, 0.04)])
    np.testing.assert_allclose(observer.depths, true, rtol=1e-8)
    assert np.all(observer.excitation > 1e6)


def test_depths_stay_exact_along_any_way():
    rng = np.random.default_rng(1)
    steps = [motion(rng.normal(0, 0.2, 3), rng.normal(0, 0.3, 3), 0.04) for _ in range(100)]
    observer = DepthObserver(FX, FY, np.full(4, 1.2), 0.0, 0.5)
    np.testing.assert_allclose(travel(observer, steps), observer.depths, rtol=1e-8)


def test_a_rotation_alone_says_nothing_and_turns_the_depths_it_believes():
    wrong = POINTS * np.array([0.7, 1.5, 1.2, 0.9])[:, None]  # on the same rays
    observer = DepthObserver(FX, FY, wrong[:, 2], 0.3, 0.5)
    step = motion((0, 0, 0), (0.3, -0.4, 0.5), 0.04)
    travel(observer, [step] * 25)
    # Without noise the points turn as rigidly as the right ones would.
    turned, _ = seen_from(np.linalg.matrix_power(step, 25), wrong)
    np.testing.assert_allclose(observer.depths, turned[:, 2], rtol=1e-9)
    # What is left is the noise of the image in the turned depth: (0.3/700 · 0.03)² ~ 1e-10.
    assert np.all(observer.excitation < 1e-6)


def test_a_camera_at_rest_says_nothing_even_with_noise():
    rng = np.random.default_rng(2)
    observer = DepthObserver(FX, FY, np.full(4, 1.2), 0.5, 0.5)
    travel(observer, [np.eye(4)] * 50, noise=rng.normal(0, 0.5, (51, 8)))
    np.testing.assert_allclose(observer.depths, 1.2, rtol=1e-12)
    assert not observer.excitation.any()


def bound(steps, sigma, relative, guess):
    """Cramér–Rao bound on the standard deviation of ln z at the end, with the prior's share.

    Fisher information of each point's place in the first frame, its image's derivative taken by
    complex steps; the prior is one on 1/z of the first frame.
    """
    F = np.array([FX, FY])
    out = []
    for i, point in enumerate(POINTS):
        information, h = np.zeros((3, 3)), 1e-30
        gradient = np.array([0, 0, -1 / point[2] ** 2])
        information += np.outer(gradient, gradient) / (relative / guess[i]) ** 2
        pose = np.eye(4)
        for step in [np.eye(4), *steps]:
            pose = pose @ step
            columns = []
            for e in np.eye(3):
                p = (point + 1j * h * e - pose[:3, 3]) @ pose[:3, :3]
                columns.append((F * p[:2] / p[2]).imag / h)
            J = np.stack(columns, axis=1)
            information += J.T @ J / sigma**2
        depth = pose[:3, 2]  # ∂z/∂P at the end
        z = seen_from(pose)[0][i, 2]
        out.append(np.sqrt(depth @ np.linalg.solve(information, depth)) / z)
    return np.array(out)


@pytest.mark.parametrize("frames", [5, 20, 80])
@pytest.mark.parametrize(
    ("V", "Omega"), [((0.1, 0, 0), (0, 0.05, 0)), ((0.05, -0.05, 0.15), (0.1, 0.1, -0.2))]
)
def test_errors_are_those_of_the_cramer_rao_bound(V, Omega, frames):
    # The images leave a half to a sixth of the guess's deviation after five frames, where the guess
    # still counts, and about a hundredth after eighty. The guess is good to a tenth: the second
    # order, which the bound does not know, is then a hundredth.
    sigma, relative, runs = 0.2, 0.1, 1500
    rng = np.random.default_rng(10 + frames)
    steps = [motion(V, Omega, 0.04)] * frames
    points = np.tile(POINTS, (runs, 1))
    chi = (1 + relative * rng.normal(size=len(points))) / points[:, 2]
    observer = DepthObserver(FX, FY, 1 / chi, sigma, relative)
    pose = np.eye(4)
    for step in [np.eye(4), *steps]:
        pose = pose @ step
        p, image = seen_from(pose, points)
        image = image + rng.normal(0, sigma, len(image))
        observer.update(image, step, np.ones(len(points), bool))
    error = (p[:, 2] / observer.depths - 1).reshape(runs, 4)
    # 1500 runs know a standard deviation to 1/√3000 = 1.8 %; 24 of them are compared.
    least = bound(steps, sigma, relative, POINTS[:, 2])
    np.testing.assert_allclose(error.std(axis=0) / least, 1, atol=0.08)
    assert np.all(np.abs(error.mean(axis=0)) < 0.1 * least + 0.01 * relative)


def test_excitation_is_the_information_of_the_images_alone():
    # 1/√excitation is the bound without any prior: a sideways way, where depths do not change.
    steps = [motion((0.1, 0, 0), (0, 0, 0), 0.04)] * 50
    observer = DepthObserver(FX, FY, POINTS[:, 2], 0.2, 0.5)
    travel(observer, steps)
    alone = bound(steps, 0.2, 1e6, POINTS[:, 2])
    np.testing.assert_allclose(observer.excitation**-0.5, alone, rtol=1e-6)


def test_points_in_the_direction_of_travel_tell_nothing():
    points = np.array([[0, 0, 1.0], [0.05, 0, 1.0], [0.4, 0, 1.0], [0, -0.4, 1.0]])
    observer = DepthObserver(FX, FY, np.full(4, 1.3), 0.2, 0.5)
    pose, step = np.eye(4), motion((0, 0, 0.1), (0, 0, 0), 0.04)
    for k in range(30):
        _, image = seen_from(pose, points)
        observer.update(image, np.eye(4) if k == 0 else step, ALL)
        pose = pose @ step
    focus, near, right, up = observer.excitation
    assert focus < 1e-6
    # The shift by approach is proportional to the distance from the focus: 8² = 64 times less.
    assert near == pytest.approx(right / 64, rel=0.2)
    assert up == pytest.approx(right * (FY / FX) ** 2, rel=1e-2)
    # The focus' depth is the guess that came nearer, and the others know theirs.
    way = 29 * 0.04 * 0.1
    assert observer.depths[0] == pytest.approx(1.3 - way, rel=1e-6)
    np.testing.assert_allclose(observer.depths[2:], 1.0 - way, rtol=1e-3)


def test_hidden_points_are_moved_along_and_pick_up_where_the_truth_is():
    rng = np.random.default_rng(4)
    steps = [motion(rng.normal(0, 0.3, 3), rng.normal(0, 0.3, 3), 0.04) for _ in range(60)]
    visible = np.ones((61, 4), bool)
    visible[10:40, 0] = False  # known by then, and exactly moved
    visible[1:50, 1] = False  # seen once: its depth is a guess until it is seen again
    visible[:, 2] = False  # never seen
    noise = np.where(np.repeat(visible, 2, axis=1), 0.0, np.nan)
    observer = DepthObserver(FX, FY, np.full(4, 1.2), 0.0, 0.5)
    travel(observer, steps[:30], noise=noise, visible=visible)
    assert observer.excitation[0] > 1e4
    assert observer.excitation[1] == 0
    observer = DepthObserver(FX, FY, np.full(4, 1.2), 0.0, 0.5)
    true = travel(observer, steps, noise=noise, visible=visible)
    np.testing.assert_allclose(observer.depths[[0, 1, 3]], true[[0, 1, 3]], rtol=1e-8)
    assert observer.depths[2] == 1.2
    assert observer.excitation[2] == 0


def test_a_point_that_passes_the_camera_starts_over_from_its_guess():
    guess = 1.2 * POINTS[:, 2]
    observer = DepthObserver(FX, FY, guess, 0.1, 0.5)
    sideways, onwards = motion((0.1, 0, 0), (0, 0, 0), 0.04), motion((0, 0, 1.2), (0, 0, 0), 1)
    travel(observer, [sideways] * 20)
    assert np.all(observer.excitation > 1e3)
    # 1.2 m onwards: points 1 and 3 are behind, and what a camera shows there is none of them.
    observer.update(np.zeros(8), onwards, np.zeros(4, bool))
    np.testing.assert_allclose(observer.depths[[0, 2]], guess[[0, 2]], rtol=1e-15)
    assert observer.excitation[[0, 2]].tolist() == [0, 0]
    np.testing.assert_allclose(observer.depths[[1, 3]], POINTS[[1, 3], 2] - 1.2, rtol=1e-2)
    assert np.all(observer.excitation[[1, 3]] > 1e3)
    # Back again, they are observed like new ones.
    pose = np.linalg.matrix_power(sideways, 20)
    observer.update(seen_from(pose)[1], np.linalg.inv(onwards), ALL)
    np.testing.assert_allclose(observer.depths[[0, 2]], guess[[0, 2]], rtol=1e-15)
    for _ in range(20):
        pose = pose @ sideways
        observer.update(seen_from(pose)[1], sideways, ALL)
    # The guess has (a thousandth)² of the weight in what is known by then.
    np.testing.assert_allclose(observer.depths, POINTS[:, 2], rtol=1e-3)
    assert np.all(observer.excitation > 1e3)


def test_no_image_makes_a_depth_that_cannot_be_used():
    rng = np.random.default_rng(5)
    observer = DepthObserver(FX, FY, POINTS[:, 2], 0.1, 5.0)
    for _ in range(300):
        step = motion(rng.normal(0, 2, 3), rng.normal(0, 2, 3), 0.2)
        observer.update(rng.normal(0, 500, 8), step, rng.random(4) > 0.2)
        share = observer.depths / POINTS[:, 2]
        assert np.all((share >= (1 - 1e-12) / RANGE) & (share <= (1 + 1e-12) * RANGE))
        assert np.all(np.isfinite(observer.excitation))


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ((700, 700, [1.0, 0.0], 0.1, 0.5), r"depths0: .* give one above 0 m for every point"),
        ((700, 700, [], 0.1, 0.5), "depths0"),
        ((0, 700, [1.0], 0.1, 0.5), "Fx: 0 cannot be used"),
        ((700, -1, [1.0], 0.1, 0.5), "Fy: -1 cannot be used"),
        ((700, 700, [1.0], -0.1, 0.5), r"noise_px: -0\.1 cannot be used"),
        ((700, 700, [1.0], 0.1, np.inf), "relative_uncertainty: inf cannot be used"),
    ],
)
def test_values_out_of_range_are_refused_in_a_sentence(values, sentence):
    with pytest.raises(InputError, match=sentence):
        DepthObserver(*values)
