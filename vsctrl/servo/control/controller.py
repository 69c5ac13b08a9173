"""What the computer does in a frame: from the image that it is shown to the twist it asks for.

Two schemes: servo on features of the image (the paper's), or on the pose that is found from it.
Both are the law (10) with what the scenario adds to it: prediction, integral, other gains. How
late the image is, and what becomes of the twist, is decided elsewhere.

Source of the pose scheme: Chaumette and Hutchinson, Visual servo control, part I (IEEE Robotics and
Automation Magazine 2006), section on PBVS with s = (c*tc, θu).
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vsctrl.servo.control.depths import Depths, depths_of
from vsctrl.servo.control.gain_schedule import Shaping
from vsctrl.servo.control.law import Command, Law
from vsctrl.servo.control.nominal_camera import Belief
from vsctrl.servo.control.prediction import predictor_of
from vsctrl.servo.control.reference_image import Plan
from vsctrl.servo.estimation.pose_from_image import pose_from_image
from vsctrl.servo.pose import adjoint, inverse, log

if TYPE_CHECKING:
    from vsctrl.servo.scenario import Scenario

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


class Shown(NamedTuple):
    """What the law is shown at a frame.

    frame: k; features: (2p,) in px as measured; depths: (p,) in m, the true ones of that image;
    visible: which points it shows, None if all; fresh: whether the image is new; odometry: gives
    the pose of the believed camera in the world when the image was taken, (4, 4); rows: (m,),
    which features of the law it shows, None if all (the controller's to fill).
    """

    frame: int
    features: Array
    depths: Array
    visible: Mask | None
    fresh: bool
    odometry: Callable[[], Array]
    rows: Mask | None = None


class Ask(NamedTuple):
    """What a frame ends with: twist (6,), rank of L̂, and the error (m,) that the law saw."""

    T: Array
    rank: int
    e: Array


class ImageController:
    """The law (10) on features of the image."""

    def __init__(self, scenario: "Scenario", plan: Plan, t: Array) -> None:
        self.belief = Belief.of(scenario)
        self._features = self.belief.features
        self._plain = scenario.law.features == "points"
        self._law = Law(scenario.law.lam, scenario.law.k_ff)
        self._plan = plan
        self._t = t
        self._choice = scenario.law.interaction
        self._shaping = Shaping.of(scenario.law, scenario.vision.period)
        self._predictor = predictor_of(scenario)
        self.depths: Depths = depths_of(scenario, self.belief, plan)
        self._initial: Array | None = None
        known = self.depths.of_reference
        self._desired: Array | None = None
        if self._choice in ("desired", "mean") and known is not None:
            self._desired = self.belief.interaction(plan.shown.features, known)

    @property
    def width(self) -> int:
        """Number of features, m."""
        return self._plan.s.shape[1]

    def ask(self, shown: Shown, applied: Array, held: bool) -> Ask:
        """The twist for a frame; applied: (6,), the last frame's as the hand reports it; held: the
        robot did less than it was told."""
        k, depths = shown.frame, self.depths(shown)
        L_hat = self._interaction(k, shown.features, depths)
        s = shown.features if self._plain else self._features.of(shown.features, depths)
        rows, rate, drift = self._rows(shown, depths), self._plan.rate[k], None
        if self._predictor is not None:
            s, drift = self._predictor(s, L_hat, shown._replace(rows=rows), applied)
        e = s - self._plan.s[k] if self._plain else self._features.difference(s, self._plan.s[k])
        drift = None if drift is None else drift / self._law.lam  # so that L̂⁺ ∂ŝ/∂t is taken away
        weighed = e if self._shaping is None else self._shaping.eased(e, float(self._t[k]))
        if rows is not None:
            L_hat, rate, weighed = L_hat[rows], rate[rows], weighed[rows]
            drift = None if drift is None else drift[rows]
        T, rank = np.zeros(6), 0
        if len(L_hat):
            seen = e if rows is None else e[rows]
            T, rank = self._twist(L_hat, seen, weighed, drift, rate, held)
        if self._predictor is not None:
            self._predictor.told(T)
        return Ask(T, rank, e)

    def _twist(
        self, L_hat: Array, e: Array, eased: Array, drift: Array | None, rate: Array, held: bool
    ) -> Command:
        """The twist of the features that are seen, with all that the gain may be."""
        shaping = self._shaping
        factor = 1.0 if shaping is None else shaping.factor(e)
        weighed = eased if factor == 1 else factor * eased
        command = self._law.twist(L_hat, weighed if drift is None else weighed + drift, rate)
        if shaping is None or not shaping.sums:
            return command
        asked = self._law.twist(L_hat, eased, np.zeros_like(rate)).T / -self._law.lam
        more = self._law.lam * factor * shaping.summed(asked, held)
        return Command(command.T - more, command.rank)

    def _interaction(self, k: int, image: Array, depths: Array) -> Array:
        """L̂ where the law takes it, (m, 6)."""
        if self._choice == "initial":
            if self._initial is None:
                self._initial = self.belief.interaction(image, depths)
            return self._initial
        if self._choice == "current":
            return self.belief.interaction(image, depths)
        if self._desired is None:
            L_desired = self.belief.interaction(self._plan.shown.features[k], depths)
        else:
            L_desired = self._desired[k]
        if self._choice == "desired":
            return L_desired
        return (self.belief.interaction(image, depths) + L_desired) / 2

    def _rows(self, shown: Shown, depths: Array) -> Mask | None:
        """Which features the image shows, None if all of them."""
        rows = None if shown.visible is None else self._features.rows(shown.visible)
        if self._plain:
            return rows
        usable = self._features.usable(shown.features, depths)
        if usable.all():
            return rows
        return usable if rows is None else rows & usable


class PoseController:
    """The law on the pose: ``T = −λ (Rᵀ t, θu) + k_ff Ad(cTc*) T*`` with ``(R, t) = c*Tc``.

    The pose is fitted to the points of each image with the camera that the law believes in,
    beginning at the last one. Its error (6,) is (Rᵀ t, θu) in m and rad.
    """

    width = 6

    def __init__(self, scenario: "Scenario", plan: Plan, t: Array) -> None:
        self.belief = Belief.of(scenario)
        self._law = scenario.law
        self._plan = plan
        self._t = t
        self._points = np.array(scenario.target.points)
        self._shaping = Shaping.of(scenario.law, scenario.vision.period)
        self._guess = plan.shown_pose[0]
        self._found = False

    def ask(self, shown: Shown, applied: Array, held: bool) -> Ask:
        """The twist for a frame; arguments as for ``ImageController.ask``.

        Rank 0 where no pose fits the image: then the twist is the feed-forward alone.
        """
        k = shown.frame
        if shown.fresh:
            self._found = self._fit(shown)
        reference = self._plan.shown_pose[k]
        away = inverse(reference) @ self._guess  # c*Tc
        e = np.concatenate([away[:3, :3].T @ away[:3, 3], log(away)[3:]])
        if not self._found:
            return Ask(self._forward(k), 0, e)
        shaping, asked, factor = self._shaping, e, 1.0
        if shaping is not None:
            eased, factor = shaping.eased(e, float(self._t[k])), shaping.factor(e)
            asked = eased + shaping.summed(eased, held)
        return Ask(self._forward(k) - self._law.lam * factor * asked, 6, e)

    def _fit(self, shown: Shown) -> bool:
        belief, image, points = self.belief, shown.features, self._points
        if belief.shift is not None:
            image = image + belief.shift
        if shown.visible is not None:
            image = image.reshape(-1, 2)[shown.visible].ravel()
            points = points[shown.visible]
        if len(points) < 3:
            return False
        fit = pose_from_image(image, points, belief.camera.Fx, belief.camera.Fy, self._guess)
        if fit.ok:
            self._guess = fit.oTc
        return fit.ok

    def _forward(self, k: int) -> Array:
        """The twist of the reference, seen from where the camera is: (6,)."""
        if not self._law.k_ff:
            return np.zeros(6)
        seen = adjoint(inverse(self._guess) @ self._plan.shown_pose[k])
        out: Array = self._law.k_ff * (seen @ self._plan.twist[k])
        return out


Controller = ImageController | PoseController


def controller(scenario: "Scenario", plan: Plan, t: Array) -> Controller:
    """The controller of a scenario."""
    make = PoseController if scenario.law.scheme == "pose" else ImageController
    return make(scenario, plan, t)
