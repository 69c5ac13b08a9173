"""The status of a run, once its cause is known: what happened, why, and what helps."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np

from vsctrl.servo.diagnosis import causes
from vsctrl.servo.diagnosis.rest import beside, far, rests, strays
from vsctrl.servo.diagnosis.trials import TooManyError, Trials
from vsctrl.servo.results.frames import Frames
from vsctrl.servo.results.outcome import number
from vsctrl.servo.results.status import POLICY, Status
from vsctrl.servo.scenario import Scenario

# What is of no use to it: where the robot ends is a matter of the loop only if that shakes.
_OF_THE_ROBOT = "joint limit"


def explained(
    run: Frames, happened: str, held: bool, simulate: Callable[[Scenario], Frames]
) -> Status:
    """The status of a run with the cause of its failure, if one is found; else as it is.

    happened: what its status says without the remedy; held: the robot's limits held the camera
    back at the last frame; simulate: runs a scenario without asking for causes.
    """
    status, trials = run.status, Trials(run.scenario, simulate)
    with np.errstate(all="ignore"):
        if status.ok:
            return _ended(run, held, trials) if far(run) or strays(run) else status
        why = _why(run, trials)
    if not why:
        return status
    if not happened.endswith(":"):
        why = why[0].upper() + why[1:]
    return replace(status, sentence=f"{happened} {why}.")


def _why(run: Frames, trials: Trials) -> str:
    """The cause of a failure as the end of a sentence; empty where no trial told."""
    status = run.status
    try:
        if cause := causes.of_the_loop(trials):
            return cause.why
        if status.kind != _OF_THE_ROBOT:
            why = causes.of_the_task(trials, limited=_limited(run))
            if not why and status.kind == "diverged" and not _limited(run):
                why = causes.too_fast(run.scenario)
            return why
    except TooManyError:
        pass
    return ""


def _ended(run: Frames, held: bool, trials: Trials) -> Status:
    """The status of a run whose last part was far from its reference."""
    why = ""
    try:
        cause = causes.of_the_loop(trials)
        helps = cause and (not cause.change or trials.helps(run, **cause.change))
    except TooManyError:
        cause = helps = None
    if cause and helps:
        why = cause.why
    else:
        if not beside(run, held, trials):
            return run.status
        with suppress(TooManyError):
            why = _met(run) or causes.of_the_task(trials, limited=_limited(run))
    away = float(np.linalg.norm(run.pose[-1, :3, 3] - run.reference_pose[-1, :3, 3]))
    angle = float(np.linalg.norm(run.lag[-1, 3:]))
    where = f"{number(away)} m and {number(angle)} rad from its reference"
    how = f"came to rest {where}" if rests(run) else f"came no nearer at last, and ends {where}"
    why = why or "it is where the law sees nothing left to do: start nearer to the reference"
    return Status(
        False,
        "reference not reached",
        len(run.t) - 1,
        f"The run completed all {len(run.t)} frames, but the camera {how}. "
        f"{why[0].upper()}{why[1:]}.",
    )


def _limited(run: Frames) -> bool:
    return any(event.kind == "saturated" for event in run.events)


def _met(run: Frames) -> str:
    """The first fault that the run went on in spite of, as the end of a sentence."""
    for event in run.events:
        if event.kind in POLICY:
            return event.sentence.partition(" That was so")[0].rstrip(".")
    return ""
