"""Points of a target from images along a way, against known points, SciPy and chance."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from vsctrl.errors import InputError
from vsctrl.servo.estimation.triangulation import LEAST_PARALLAX_DEG, target_from_motion

FX, FY = 700.0, 650.0


def scene(rng, n=12, p=6):
    """Cameras within half a metre of each other that look at points a metre away."""
    poses = np.tile(np.eye(4), (n, 1, 1))
    turns = Rotation.from_euler("xyz", rng.uniform(-10, 10, (n, 3)), degrees=True)
    poses[:, :3, :3] = turns.as_matrix()
    poses[:, :3, 3] = np.array([3, -2, 1]) + rng.uniform(-0.25, 0.25, (n, 3))
    points = np.array([3, -2, 2.2]) + rng.uniform(-0.3, 0.3, (p, 3))
    return poses, points


def image_of(pose, point):
    x, y, z = pose[:3, :3].T @ (point - pose[:3, 3])
    return np.array([FX * x / z, FY * y / z])


def images_of(poses, points):
    return np.array([np.concatenate([image_of(g, P) for P in points]) for g in poses])


def differences(poses, point, h=1e-6):
    columns = [
        (images_of(poses, [point + h * e]) - images_of(poses, [point - h * e])).ravel() / (2 * h)
        for e in np.eye(3)
    ]
    return np.stack(columns, axis=1)


def test_exact_images_give_the_exact_points():
    rng = np.random.default_rng(1)
    for _ in range(20):
        poses, points = scene(rng, n=int(rng.integers(2, 20)))
        found = target_from_motion(
            images_of(poses, points), poses, np.ones((len(poses), 6)), FX, FY
        )
        good = found.parallax_deg >= LEAST_PARALLAX_DEG
        assert found.ok.tolist() == good.tolist()
        # Images are rounded to 1e-13 px; at a degree of parallax a pixel is about 0.1 m.
        np.testing.assert_allclose(found.points[good], points[good], atol=1e-11)


def test_hidden_images_are_left_out_whatever_they_hold():
    rng = np.random.default_rng(2)
    poses, points = scene(rng)
    images, visible = images_of(poses, points), rng.random((12, 6)) > 0.4
    hidden = np.repeat(~visible, 2, axis=1)
    images[hidden] = rng.choice([np.nan, np.inf, 1e300, 5.0], hidden.sum())
    found = target_from_motion(images, poses, visible, FX, FY)
    np.testing.assert_allclose(found.points, points, atol=1e-11)
    # Each point is that of its own images alone.
    for i in range(6):
        rows = visible[:, i]
        alone = target_from_motion(
            images[rows, 2 * i : 2 * i + 2], poses[rows], visible[rows, i : i + 1], FX, FY
        )
        np.testing.assert_allclose(
            alone.covariance_per_px2[0], found.covariance_per_px2[i], rtol=1e-9
        )
        assert alone.parallax_deg[0] == pytest.approx(found.parallax_deg[i], rel=1e-9)
    # A number that is none is left out without being told.
    images = images_of(poses, points)
    images[3, 4] = np.nan
    assert target_from_motion(images, poses, np.ones((12, 6)), FX, FY).ok.all()


@pytest.mark.parametrize("sigma", [0.3, 10.0])
def test_noisy_points_are_those_of_scipy(sigma):
    rng = np.random.default_rng(3)
    poses, points = scene(rng)
    images = images_of(poses, points) + rng.normal(0, sigma, (12, 12))
    found = target_from_motion(images, poses, np.ones((12, 6)), FX, FY)
    assert found.ok.all()
    for i, point in enumerate(points):
        other = least_squares(
            lambda P, i=i: (images_of(poses, [P]) - images[:, 2 * i : 2 * i + 2]).ravel(),
            point,
            method="lm",
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
        )
        np.testing.assert_allclose(found.points[i], other.x, atol=1e-7)
        J = differences(poses, other.x)
        np.testing.assert_allclose(
            found.covariance_per_px2[i], np.linalg.inv(J.T @ J), rtol=1e-5, atol=1e-12
        )


def test_bad_geometry_and_much_noise_still_end_in_the_minimum():
    # Two degrees of parallax or so, and 4 px: the linear start is far off along the ray.
    rng = np.random.default_rng(10)
    for _ in range(40):
        poses, points = scene(rng, n=4)
        poses[:, :3, 3] = poses[0, :3, 3] + 0.15 * (poses[:, :3, 3] - poses[0, :3, 3])
        images = images_of(poses, points) + rng.normal(0, 4, (4, 12))
        found = target_from_motion(images, poses, np.ones((4, 6)), FX, FY)
        assert found.ok.tolist() == (found.parallax_deg >= LEAST_PARALLAX_DEG).tolist()
        for i in np.flatnonzero(found.ok):
            error = (
                images_of(poses, found.points[i : i + 1]) - images[:, 2 * i : 2 * i + 2]
            ).ravel()
            J = differences(poses, found.points[i])
            step = np.linalg.lstsq(J, error)[0]
            assert np.abs(J @ step).max() < 1e-4  # px: the image error is orthogonal to J


def test_little_parallax_is_fitted_but_not_relied_on():
    # Half a degree: exact images still give the exact point.
    poses = np.tile(np.eye(4), (5, 1, 1))
    poses[:, 0, 3] = np.linspace(0, np.tan(np.deg2rad(0.5)), 5)
    found = target_from_motion(images_of(poses, [[0, 0, 1.0]]), poses, np.ones((5, 1)), FX, FY)
    np.testing.assert_allclose(found.points[0], [0, 0, 1], atol=1e-10)
    assert found.parallax_deg[0] == pytest.approx(0.5, rel=1e-8)
    assert np.isfinite(found.covariance_per_px2).all()
    assert not found.ok[0]


def test_the_spread_over_many_runs_is_the_covariance():
    rng = np.random.default_rng(4)
    poses, points = scene(rng, p=1)
    runs, sigma = 4000, 0.3
    exact = np.tile(images_of(poses, points), (1, runs))
    found = target_from_motion(
        exact + rng.normal(0, sigma, exact.shape), poses, np.ones((12, runs)), FX, FY
    )
    J = differences(poses, points[0])
    error = found.points - points[0]
    squares = np.einsum("mi,ij,mj->m", error, J.T @ J / sigma**2, error)
    low, high = chi2.ppf([1e-3, 1 - 1e-3], 3 * runs) / runs
    assert low < squares.mean() < high
    # 4000 runs know a variance to √(2/4000) = 2.2 %.
    np.testing.assert_allclose(
        np.diag(np.cov(error.T)), sigma**2 * np.diag(np.linalg.inv(J.T @ J)), rtol=0.09
    )


def test_parallax_is_the_angle_at_the_point():
    # Two cameras 0.2 m apart, 1 m before the point: 2 atan(0.1). A third one between adds nothing.
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[:, 0, 3] = [-0.1, 0.1, 0.02]
    found = target_from_motion(images_of(poses, [[0, 0, 1.0]]), poses, np.ones((3, 1)), FX, FY)
    assert found.parallax_deg[0] == pytest.approx(np.degrees(2 * np.arctan(0.1)), rel=1e-9)


def test_many_frames_are_compared_with_all_others():
    poses = np.tile(np.eye(4), (1500, 1, 1))
    poses[:, 0, 3] = 0.1 * np.cos(np.arange(1500))
    poses[700, 0, 3], poses[1200, 0, 3] = 0.3, -0.3
    found = target_from_motion(images_of(poses, [[0, 0, 1.0]]), poses, np.ones((1500, 1)), FX, FY)
    assert found.parallax_deg[0] == pytest.approx(np.degrees(2 * np.arctan(0.3)), rel=1e-9)


def test_points_without_parallax_are_finite_and_not_ok():
    rng = np.random.default_rng(5)
    poses, points = scene(rng)
    images = images_of(poses, points)
    visible = np.ones((12, 6), bool)
    visible[:, 0] = False
    visible[1:, 1] = False
    found = target_from_motion(images, poses, visible, FX, FY)
    assert found.ok.tolist() == [False, False, True, True, True, True]
    assert found.parallax_deg[0] == 0
    assert found.parallax_deg[1] == 0
    assert np.isfinite(found.points).all()
    assert np.isposinf(np.diagonal(found.covariance_per_px2, axis1=1, axis2=2)[:2]).all()
    assert not np.isnan(found.covariance_per_px2).any()

    # A camera that only turns: every ray of a point is the same line in space.
    poses[:, :3, 3] = poses[0, :3, 3]
    found = target_from_motion(
        images_of(poses, points) + rng.normal(0, 0.2, (12, 12)), poses, np.ones((12, 6)), FX, FY
    )
    assert not found.ok.any()
    assert np.isfinite(found.points).all()
    assert not np.isnan(found.covariance_per_px2).any()
    assert np.all(found.parallax_deg < 1e-5)


def test_a_point_in_the_direction_of_travel_has_no_parallax():
    poses = np.tile(np.eye(4), (20, 1, 1))
    poses[:, 2, 3] = np.linspace(0, 0.3, 20)
    points = np.array([[0, 0, 1.0], [0.3, 0, 1.0]])
    rng = np.random.default_rng(6)
    noisy = images_of(poses, points) + rng.normal(0, 0.1, (20, 4))
    found = target_from_motion(noisy, poses, np.ones((20, 2)), FX, FY)
    assert found.ok.tolist() == [False, True]
    np.testing.assert_allclose(found.points[1], points[1], atol=5e-3)


def test_images_of_chance_never_break_it():
    rng = np.random.default_rng(7)
    for _ in range(40):
        poses, _ = scene(rng)
        images = rng.normal(0, 10.0 ** rng.uniform(0, 11), (12, 12))
        found = target_from_motion(images, poses, rng.random((12, 6)) > 0.5, FX, FY)
        assert np.isfinite(found.points).all()
        assert not np.isnan(found.covariance_per_px2).any()
        assert np.isfinite(found.parallax_deg).all()


def test_what_is_ok_lies_in_front_of_the_cameras_that_saw_it():
    # Images of chance, such as no point makes: some fits are drawn through a camera.
    rng = np.random.default_rng(9)
    count = 0
    for _ in range(60):
        poses, _ = scene(rng, n=4)
        visible = rng.random((4, 6)) > 0.2
        found = target_from_motion(rng.normal(0, 300, (4, 12)), poses, visible, FX, FY)
        for i in np.flatnonzero(found.ok):
            seen = poses[visible[:, i]]
            depths = np.einsum("kj,kj->k", seen[:, :3, 2], found.points[i] - seen[:, :3, 3])
            assert np.all(depths > 0)
            count += 1
    assert count > 50


def test_shapes_that_do_not_belong_together_are_refused():
    poses, points = scene(np.random.default_rng(8))
    images, visible = images_of(poses, points), np.ones((12, 6), bool)
    with pytest.raises(InputError, match=r"images: shape \(12, 12\) does not belong .*\(12, 5\)"):
        target_from_motion(images, poses, visible[:, :5], FX, FY)
    with pytest.raises(InputError, match=r"poses: shape \(11, 4, 4\) is not one pose per image"):
        target_from_motion(images, poses[1:], visible, FX, FY)
    with pytest.raises(InputError, match="poses: some are missing or not finite"):
        target_from_motion(images, np.full((12, 4, 4), np.nan), visible, FX, FY)
