"""The closed loop in six degrees of freedom: a fold over video frames that returns its states.

One frame is: see the target, give the law an image of the right age, ask it for a twist, move.
Everything about the reference is known beforehand (``control.reference_image``); what nature does
is in ``camera`` and ``robot``, what the computer does in ``control``, which quantity is delayed by
how much in ``timing``, and ``scenario.assembly`` makes all parts. What a run means (predictions,
comparisons, plots) is left to the rooms above.
"""

from collections import deque
from contextlib import suppress
from dataclasses import replace

import numpy as np

from vsctrl.arrays import Array
from vsctrl.keywords import keywords
from vsctrl.servo import faults
from vsctrl.servo.camera.camera import NEAREST
from vsctrl.servo.camera.sensor import TrueImage
from vsctrl.servo.control.controller import PoseController
from vsctrl.servo.control.measurement import Measurement
from vsctrl.servo.diagnosis import causes
from vsctrl.servo.diagnosis.rank import rank
from vsctrl.servo.diagnosis.trials import TooManyError, Trials
from vsctrl.servo.diagnosis.verdict import explained
from vsctrl.servo.faults import Faults, Told
from vsctrl.servo.pose import adjoint, inverse
from vsctrl.servo.record import Record
from vsctrl.servo.results.run import Run
from vsctrl.servo.results.status import Kind, Status
from vsctrl.servo.scenario import GivenScenario, Scenario, as_scenario, assembly
from vsctrl.servo.scenario.checks import FEWEST_POINTS

# The run counts as diverged once the camera is farther from its reference than this many times the
# scene (the greatest reference depth, or the distance at the start if that is more): no image would
# show the target any more, and numbers stay far from overflow.
DIVERGED = 100.0


@keywords
def simulate(scenario: GivenScenario) -> Run:
    """Run an experiment frame by frame; a failure in the loop is a status, not an exception.

    Frame k at ``t_k = k Tₛ``; the twist of frame k is held over [t_k, t_k+1] and the pose follows
    as ``oTc · exp(T Tₛ)``, where robot and latency leave it so. Returns a Run with the frames 0..N,
    or fewer after a failure, whose status says why and what helps (``diagnosis``).
    Raises InputError for what is no Scenario.

    >>> vs.simulate(vs.paper.sliding()).status.ok
    True
    """
    scenario = as_scenario(scenario)
    return simulated(scenario, explain=True)


def simulated(scenario: Scenario, *, explain: bool = False) -> Run:
    """The run as ``simulate`` has it; explain: look for causes, with runs of other scenarios.

    Without them it is for those who run a loop that may be unstable many times.
    """
    loop = _Loop(scenario)
    # Numbers that overflow are caught by the checks of every frame, in sentences.
    with np.errstate(all="ignore"):
        status = loop.run()
        run = loop.record.run(
            scenario, loop.plan, loop.carrier, loop.controller, status, loop.faults
        )
    if not explain:
        return run
    found = explained(run, loop.faults.happened, loop.carrier.held, simulated)
    return run if found is run.status else replace(run, status=found)


def unstable(scenario: Scenario) -> str:
    """Why the loop of a scenario cannot hold its reference, as the end of a sentence; else empty.

    It is released near a reference at rest, so that it shows what a run from a perfect start hides.
    """
    trials = Trials(scenario, simulated)
    with np.errstate(all="ignore"), suppress(TooManyError):
        if cause := causes.of_the_loop(trials):
            return cause.why
    return ""


class _Loop:
    """Everything that takes part in the frames of one run."""

    def __init__(self, scenario: Scenario) -> None:
        t, ages = scenario.t, assembly.delays(scenario)
        self.t = t
        self.target = assembly.target(scenario)
        self.sensor = assembly.sensor(scenario)
        self.plan = assembly.plan(scenario, self.sensor, t, ages)
        self.schedule = assembly.schedule(scenario, t, ages.measured)
        self.controller = assembly.controller(scenario, self.plan, t)
        self.carrier = assembly.carrier(scenario, len(t), ages)
        self.hand_eye = assembly.hand_eye(scenario)
        self.faults = Faults(scenario.faults.model_dump())
        self.record = Record(len(t), len(self.target.points), self.controller.width)
        self.rank = rank(scenario)
        self.no_rank = causes.no_rank(scenario) if self.rank < 6 else ""
        self.images: deque[TrueImage] = deque()  # those that the law may still be shown
        self.first = 0  # frame of the first of them
        self.wTo = None if self.target.still else self.target.pose(t)

    def run(self) -> Status:
        """Fill the record frame by frame, until the end or the fault that ends the run."""
        record, plan, carrier = self.record, self.plan, self.carrier
        t = self.t
        offset = carrier.pose[:3, 3] - plan.pose[0, :3, 3]
        farthest = DIVERGED * max(float(plan.compared.depths.max()), float(np.linalg.norm(offset)))
        before, applied, saturated = plan.image[0], np.zeros(6), False
        measurement: Measurement | None = None
        for k in range(len(t)):
            oTc = carrier.pose if self.wTo is None else inverse(self.wTo[k]) @ carrier.pose
            lag = oTc[:3, 3] - plan.pose[k, :3, 3]
            if not float(lag @ lag) ** 0.5 < farthest:  # written so that NaN fails too
                return self._diverged(k, farthest)
            image = self.sensor.look(oTc, before)
            if not image.depths.min() > NEAREST:
                sentence = faults.behind(k, t[k], image.depths)
                if ended := self.faults.met("target behind camera", k, sentence):
                    return ended
            before = image.features
            self.images.append(image)
            record.pose[k], record.features[k], record.depths[k] = oTc, before, image.depths
            if image.visible is not None:
                record.visible[k] = image.visible

            measurement = self._measured(k, measurement)
            action = self.controller.control(measurement, applied, saturated)
            record.measured_error[k], record.command[k] = action.e, action.T
            carrier.move(action.T)
            if ended := self._judged(k, measurement, action.rank):
                return ended
            applied, saturated = self._reported(carrier.applied), carrier.held
        return faults.completed(len(t))

    def _measured(self, k: int, before: Measurement | None) -> Measurement:
        """What the law is given at frame k, after the frame before."""
        schedule, carrier = self.schedule, self.carrier
        if before is not None and not schedule.fresh[k]:
            return before._replace(frame=k, fresh=False)
        m, taken = int(schedule.frame[k]), float(schedule.exposed[k])
        if m >= 0:
            self._forget(m)
            true = self.images[0]
        else:
            oTc = carrier.at(taken)
            if self.wTo is not None:
                oTc = inverse(self.target.pose(taken)) @ oTc
            self._forget(k)  # what is taken between frames, as all that follow are, is of now
            true = self.sensor.look(oTc, self.images[-1].features)
        image = schedule.corrupted(true.features, k)
        if true.visible is not None and before is not None:
            # What is not seen keeps the place where it was last, so that no number is without one.
            image = np.where(np.repeat(true.visible, 2), image, before.features)

        def odometry() -> Array:
            wTc = carrier.at(taken)
            return wTc if self.hand_eye is None else wTc @ self.hand_eye

        return Measurement(k, image, true.depths, true.visible, True, odometry)

    def _forget(self, frame: int) -> None:
        """Drop the images before a frame: after a newer one the law is shown no older one."""
        while self.first < frame:
            self.images.popleft()
            self.first += 1

    def _reported(self, T: Array) -> Array:
        """A twist (6,) of the camera as the hand reports it: of the camera that it assumes."""
        return T if self.hand_eye is None else adjoint(inverse(self.hand_eye)) @ T

    def _diverged(self, k: int, farthest: float) -> Status:
        """The end of a run whose camera is too far from its reference at frame k."""
        still = self.target.still and not self.plan.twist.any()
        saturated = self.faults.since("saturated")
        sentence = faults.diverged(k, float(self.t[k]), farthest, still, saturated)
        return self.faults.ended("diverged", k, sentence)

    def _unseen(self, k: int, t: float, rank: int) -> tuple[Kind, Told]:
        """That the law of frame k, with an L̂ of this rank, cannot tell all motions apart."""
        if isinstance(self.controller, PoseController):
            return "pose not found", faults.no_pose(k, t, self.no_rank)
        if rank == 6:
            return "rank loss", faults.blurred(k, t, self.rank, self.no_rank)
        return "rank loss", faults.rank_loss(k, t, rank, self.no_rank)

    def _judged(self, k: int, measurement: Measurement, rank: int) -> Status | None:
        """The faults of a frame that was asked and moved; the status if one ends the run."""
        t, stop = float(self.t[k]), self.carrier.stopped
        ended = None
        visible = measurement.visible
        seen = FEWEST_POINTS if visible is None else int(visible.sum())
        if seen < FEWEST_POINTS:
            kind, sentence = faults.lost(k, t, seen)
            ended = self.faults.met(kind, k, sentence)
        elif min(rank, self.rank) < 6:
            kind, sentence = self._unseen(k, t, rank)
            ended = self.faults.met(kind, k, sentence)
        if ended is not None:
            return ended
        if stop is not None and stop.joint is None:
            return self.faults.ended("diverged", k, faults.stopped(k, t, stop))
        if stop is not None:
            if ended := self.faults.met("joint limit", k, faults.stopped(k, t, stop)):
                return ended
            self.carrier.rest()
        elif self.carrier.held:
            self.faults.noted("saturated", k, faults.saturated(k, t))
        return None
