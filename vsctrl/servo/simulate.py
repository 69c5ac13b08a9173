"""The closed loop in six degrees of freedom: a fold over video frames that returns its states.

One frame is: see the target, show the law an image of the right age, ask it for a twist, move.
Everything about the reference is known beforehand (``control.plan``); what nature does is in
``plant``, what the computer does in ``control``, and who is late by how much in ``clock``. What a
run means (predictions, comparisons, plots) is left to the rooms above.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vsctrl import timing
from vsctrl.servo import faults
from vsctrl.servo.camera.camera import NEAREST
from vsctrl.servo.camera.sensor import Eye, Schedule, Sight
from vsctrl.servo.camera.target import Target
from vsctrl.servo.control.controller import Controller, PoseController, Shown, controller
from vsctrl.servo.control.reference_image import Plan
from vsctrl.servo.faults import Faults
from vsctrl.servo.pose import adjoint, exp, inverse
from vsctrl.servo.record import Record
from vsctrl.servo.results.run import Run, Status
from vsctrl.servo.robot.capability import Capability
from vsctrl.servo.robot.carrier import Carrier
from vsctrl.servo.robot.gantry import Gantry
from vsctrl.servo.timing import delays

if TYPE_CHECKING:
    from vsctrl.servo.scenario import Scenario

Array = NDArray[np.float64]

# The run counts as diverged once the camera is farther from its reference than this many times the
# scene (the greatest reference depth, or the distance at the start if that is more): no image would
# show the target any more, and numbers stay far from overflow.
DIVERGED = 100.0
# Points that hold six degrees of freedom.
FEWEST = 3


def simulate(scenario: "Scenario") -> Run:
    """Run an experiment frame by frame; a failure in the loop is a status, not an exception.

    Frame k at ``t_k = k Tₛ``; the twist of frame k is held over [t_k, t_k+1] and the pose follows
    as ``oTc · exp(T Tₛ)``, where robot and latency leave it so. Returns a Run with the frames 0..N,
    or fewer after a failure.
    """
    loop = _Loop(scenario)
    # Numbers that overflow are caught by the checks of every frame, in sentences.
    with np.errstate(all="ignore"):
        status = loop.run()
        return loop.record.run(
            scenario, loop.plan, loop.carrier, loop.controller, status, loop.faults
        )


class _Loop:
    """Everything that takes part in the frames of one run."""

    def __init__(self, scenario: "Scenario") -> None:
        vision, t = scenario.vision, scenario.t
        late = timing.in_periods(vision.latency, vision.period)
        ages = delays(scenario.law.placement, late)
        self.t = t
        self.target = Target(
            np.array(scenario.target.points), np.array(scenario.target.drift), scenario.target.sway
        )
        self.eye = Eye.of(scenario)
        self.plan = Plan.of(scenario, self.eye, t, ages)
        self.schedule = Schedule.of(vision, t, len(self.target.points), ages.measured)
        self.controller: Controller = controller(scenario, self.plan, t)
        self.carrier = _carrier(scenario, len(t), ages.command)
        self.hand_eye = _maybe(scenario.calibration.hand_eye)
        self.faults = Faults(scenario.faults)
        self.record = Record.of(len(t), len(self.target.points), self.controller.width)
        self.sights: list[Sight] = []
        self.wTo = None if self.target.still else self.target.pose(t)

    def run(self) -> Status:
        """Fill the record frame by frame, until the end or the fault that ends the run."""
        record, plan, carrier = self.record, self.plan, self.carrier
        t = self.t
        away = carrier.pose[:3, 3] - plan.pose[0, :3, 3]
        farthest = DIVERGED * max(float(plan.shown.depths.max()), float(np.linalg.norm(away)))
        before, applied, held = plan.image[0], np.zeros(6), False
        shown: Shown | None = None
        for k in range(len(t)):
            oTc = carrier.pose if self.wTo is None else inverse(self.wTo[k]) @ carrier.pose
            lag = oTc[:3, 3] - plan.pose[k, :3, 3]
            if not float(lag @ lag) ** 0.5 < farthest:  # written so that NaN fails too
                return self._diverged(k, farthest)
            sight = self.eye.look(oTc, before)
            if not sight.depths.min() > NEAREST:
                sentence = faults.behind(k, t[k], sight.depths)
                if ended := self.faults.met("target behind camera", k, sentence):
                    return ended
            before = sight.features
            self.sights.append(sight)
            record.pose[k], record.features[k], record.depths[k] = oTc, before, sight.depths
            if sight.visible is not None:
                record.visible[k] = sight.visible

            shown = self._shown(k, shown)
            ask = self.controller.ask(shown, applied, held)
            record.measured_error[k], record.command[k] = ask.e, ask.T
            carrier.move(ask.T)
            if ended := self._judged(k, shown, ask.rank):
                return ended
            applied, held = self._reported(carrier.applied), carrier.held
        return faults.completed(len(t))

    def _shown(self, k: int, before: Shown | None) -> Shown:
        """The image that the law is shown at frame k, after the one before."""
        schedule, carrier = self.schedule, self.carrier
        if before is not None and not schedule.fresh[k]:
            return before._replace(frame=k, fresh=False)
        m, taken = int(schedule.frame[k]), float(schedule.exposed[k])
        if m >= 0:
            sight = self.sights[m]
        else:
            oTc = carrier.at(taken)
            if self.wTo is not None:
                oTc = inverse(self.target.pose(taken)) @ oTc
            sight = self.eye.look(oTc, self.sights[-1].features)
        image = schedule.spoiled(sight.features, k)
        if sight.visible is not None and before is not None:
            # What is not seen keeps the place where it was last, so that no number is without one.
            image = np.where(np.repeat(sight.visible, 2), image, before.features)

        def odometry() -> Array:
            wTc = carrier.at(taken)
            return wTc if self.hand_eye is None else wTc @ self.hand_eye

        return Shown(k, image, sight.depths, sight.visible, True, odometry)

    def _reported(self, T: Array) -> Array:
        """A twist (6,) of the camera as the hand reports it: of the camera that it believes in."""
        return T if self.hand_eye is None else adjoint(inverse(self.hand_eye)) @ T

    def _diverged(self, k: int, farthest: float) -> Status:
        """The end of a run whose camera is too far from its reference at frame k."""
        still = self.target.still and not self.plan.twist.any()
        held = self.faults.since("saturated")
        sentence = faults.diverged(k, float(self.t[k]), farthest, still, held)
        return Status(False, "diverged", k, sentence)

    def _judged(self, k: int, shown: Shown, rank: int) -> Status | None:
        """The faults of a frame that was asked and moved; the status if one ends the run."""
        t, stop = float(self.t[k]), self.carrier.stopped
        ended = None
        left = FEWEST if shown.visible is None else int(shown.visible.sum())
        if left < FEWEST:
            kind, sentence = faults.lost(k, t, left)
            ended = self.faults.met(kind, k, sentence)
        elif rank < 6 and isinstance(self.controller, PoseController):
            ended = self.faults.met("pose not found", k, faults.no_pose(k, t))
        elif rank < 6:
            ended = self.faults.met("rank loss", k, faults.rank_loss(k, t, rank))
        if ended is not None:
            return ended
        if stop is not None and stop.joint is None:
            return Status(False, "diverged", k, faults.stopped(k, t, stop))
        if stop is not None:
            if ended := self.faults.met("joint limit", k, faults.stopped(k, t, stop)):
                return ended
            self.carrier.rest()
        elif self.carrier.held:
            self.faults.noted("saturated", k, faults.saturated(k, t))
        return None


def _carrier(scenario: "Scenario", frames: int, late: float) -> Carrier:
    """What carries the camera, from where it really starts; late: of the actuator, in periods."""
    robot, start = scenario.robot, scenario.reference.oTc0 @ exp(scenario.start.offset)
    gantry = joints = None
    if robot.joints is not None:
        joints = np.array(robot.joints)
        gantry = Gantry.seeing(start, joints)
    return Carrier(
        start,
        scenario.vision.period,
        frames,
        delay=robot.dead_time + late * scenario.vision.period,
        hand_eye=_maybe(scenario.calibration.hand_eye),
        capability=Capability(
            speed=robot.speed_limit,
            rate=robot.rate_limit,
            acceleration=robot.acceleration_limit,
            angular_acceleration=robot.angular_acceleration_limit,
            time_constant=robot.time_constant,
            gantry=gantry,
            joints0=joints,
            avoidance=robot.avoidance,
        ),
    )


def _maybe(twist: tuple[float, ...]) -> Array | None:
    """The motion of a small twist, or None where it is none."""
    return exp(np.array(twist)) if any(twist) else None
