"""The reference image s*(t) and its derivative, for every frame before the first.

The planner knows the image at t = 0 and how the camera shall move. It finds the points from that
image with the camera and the depths that it believes in, moves them and projects them again; where
its beliefs are right this is the image from the reference pose. Which beliefs the law has is
another matter (``belief``).
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vsctrl.errors import InputError
from vsctrl.servo.camera.camera import NEAREST, Camera, View
from vsctrl.servo.camera.lens import distorted, distorted_rate, undistorted
from vsctrl.servo.features.feature_sets import measures
from vsctrl.servo.pose import adjoint, exp, inverse
from vsctrl.servo.timing import Delays, late

if TYPE_CHECKING:
    from vsctrl.servo.camera.sensor import Eye
    from vsctrl.servo.motion.trajectory import Trajectory
    from vsctrl.servo.scenario import Scenario

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """What is asked of the camera at each of n frames.

    pose: (n, 4, 4), oTc*(t_k), and image: (n, 2p), s*(t_k) in px. depths0: (p,) in m, the true ones
    at t = 0. shown_pose, shown: the pose,
    image and depths of the reference that the error is formed with (late where it is aligned,
    early where it is previewed). s: (n, m), its features; rate: (n, m), their derivative ds*/dt,
    per s, and twist: (n, 6), T*, both of the feed-forward.
    """

    pose: Array
    image: Array
    depths0: Array
    shown_pose: Array
    shown: View
    s: Array
    rate: Array
    twist: Array

    @classmethod
    def of(cls, scenario: "Scenario", eye: "Eye", t: Array, delays: Delays) -> "Plan":
        """The plan of a scenario, seen by its true eye, at its frames t (n,) in s.

        Raises InputError where the planner's beliefs put a point behind the camera.
        """
        law, period, planner = scenario.law, scenario.vision.period, _Planner.of(scenario, eye)
        at_error = late(t, period, delays.reference) + law.preview
        at_rate = t + (law.preview + law.preview_ff)
        now = planner.image(t)
        same = not (delays.reference or law.preview)
        shown = now if same else planner.image(at_error)
        image, depths = now if np.array_equal(at_rate, t) else planner.image(at_rate)
        pose = planner.trajectory.pose(t)
        true = eye.camera
        shown_pose = planner.pose(at_error)
        return cls(
            pose=pose,
            image=now.features,
            depths0=true.points(pose[0], planner.points)[:, 2],
            shown_pose=shown_pose,
            # L̂ at the reference has the true depths of it; the law's own beliefs are applied later.
            shown=View(
                shown.features,
                true.points(planner.trajectory.pose(at_error), planner.points)[..., 2],
            ),
            s=measures(law.features, planner.camera, len(planner.points)).of(
                shown.features, shown.depths
            ),
            rate=planner.rate(at_rate, image, depths, law.features),
            twist=planner.twist(at_rate),
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Planner:
    """What s*(t) is computed with: the motion, the points as found at t = 0, and the camera."""

    trajectory: "Trajectory"
    points: Array
    camera: Camera
    k1: float
    centre: Array
    hand_eye: Array | None  # (4, 4), from the camera to where the hand believes it
    found: Array | None  # (p, 3) in the camera frame at t = 0; None where every belief is right

    @classmethod
    def of(cls, scenario: "Scenario", true: "Eye") -> "_Planner":
        beliefs = scenario.reference_image
        trajectory = scenario.reference
        phi, ratio = beliefs.reference_focal_ratio, beliefs.reference_depth_ratio
        camera = Camera(phi * true.camera.Fx, phi * true.camera.Fy)
        k1 = true.k1 if beliefs.reference_k1 is None else beliefs.reference_k1
        centre = np.tile(beliefs.reference_centre_px, len(true.points))
        twist = np.array(beliefs.reference_hand_eye)
        found = None
        if phi != 1 or ratio != 1 or k1 != true.k1 or centre.any() or twist.any():
            p = true.camera.points(trajectory.pose(0.0), true.points)
            image = distorted(true.camera, true.camera.features(p), true.k1) + centre
            X = undistorted(camera, image, k1).reshape(-1, 2) / [camera.Fx, camera.Fy]
            depths = ratio * p[:, 2:]
            found = np.concatenate([X * depths, depths], axis=1)
        return cls(
            trajectory, true.points, camera, k1, centre,
            exp(twist) if twist.any() else None, found,
        )  # fmt: skip

    def image(self, t: Array) -> View:
        """s*(t) in px with the depths that it is computed with: (n, 2p), (n, p)."""
        if self.found is None:
            p = self.camera.points(self.trajectory.pose(t), self.points)
        else:
            p = self.camera.points(self._moved(t), self.found)
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
        if self.found is None:
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
        out: Array = start @ inverse(self.hand_eye) @ inverse(start) @ true @ self.hand_eye
        return out

    def twist(self, t: Array) -> Array:
        """T* as planned, (n, 6)."""
        T = self.trajectory.twist_at_frames(t)
        if self.hand_eye is None:
            return T
        return np.squeeze(adjoint(inverse(self.hand_eye)) @ T[..., None], -1)
