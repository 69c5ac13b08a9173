"""The closed loop in six degrees of freedom: a fold over video frames that returns its states.

One frame is: see the target, form the error that the law is shown, solve (10), move by the exact
exponential. Everything about the reference is known beforehand and computed for all frames at
once. When each quantity is sampled decides millimetres, so it stands in one place, ``_delays``.
What a run means (predictions, comparisons, plots) is left to the rooms above.
"""

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vsctrl.servo.control.law import Law
from vsctrl.servo.plant.camera import NEAREST, Camera, View
from vsctrl.servo.pose import exp, exp_one, inverse, log
from vsctrl.servo.run import Run, Status
from vsctrl.servo.scenario import Scenario
from vsctrl.servo.scenario.experiment import Placement

Array = NDArray[np.float64]

# The run counts as diverged once the camera is farther from its reference than this many times the
# scene (the greatest reference depth, or the distance at the start if that is more): no image would
# show the target any more, and numbers stay far from overflow.
DIVERGED = 100.0


def simulate(scenario: Scenario) -> Run:
    """Run an experiment frame by frame; a failure in the loop is a status, not an exception.

    Frame k at ``t_k = k Tₛ``; the twist of frame k is held over [t_k, t_k+1] and the pose follows
    as ``oTc · exp(T Tₛ)``. Returns a Run with the frames 0..N, or fewer after a failure.
    Raises InputError when the latency is no whole number of video periods.
    """
    d = scenario.latency_frames
    state = _State.of(scenario, d)
    # Numbers that overflow are caught by the checks of every frame, in sentences.
    with np.errstate(all="ignore"):
        status = _fold(state, _delays(scenario.law.placement, d))
        return _run(scenario, state, status)


class _Delays(NamedTuple):
    """Ages, in frames, of what meets at frame k."""

    measured: int
    reference: int
    command: int


def _delays(placement: Placement, d: int) -> _Delays:
    """Who is late by d frames: the image, image and reference alike, or the robot."""
    return {
        "measurement": _Delays(d, 0, 0),
        "aligned": _Delays(d, d, 0),
        "actuator": _Delays(0, 0, d),
    }[placement]


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    """What is known before the first frame, and arrays that the fold fills frame by frame."""

    camera: Camera
    law: Law
    points: Array
    period: float
    start: Array
    noise: Array | None
    t: Array
    reference_pose: Array
    reference: View
    rate: Array
    L_reference: Array
    pose: Array
    view: View
    measured: Array
    measured_error: Array
    command: Array
    twist: Array

    @classmethod
    def of(cls, scenario: Scenario, d: int) -> "_State":
        camera = Camera(scenario.camera.Fx, scenario.camera.Fy)
        table = scenario.law
        law = Law(table.lam, table.k_ff, table.interaction, table.depth_ratio)
        points, trajectory, t = np.array(scenario.target.points), scenario.reference, scenario.t
        reference_pose = trajectory.pose(t)
        reference = camera.view(reference_pose, points)
        L = camera.interaction(*reference)
        n, k = reference.features.shape
        noise = None
        if scenario.vision.noise_px:
            draw = np.random.default_rng(scenario.vision.seed).standard_normal((n, k))
            noise = scenario.vision.noise_px * draw
        return cls(
            camera=camera,
            law=law,
            points=points,
            period=scenario.vision.period,
            start=trajectory.oTc0 @ exp(scenario.start.offset),
            noise=noise,
            t=t,
            reference_pose=reference_pose,
            reference=reference,
            rate=np.squeeze(L @ trajectory.twist(t)[..., None], -1),  # ds*/dt = L(s*, Z*) T*
            L_reference=L if law.depth_ratio == 1 else law.modelled(camera, reference),
            pose=np.empty((n, 4, 4)),
            view=View(np.empty((n, k)), np.empty((n, k // 2))),
            measured=np.empty((n, k)),
            measured_error=np.empty((n, k)),
            command=np.empty((n, 6)),
            twist=np.zeros((n, 6)),
        )


def _fold(state: _State, delays: _Delays) -> Status:
    """Fill the arrays of the state frame by frame, until the end or the first failure."""
    camera, law, period = state.camera, state.law, state.period
    features, depths = state.view
    oTc = state.start
    away = float(np.linalg.norm(oTc[:3, 3] - state.reference_pose[0, :3, 3]))
    farthest = DIVERGED * max(float(state.reference.depths.max()), away)
    for k in range(len(state.t)):
        lag = oTc[:3, 3] - state.reference_pose[k, :3, 3]
        distance = float(lag @ lag) ** 0.5
        if not distance < farthest:  # written so that NaN fails too
            return _diverged(k, state.t[k], farthest)
        p = camera.points(oTc, state.points)
        z = p[:, 2]
        if not z.min() > NEAREST:
            return _behind(k, state.t[k], z)
        state.pose[k], features[k], depths[k] = oTc, camera.features(p), z
        state.measured[k] = features[k] if state.noise is None else features[k] + state.noise[k]

        m, r = max(0, k - delays.measured), max(0, k - delays.reference)
        e = state.measured[m] - state.reference.features[r]
        state.measured_error[k] = e
        T, rank = law.twist(_modelled(state, m, r), e, state.rate[k])
        state.command[k] = T
        if k >= delays.command:
            state.twist[k] = state.command[k - delays.command]
        if rank < 6:
            return _rank_loss(k, state.t[k], rank)
        oTc = oTc @ exp_one((state.twist[k] * period).tolist())
    n = len(state.t)
    return Status(True, "completed", n - 1, f"The run completed all {n} frames.")


def _modelled(state: _State, m: int, r: int) -> Array:
    """The L̂ of the law when frame m is the measured one and r the reference in the error."""
    choice = state.law.interaction
    if choice == "desired":
        return state.L_reference[r]
    if choice == "initial":
        m = 0
    view = View(state.measured[m], state.view.depths[m])
    L_hat = state.law.modelled(state.camera, view)
    return (L_hat + state.L_reference[r]) / 2 if choice == "mean" else L_hat


def _run(scenario: Scenario, state: _State, status: Status) -> Run:
    """The frames that were reached, as a Run of read-only arrays."""
    # A frame whose rank was lost was still seen; the others failed before their image existed.
    n = status.frame + (status.kind in ("completed", "rank loss"))
    pose, reference_pose = state.pose[:n], state.reference_pose[:n]
    features, reference = state.view.features[:n], state.reference.features[:n]
    run = Run(
        scenario=scenario,
        t=state.t[:n],
        pose=pose,
        reference_pose=reference_pose,
        features=features,
        reference=reference,
        error=features - reference,
        measured_error=state.measured_error[:n],
        command=state.command[:n],
        twist=state.twist[:n],
        lag=log(inverse(reference_pose) @ pose),
        depths=state.view.depths[:n],
        visible=np.ones((n, state.view.depths.shape[1]), dtype=bool),
        status=status,
    )
    for field in fields(run):
        value = getattr(run, field.name)
        if isinstance(value, np.ndarray):
            value.setflags(write=False)
    return run


def _diverged(k: int, t: float, farthest: float) -> Status:
    return Status(
        False,
        "diverged",
        k,
        f"At frame {k} (t = {t:g} s) the camera was more than {farthest:.3g} m from its reference: "
        "the loop is unstable, and the run ends before this frame. Lower law.lam or "
        "vision.latency.",
    )


def _behind(k: int, t: float, z: Array) -> Status:
    i = int(np.argmin(z))
    return Status(
        False,
        "target behind camera",
        k,
        f"At frame {k} (t = {t:g} s) point {i + 1} would lie at depth {z[i]:.3g} m, behind the "
        "camera, and the run ends before this frame. Lower law.lam or start nearer to the "
        "reference.",
    )


def _rank_loss(k: int, t: float, rank: int) -> Status:
    return Status(
        False,
        "rank loss",
        k,
        f"At frame {k} (t = {t:g} s) the interaction matrix of the law had rank {rank} of 6, so "
        "that the image no longer tells all motions apart; the run ends with this frame and its "
        "twist of least norm. Use other points or another law.interaction.",
    )
