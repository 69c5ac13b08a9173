"""Whether a run that was computed to its end came to its reference, as far as it had the time."""

import numpy as np

from vsctrl.arrays import Array
from vsctrl.servo.diagnosis.linearised import pull
from vsctrl.servo.diagnosis.trials import ARRIVED, Trials, lag_sizes
from vsctrl.servo.pose import inverse
from vsctrl.servo.results.frames import Frames
from vsctrl.servo.results.status import POLICY

# The last part of a run is a quarter of it; between its halves a lag that is the same differs by
# less than the one share, and a mean distance that is on its way to nothing by more than the other.
LAST, SAME, NEARER = 4, 0.02, 0.1
# A run of fewer time constants 1/λ was too short to come to its reference.
CONSTANTS = 5.0
# Time constants of the loop in that part: one that only is slow would come nearer by a third.
ENOUGH = 0.4
# What sways about the reference has a mean lag below this share of its mean distance, and what
# follows has this share of its lag from a perfect start, too.
OWN = 0.5
# What goes away again by this share of its distance wanders.
ASTRAY = 0.1


def far(run: Frames) -> bool:
    """Whether the last part of a run was spent away from its reference, and hardly nearer."""
    size, half = lag_sizes(run), len(run.t) // LAST // 2
    if not half or run.scenario.law.lam * run.t[-1] < CONSTANTS:
        return False
    if not size[-2 * half :].mean() > ARRIVED:
        return False
    return bool(size[-half:].mean() > (1 - NEARER) * size[-2 * half : -half].mean())


def strays(run: Frames) -> bool:
    """Whether a run that never told all motions apart is away at last, on its way to nowhere."""
    blind = any(e.kind == "rank loss" and e.frames == len(run.t) for e in run.events)
    last = max(1, len(run.t) // LAST)
    return blind and bool(lag_sizes(run)[-last:].mean() > ARRIVED)


def rests(run: Frames) -> bool:
    """Whether a run that is far keeps one lag in its last part."""
    first, second = _mean_lags(run)
    return bool(np.linalg.norm(second - first) < SAME * np.linalg.norm(second))


def beside(run: Frames, held: bool, trials: Trials) -> bool:
    """Whether a run that is far, of a loop that is stable, should not be there.

    held: the robot's limits kept the camera from its command at the last frame, so that it may
    still be on its way.
    """
    size, last, scenario = lag_sizes(run), len(run.t) // LAST, run.scenario
    mean = float(np.linalg.norm(np.mean(_mean_lags(run), axis=0)))
    if not mean > max(ARRIVED, OWN * size[-last:].mean()):
        return False
    if held and run.twist[-last:-1].any():
        return False
    if not (_blind(run) or _wanders(run) or _long_enough(run, last)):
        return False
    moves = any(scenario.target.drift) or scenario.reference.twist(run.t[-last:]).any()
    if not moves:
        return True
    if not any(scenario.start.offset):
        return False
    own = trials.lag_from_a_perfect_start()
    return own is not None and own < OWN * mean


def _mean_lags(run: Frames) -> tuple[Array, Array]:
    """Mean lag of both halves of the last part, (12,) each, lengths as shares of the depth.

    ``(R − I)/√2`` stands for the angle, 2 sin(θ/2) of it: where the camera is upside down the
    rotation vector jumps from πu to −πu, and its mean is nothing.
    """
    half, depth = len(run.t) // LAST // 2, float(run.depths[0].mean())
    moved = inverse(run.reference_pose[-2 * half :]) @ run.pose[-2 * half :]
    turned = (moved[:, :3, :3] - np.eye(3)).reshape(-1, 9) / np.sqrt(2)
    lag = np.concatenate([moved[:, :3, 3] / depth, turned], axis=1)
    return lag[:half].mean(axis=0), lag[half:].mean(axis=0)


def _blind(run: Frames) -> bool:
    """Whether the law was without an image that leads home for most of the run."""
    return any(2 * e.frames > len(run.t) for e in run.events if e.kind in POLICY)


def _wanders(run: Frames) -> bool:
    """Whether the distance goes up and down in the last part, as that of no slow approach does."""
    last = lag_sizes(run)[-(len(run.t) // LAST) :]
    return bool(np.diff(last).clip(min=0.0).sum() > ASTRAY * last.mean())


def _long_enough(run: Frames, last: int) -> bool:
    """Whether a loop that works would have come visibly nearer in the last part of the run."""
    scenario = run.scenario
    law, vision, robot = scenario.law, scenario.vision, scenario.robot
    if law.smooth is not None and law.smooth * run.t[-1] < 5:
        return False
    if vision.latency + robot.dead_time + robot.time_constant > run.t[-last]:
        return False
    matrix = pull(scenario)
    weakest = 1.0 if matrix is None else float(np.linalg.eigvals(matrix).real.min())
    # Where nothing or the wrong way is pulled, no patience helps.
    slowest = law.lam * weakest if weakest > 0 else law.lam
    return bool(slowest * (run.t[-1] - run.t[-last]) > ENOUGH)
