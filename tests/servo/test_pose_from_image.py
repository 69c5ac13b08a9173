"""The pose of the camera from an image, against known poses, SciPy's least squares and chance."""

import numpy as np
import pytest
from oracles.se3 import hat, log
from scipy.linalg import expm
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from vsctrl.errors import InputError
from vsctrl.servo.estimation.pose_from_image import pose_from_image

FX, FY = 700.0, 650.0
LEDS = np.array([[-0.125, -0.075, 0], [0.125, -0.075, 0], [0.125, 0.075, 0], [-0.125, 0.075, 0]])
SOLID = np.vstack([LEDS, [[0.02, 0.05, 0.1], [-0.06, 0.03, -0.08]]])


def image_of(oTc, points):
    p = np.column_stack([points, np.ones(len(points))]) @ np.linalg.inv(oTc).T
    return (np.array([FX, FY]) * p[:, :2] / p[:, 2:3]).ravel()


def random_pose(rng):
    """A camera 0.5 to 1.5 m away, anywhere in a cone of 40° before the target, that looks at it."""
    turn = Rotation.from_euler("xyz", rng.uniform(-40, 40, 3), degrees=True).as_matrix()
    oTc = np.eye(4)
    oTc[:3, :3] = turn
    oTc[:3, 3] = -rng.uniform(0.5, 1.5) * turn[:, 2] + rng.normal(0, 0.03, 3)
    return oTc


def differences(oTc, points, h=1e-6):
    """Jacobian of the image with respect to the camera's twist, by central differences."""
    columns = [
        (image_of(oTc @ expm(h * hat(e)), points) - image_of(oTc @ expm(-h * hat(e)), points))
        for e in np.eye(6)
    ]
    return np.stack(columns, axis=1) / (2 * h)


@pytest.mark.parametrize("points", [LEDS, SOLID], ids=["plane", "solid"])
def test_poses_are_recovered_from_the_guess_of_a_frame_ago_and_from_afar(points):
    rng = np.random.default_rng(1)
    for _ in range(100):
        true = random_pose(rng)
        near = true @ expm(hat(rng.normal(0, 0.005, 6)))
        fit = pose_from_image(image_of(true, points), points, FX, FY, near)
        assert fit.ok
        assert fit.iterations <= 5
        # Rounding of the image, 1e-13 px, over the least singular value of L, > 10 px.
        np.testing.assert_allclose(fit.oTc, true, atol=1e-10)
        assert fit.residual_px < 1e-9
    for _ in range(100):
        true = random_pose(rng)
        # Up to 20° and decimetres away: a solid has no other minimum there.
        away = true @ expm(hat([*rng.normal(0, 0.1, 3), *rng.uniform(-0.35, 0.35, 3)]))
        fit = pose_from_image(image_of(true, SOLID), SOLID, FX, FY, away)
        assert fit.ok
        np.testing.assert_allclose(fit.oTc, true, atol=1e-10)


def test_a_frame_of_motion_takes_two_or_three_steps():
    # 4 cm/s and 5°/s for 40 ms: the guess is off by 1.6 mm and 3.5 mrad, some 5 px.
    rng = np.random.default_rng(2)
    counts = []
    for _ in range(100):
        true = random_pose(rng)
        guess = true @ expm(0.04 * hat([0.04, 0, 0, 0, np.deg2rad(5), 0]))
        noisy = image_of(true, LEDS) + rng.normal(0, 0.1, 8)
        counts.append(pose_from_image(noisy, LEDS, FX, FY, guess).iterations)
    assert np.median(counts) <= 3
    assert max(counts) <= 5


def test_three_points_give_the_pose_near_the_guess():
    rng = np.random.default_rng(3)
    for _ in range(50):
        true = random_pose(rng)
        near = true @ expm(hat(rng.normal(0, 1e-3, 6)))
        fit = pose_from_image(image_of(true, SOLID[2:5]), SOLID[2:5], FX, FY, near)
        assert fit.ok
        np.testing.assert_allclose(fit.oTc, true, atol=1e-8)


def test_noise_spreads_the_pose_as_the_inverse_information_says():
    rng = np.random.default_rng(4)
    true, sigma, runs = random_pose(rng), 0.05, 1200
    L = differences(true, SOLID)
    information = L.T @ L / sigma**2
    exact = image_of(true, SOLID)
    distances, errors, squares = [], [], []
    for _ in range(runs):
        noisy = exact + rng.normal(0, sigma, len(exact))
        fit = pose_from_image(noisy, SOLID, FX, FY, true)
        assert fit.ok
        error = log(np.linalg.inv(true) @ fit.oTc)
        errors.append(error)
        distances.append(error @ information @ error)
        squares.append(len(exact) * fit.residual_px**2 / sigma**2)
    low, high = chi2.ppf([1e-3, 1 - 1e-3], 6 * runs) / runs
    assert low < np.mean(distances) < high
    # A deviation is known to 1/√(2·1200) = 2 %.
    spread = np.sqrt(np.diag(np.linalg.inv(information)))
    np.testing.assert_allclose(np.std(errors, axis=0), spread, rtol=0.08)
    # The residual has what the six unknowns leave of the twelve coordinates.
    low, high = chi2.ppf([1e-3, 1 - 1e-3], 6 * runs) / runs
    assert low < np.mean(squares) < high


@pytest.mark.parametrize("sigma", [0.5, 5.0, 30.0])
def test_it_finds_the_minimum_that_scipy_finds(sigma):
    rng = np.random.default_rng(5)
    for _ in range(20):
        true = random_pose(rng)
        noisy = image_of(true, SOLID) + rng.normal(0, sigma, 12)
        other = least_squares(
            lambda T, g=true, s=noisy: image_of(g @ expm(hat(T)), SOLID) - s,
            np.zeros(6),
            method="lm",
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
        )
        fit = pose_from_image(noisy, SOLID, FX, FY, true @ expm(hat(rng.normal(0, 0.02, 6))))
        assert fit.ok
        # SciPy's differences leave its minimum at about 1e-8 of the scale.
        np.testing.assert_allclose(fit.oTc, true @ expm(hat(other.x)), atol=1e-6)
        assert fit.residual_px == pytest.approx(np.sqrt(2 * other.cost / 12), rel=1e-9)


def test_far_guesses_end_in_a_minimum_or_say_no():
    rng = np.random.default_rng(6)
    found = 0
    for _ in range(200):
        true = random_pose(rng)
        away = true @ expm(hat([*rng.normal(0, 0.3, 3), *rng.uniform(-1.2, 1.2, 3)]))
        fit = pose_from_image(image_of(true, SOLID), SOLID, FX, FY, away)
        assert np.isfinite(fit.oTc).all()
        found += bool(np.abs(fit.oTc - true).max() < 1e-8)
        if fit.ok:
            # Another minimum is a minimum: no twist lowers the error to first order.
            error = image_of(fit.oTc, SOLID) - image_of(true, SOLID)
            gradient = differences(fit.oTc, SOLID).T @ error
            assert np.abs(gradient).max() < 1e-3 * max(1.0, float(np.linalg.norm(error)))
    # Others begin with a point behind the camera, and four end between minima. Plain Gauss-Newton
    # finds 166.
    assert found > 168


def test_what_is_ok_has_the_target_in_front_of_the_camera():
    # A plane looks the same from in front and, mirrored, from a camera that has it behind.
    rng = np.random.default_rng(9)
    count = 0
    for _ in range(300):
        turn = expm(hat([*rng.normal(0, 0.5, 3), *rng.uniform(-1.5, 1.5, 3)]))
        fit = pose_from_image(
            image_of(random_pose(rng), LEDS), LEDS, FX, FY, random_pose(rng) @ turn
        )
        depths = (LEDS - fit.oTc[:3, 3]) @ fit.oTc[:3, 2]
        count += fit.ok
        assert not fit.ok or np.all(depths > 0)
    assert count > 100


def test_an_image_without_an_answer_is_said_and_never_raised():
    rng = np.random.default_rng(7)
    true = random_pose(rng)
    image = image_of(true, LEDS)
    behind = true.copy()
    behind[:3, 3] += 3 * true[:3, 2]
    line = np.array([[-0.1, 0, 0], [0, 0, 0], [0.05, 0, 0], [0.1, 0, 0]])
    nothing = np.array([0.0, np.nan, *image[2:]])
    trouble = [
        (image, LEDS, behind),
        (image[:4], LEDS[:2], true),
        (image_of(true, line), line, true),
        (image_of(true, LEDS[[0, 0, 0]]), LEDS[[0, 0, 0]], true),
        (nothing, LEDS, true),
        (image, LEDS, np.full((4, 4), np.nan)),
        (np.full(8, 1e200), LEDS, true),
    ]
    for image_, points, guess in trouble:
        fit = pose_from_image(image_, points, FX, FY, guess)
        assert not fit.ok
        np.testing.assert_array_equal(np.isfinite(fit.oTc), np.isfinite(guess))
        assert not np.isnan(fit.residual_px)


MIRRORED = np.diag([-1.0, 1.0, 1.0, 1.0])
MALFORMED = {
    "points a number": ({"points": 3}, r"points: an array of shape \(\) is no list of points"),
    "points in a plane": ({"points": LEDS[:, :2]}, r"points: an array of shape \(4, 2\)"),
    "points of text": ({"points": "abc"}, "points: this is no array of real numbers"),
    "ragged image": ({"image": [[1.0], [2.0, 3.0]]}, "image: this is no array of real numbers"),
    "complex image": ({"image": np.ones(8) * 1j}, "image: this is no array of real numbers"),
    "short image": ({"image": np.ones(6)}, r"image: an array of shape \(6,\) .*of 4 points; give"),
    "Fx 0": ({"Fx": 0}, "Fx: 0 is no focal length"),
    "Fx negative": ({"Fx": -FX}, "Fx: -700.0 is no focal length"),
    "Fx NaN": ({"Fx": float("nan")}, "Fx: nan is no focal length"),
    "Fy infinite": ({"Fy": float("inf")}, "Fy: inf is no focal length"),
    "Fy text": ({"Fy": "wide"}, "Fy: 'wide' is no focal length"),
    "Fy none": ({"Fy": None}, "Fy: None is no focal length"),
    "guess of 3": ({"guess": np.eye(3)}, r"guess: an array of shape \(3, 3\) is no pose"),
    "guess 0": ({"guess": np.zeros((4, 4))}, "guess: the matrix is no rigid motion"),
    "guess scaled": ({"guess": np.diag([2.0, 2.0, 2.0, 1.0])}, "guess: the matrix is no rigid"),
    "guess huge": ({"guess": np.full((4, 4), 1e200)}, "guess: the matrix is no rigid"),
    "guess mirrored": ({"guess": MIRRORED}, "guess: the matrix is no rigid"),
}


@pytest.mark.parametrize("name", MALFORMED)
def test_arguments_that_no_image_leads_to_are_refused_in_a_sentence(name):
    changes, sentence = MALFORMED[name]
    pose = random_pose(np.random.default_rng(10))
    given = {"image": image_of(pose, LEDS), "points": LEDS, "Fx": FX, "Fy": FY, "guess": pose}
    with pytest.raises(InputError, match=sentence) as found:
        pose_from_image(**given | changes)
    assert str(found.value).endswith(".")


def test_images_of_chance_never_break_it():
    rng = np.random.default_rng(8)
    for _ in range(100):
        scale = 10.0 ** rng.uniform(0, 6)
        fit = pose_from_image(rng.normal(0, scale, 8), LEDS, FX, FY, random_pose(rng))
        assert np.isfinite(fit.oTc).all()
        assert np.isfinite(fit.residual_px)
        R = fit.oTc[:3, :3]
        np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-12)
