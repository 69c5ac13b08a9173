"""The reference image s*(t) and its derivative, for every frame before the first.

The planner knows the image at t = 0 and how the camera shall move. It finds the points from that
image with the camera and the depths that it assumes, moves them and projects them again; where
its assumptions are right this is the image from the reference pose. What the law assumes is
another matter (``nominal_camera``).
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from vsctrl.arrays import Array
from vsctrl.errors import InputError
from vsctrl.servo.camera.camera import NEAREST, Camera, View
from vsctrl.servo.camera.lens import distorted, distorted_rate, undistorted
from vsctrl.servo.camera.sensor import CameraSensor
from vsctrl.servo.features.feature_sets import measures
from vsctrl.servo.motion.trajectory import Trajectory
from vsctrl.servo.pose import adjoint, exp, inverse


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """What is asked of the camera at each of n frames.

    pose: (n, 4, 4), oTc*(t_k), and image: (n, 2p), s*(t_k) in px. depths0: (p,) in m, the true ones
    at t = 0. compared_pose, compared: the pose, image and depths of the reference that the error is
    formed with (delayed where it is aligned, early where it is previewed). s: (n, m), its features;
    rate: (n, m), their derivative ds*/dt, per s, and twist: (n, 6), T*, both of the feed-forward.
    """

    pose: Array
    image: Array
    depths0: Array
    compared_pose: Array
    compared: View
    s: Array
    rate: Array
    twist: Array


@dataclass(frozen=True, slots=True, eq=False)
class Planner:
    """What s*(t) is computed with: the motion, the points as found at t = 0, and the camera.

    hand_eye: (4, 4), from the camera to where the hand assumes it, or None; reconstructed: (p, 3)
    in m in the camera frame at t = 0, None where every assumption is right and ``points`` serve.
    """

    trajectory: Trajectory
    points: Array
    camera: Camera
    k1: float
    centre: Array
    hand_eye: Array | None
    reconstructed: Array | None
    true_camera: Camera

    @classmethod
    def of(
        cls,
        trajectory: Trajectory,
        sensor: CameraSensor,
        *,
        focal_ratio: float = 1.0,
        depth_ratio: float = 1.0,
        centre_px: tuple[float, float] = (0.0, 0.0),
        k1: float | None = None,
        hand_eye: tuple[float, ...] = (0.0,) * 6,
    ) -> Self:
        """The planner of a motion seen by its true sensor, with errors as [reference_image] has."""
        true, points = sensor.camera, sensor.points
        camera = Camera(focal_ratio * true.Fx, focal_ratio * true.Fy)
        k1 = sensor.k1 if k1 is None else k1
        centre = np.tile(centre_px, len(points))
        twist = np.array(hand_eye)
        reconstructed = None
        wrong = focal_ratio != 1 or depth_ratio != 1 or k1 != sensor.k1
        if wrong or centre.any() or twist.any():
            p = true.points(trajectory.pose(0.0), points)
            image = distorted(true, true.features(p), sensor.k1) + centre
            X = undistorted(camera, image, k1).reshape(-1, 2) / [camera.Fx, camera.Fy]
            depths = depth_ratio * p[:, 2:]
            reconstructed = np.concatenate([X * depths, depths], axis=1)
        return cls(
            trajectory, points, camera, k1, centre,
            exp(twist) if twist.any() else None, reconstructed, true,
        )  # fmt: skip

    def plan(self, t: Array, at_error: Array, at_rate: Array, features: str) -> Plan:
        """The plan of the frames t: (n,) in s each, when reference and its derivative are taken.

        features: the law's, by name. Raises InputError where a point would be behind the camera.
        """
        now = self.image(t)
        compared = now if np.array_equal(at_error, t) else self.image(at_error)
        image, depths = now if np.array_equal(at_rate, t) else self.image(at_rate)
        pose, true = self.trajectory.pose(t), self.true_camera
        true_depths = true.points(self.trajectory.pose(at_error), self.points)[..., 2]
        return Plan(
            pose=pose,
            image=now.features,
            depths0=true.points(pose[0], self.points)[:, 2],
            compared_pose=self.pose(at_error),
            # L̂ at the reference has its true depths; what the law assumes is applied later.
            compared=View(compared.features, true_depths),
            s=measures(features, self.camera, len(self.points)).of(
                compared.features, compared.depths
            ),
            rate=self.rate(at_rate, image, depths, features),
            twist=self.twist(at_rate),
        )

    def image(self, t: Array) -> View:
        """s*(t) in px with the depths that it is computed with: (n, 2p), (n, p)."""
        if self.reconstructed is None:
            p = self.camera.points(self.trajectory.pose(t), self.points)
        else:
            p = self.camera.points(self._moved(t), self.reconstructed)
        nearest = p[..., 2].min(axis=-1)
        k = int(np.argmin(nearest))
        if not nearest[k] > NEAREST:  # argmin finds NaN first
            raise self._unseen(float(t[k]), float(nearest[k]))
        image = distorted(self.camera, self.camera.features(p), self.k1)
        return View(image - self.centre, p[..., 2])

    def _moved(self, t: Array) -> Array:
        """How the camera has moved since t = 0, as planned: (n,) in s → (n, 4, 4)."""
        moved: Array = inverse(self.trajectory.pose(0.0)) @ self.trajectory.pose(t)
        return moved if self.hand_eye is None else inverse(self.hand_eye) @ moved @ self.hand_eye

    def _unseen(self, t: float, depth: float) -> InputError:
        """A point of s*(t) is not in front of the camera."""
        where = (
            f"at t = {t:g} s a point of s*(t) would lie at depth {depth:.3g} m, behind the camera"
        )
        if self.reconstructed is None:
            return InputError(
                f"law.preview, vision.latency: the law looks beyond the frames of the motion, and "
                f"{where}; shorten these or the motion."
            )
        return InputError(
            f"reference_image: with these beliefs {where}; make reference_depth_ratio or the "
            "motion smaller."
        )

    def rate(self, t: Array, image: Array, depths: Array, features: str) -> Array:
        """ds*/dt of the features at the times t, (n, m) per s, from their image and depths."""
        T = self.twist(t)[..., None]
        if features != "points":
            L = measures(features, self.camera, len(self.points)).interaction(image, depths)
            return np.squeeze(L @ T, -1)
        if not self.k1:
            return np.squeeze(self.camera.interaction(image + self.centre, depths) @ T, -1)
        ideal = undistorted(self.camera, image + self.centre, self.k1)
        rate = np.squeeze(self.camera.interaction(ideal, depths) @ T, -1)
        return distorted_rate(self.camera, ideal, rate, self.k1)

    def pose(self, t: Array) -> Array:
        """The reference pose as planned, (n, 4, 4), from the true one at t = 0."""
        true = self.trajectory.pose(t)
        if self.hand_eye is None:
            return true
        start = self.trajectory.pose(0.0)
        return start @ inverse(self.hand_eye) @ inverse(start) @ true @ self.hand_eye

    def twist(self, t: Array) -> Array:
        """T* as planned, (n, 6)."""
        T = self.trajectory.twist_at_frames(t)
        if self.hand_eye is None:
            return T
        return np.squeeze(adjoint(inverse(self.hand_eye)) @ T[..., None], -1)
