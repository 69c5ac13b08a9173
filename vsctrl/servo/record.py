"""The arrays that a run fills frame by frame, and the Run that is made of them."""

from dataclasses import fields

import numpy as np

from vsctrl.servo.control.controller import Controller
from vsctrl.servo.control.depths import EstimatedDepths
from vsctrl.servo.control.reference_image import Plan
from vsctrl.servo.faults import Faults
from vsctrl.servo.pose import inverse, log
from vsctrl.servo.results.run import Run
from vsctrl.servo.results.status import SEEN, Status
from vsctrl.servo.robot.carrier import Carrier
from vsctrl.servo.scenario import Scenario


class Record:
    """What is known of n frames with p points and m features; each frame writes its row."""

    def __init__(self, n: int, p: int, m: int) -> None:
        self.pose = np.empty((n, 4, 4))
        self.features = np.empty((n, 2 * p))
        self.depths = np.empty((n, p))
        self.visible = np.ones((n, p), dtype=bool)
        self.measured_error = np.empty((n, m))
        self.command = np.empty((n, 6))

    def run(
        self,
        scenario: Scenario,
        plan: Plan,
        carrier: Carrier,
        controller: Controller,
        status: Status,
        faults: Faults,
    ) -> Run:
        """The frames that were reached, as a Run of read-only arrays."""
        # Frames that fail before they have an image are left out.
        n = status.frame + (status.complete or status.kind in SEEN)
        twist = np.zeros((n, 6))
        moved = carrier.twists[:n]
        twist[: len(moved)] = moved
        pose, reference_pose = self.pose[:n], plan.pose[:n]
        joints, depths = carrier.joints, getattr(controller, "depths", None)
        estimated = depths if isinstance(depths, EstimatedDepths) else None
        run = Run(
            scenario=scenario,
            t=scenario.t[:n],
            pose=pose,
            reference_pose=reference_pose,
            features=self.features[:n],
            reference=plan.image[:n],
            error=self.features[:n] - plan.image[:n],
            measured_error=self.measured_error[:n],
            command=self.command[:n],
            twist=twist,
            lag=log(inverse(reference_pose) @ pose),
            depths=self.depths[:n],
            visible=self.visible[:n],
            status=status,
            events=faults.events(),
            joints=None if joints is None else joints[:n],
            depth_estimate=None if estimated is None else estimated.estimates[:n],
            excitation=None if estimated is None else estimated.excitation[:n],
        )
        for field in fields(run):
            value = getattr(run, field.name)
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
        return run
