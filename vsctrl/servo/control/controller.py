"""What the computer does in a frame: from the image that it is given to the twist it commands.

Two schemes: servo on features of the image (the paper's), or on the pose that is found from it.
Both are the law (10) with what the scenario adds to it: prediction, integral, other gains. How
old the image is, and what becomes of the twist, is decided elsewhere.

Source of the pose scheme: Chaumette and Hutchinson, Visual servo control, part I (IEEE Robotics and
Automation Magazine 2006), section on PBVS with s = (c*tc, θu).
"""

import numpy as np

from vsctrl.arrays import Array, Mask
from vsctrl.servo.control.depths import Depths
from vsctrl.servo.control.gain_schedule import GainSchedule
from vsctrl.servo.control.law import Command, Interaction, Law
from vsctrl.servo.control.measurement import ControlAction, Measurement
from vsctrl.servo.control.nominal_camera import NominalCamera
from vsctrl.servo.control.prediction import Predictor
from vsctrl.servo.control.reference_image import Plan
from vsctrl.servo.estimation.pose_from_image import pose_from_image
from vsctrl.servo.features.feature_sets import Points
from vsctrl.servo.pose import adjoint, inverse, log


class ImageController:
    """The law (10) on features of the image, at the frames t (n,) in s of a plan."""

    def __init__(
        self,
        law: Law,
        nominal: NominalCamera,
        plan: Plan,
        t: Array,
        *,
        interaction: Interaction,
        depths: Depths,
        gains: GainSchedule | None = None,
        predictor: Predictor | None = None,
    ) -> None:
        self._law, self._nominal, self._plan, self._t = law, nominal, plan, t
        self._features = nominal.features
        self._plain = isinstance(nominal.features, Points)
        self._choice = interaction
        self._gains, self._predictor = gains, predictor
        self.depths = depths
        self._initial: Array | None = None
        self._desired: Array | None = None
        if interaction in ("desired", "mean") and depths.of_reference is not None:
            self._desired = nominal.interaction(plan.compared.features, depths.of_reference)

    @property
    def width(self) -> int:
        """Number of features, m."""
        return self._plan.s.shape[1]

    def control(self, measurement: Measurement, applied: Array, saturated: bool) -> ControlAction:
        """The twist for a frame; applied: (6,), the last frame's as the hand reports it;
        saturated: the robot did less than its command."""
        k, depths, image = measurement.frame, self.depths(measurement), measurement.features
        L_hat = self._interaction(k, image, depths)
        s = image if self._plain else self._features.of(image, depths)
        rows, rate, drift = self._rows(measurement, depths), self._plan.rate[k], None
        if self._predictor is not None:
            s, drift = self._predictor(s, L_hat, measurement._replace(rows=rows), applied)
            drift = drift / self._law.lam  # so that L̂⁺ ∂ŝ/∂t is taken away
        e = s - self._plan.s[k] if self._plain else self._features.difference(s, self._plan.s[k])
        started = e if self._gains is None else self._gains.smooth_started(e, float(self._t[k]))
        seen = e
        if rows is not None:
            L_hat, rate, started, seen = L_hat[rows], rate[rows], started[rows], e[rows]
            drift = None if drift is None else drift[rows]
        T, rank = np.zeros(6), 0
        if len(L_hat):
            T, rank = self._twist(L_hat, seen, started, drift, rate, saturated)
        if self._predictor is not None:
            self._predictor.commanded(T)
        return ControlAction(T, rank, e)

    def _twist(
        self,
        L_hat: Array,
        e: Array,
        started: Array,
        drift: Array | None,
        rate: Array,
        saturated: bool,
    ) -> Command:
        """The twist of the features that are seen, with all that the gain may be."""
        gains = self._gains
        factor = 1.0 if gains is None else gains.factor(e)
        weighed = started if factor == 1 else factor * started
        command = self._law.twist(L_hat, weighed if drift is None else weighed + drift, rate)
        if gains is None or not gains.integrates:
            return command
        wanted = self._law.twist(L_hat, started, np.zeros_like(rate)).T / -self._law.lam
        more = self._law.lam * factor * gains.integral(wanted, saturated)
        return Command(command.T - more, command.rank)

    def _interaction(self, k: int, image: Array, depths: Array) -> Array:
        """L̂ where the law takes it, (m, 6)."""
        if self._choice == "initial":
            if self._initial is None:
                self._initial = self._nominal.interaction(image, depths)
            return self._initial
        if self._choice == "current":
            return self._nominal.interaction(image, depths)
        if self._desired is None:
            L_desired = self._nominal.interaction(self._plan.compared.features[k], depths)
        else:
            L_desired = self._desired[k]
        if self._choice == "desired":
            return L_desired
        return (self._nominal.interaction(image, depths) + L_desired) / 2

    def _rows(self, measurement: Measurement, depths: Array) -> Mask | None:
        """Which features the image shows, None if all of them."""
        visible = measurement.visible
        rows = None if visible is None else self._features.rows(visible)
        if self._plain:
            return rows
        usable = self._features.usable(measurement.features, depths)
        if usable.all():
            return rows
        return usable if rows is None else rows & usable


class PoseController:
    """The law on the pose: ``T = −λ (Rᵀ t, θu) + k_ff Ad(cTc*) T*`` with ``(R, t) = c*Tc``.

    The pose is fitted to the points (p, 3) in m of each image with the nominal camera, beginning
    at the last one. Its error (6,) is (Rᵀ t, θu) in m and rad.
    """

    width = 6

    def __init__(
        self,
        law: Law,
        nominal: NominalCamera,
        plan: Plan,
        t: Array,
        *,
        points: Array,
        gains: GainSchedule | None = None,
    ) -> None:
        self._law, self._nominal, self._plan, self._t = law, nominal, plan, t
        self._points, self._gains = points, gains
        self._guess = plan.compared_pose[0]
        self._fitted = False

    def control(self, measurement: Measurement, applied: Array, saturated: bool) -> ControlAction:
        """The twist for a frame; arguments as for ``ImageController.control``.

        Rank 0 where no pose fits the image: then the twist is the feed-forward alone.
        """
        k = measurement.frame
        if measurement.fresh:
            self._fitted = self._fit(measurement)
        error_pose = inverse(self._plan.compared_pose[k]) @ self._guess  # c*Tc
        e = np.concatenate([error_pose[:3, :3].T @ error_pose[:3, 3], log(error_pose)[3:]])
        if not self._fitted:
            return ControlAction(self._forward(k), 0, e)
        gains, wanted, factor = self._gains, e, 1.0
        if gains is not None:
            started, factor = gains.smooth_started(e, float(self._t[k])), gains.factor(e)
            wanted = started + gains.integral(started, saturated)
        return ControlAction(self._forward(k) - self._law.lam * factor * wanted, 6, e)

    def _fit(self, measurement: Measurement) -> bool:
        camera, points = self._nominal.camera, self._points
        image = self._nominal.shifted(measurement.features)
        if measurement.visible is not None:
            image = image.reshape(-1, 2)[measurement.visible].ravel()
            points = points[measurement.visible]
        if len(points) < 3:
            return False
        fit = pose_from_image(image, points, camera.Fx, camera.Fy, self._guess)
        if fit.ok:
            self._guess = fit.oTc
        return fit.ok

    def _forward(self, k: int) -> Array:
        """The twist of the reference, seen from where the camera is: (6,)."""
        if not self._law.k_ff:
            return np.zeros(6)
        seen = adjoint(inverse(self._guess) @ self._plan.compared_pose[k])
        return self._law.k_ff * (seen @ self._plan.twist[k])


Controller = ImageController | PoseController
