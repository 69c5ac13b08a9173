"""The cause of a run's failure and what helps, as the end of a sentence.

Causes are looked for in the order of their depth: points that cannot tell all motions apart, a law
that pulls the wrong way whatever its gain, a loop that shakes at this gain; then, where the loop by
itself is sound, what was asked of it: limits, start, calibration, motion.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from vsctrl.servo.diagnosis.linearised import NOTHING, pull
from vsctrl.servo.diagnosis.rank import on_a_line, rank
from vsctrl.servo.diagnosis.trials import CALIBRATED, CLEAR, PLANNED, UNLIMITED, Trials
from vsctrl.servo.scenario import Scenario
from vsctrl.servo.scenario.description import TABLE_OF

# How often a gain is halved in search of one that is not too high.
_HALVINGS = 6


class Cause(NamedTuple):
    """Why, and what helps, as the end of a sentence; change: the fields that help, as tried."""

    why: str
    change: dict[str, Any]


def of_the_loop(trials: Trials) -> Cause | None:
    """Why the loop cannot hold the camera even at its reference; None where it can."""
    if why := no_rank(trials.scenario):
        return Cause(why, {})
    if not trials.shakes():
        return None
    return _wrong_way(trials) or _too_high(trials)


def no_rank(scenario: Scenario) -> str:
    """That the points leave the law without six motions; empty where they do not."""
    left = rank(scenario)
    if left == 6:
        return ""
    if on_a_line(scenario):
        return (
            f"the points of the target lie on one line, which leaves L with rank {left} of 6, and "
            "no gain helps: add a point beside the line to target.points"
        )
    other = "" if scenario.law.features == "points" else " or other law.features"
    return (
        f"these points leave L with rank {left} of 6, and no gain helps: give other "
        f"target.points{other}"
    )


def _wrong_way(trials: Trials) -> Cause | None:
    """A calibration with which the law pulls away from the reference at every gain."""
    scenario = trials.scenario
    blamed = _differing(scenario, CALIBRATED)
    if not blamed or not _pushes(scenario):
        return None
    single = [name for name in blamed if not trials.shakes(**{name: CALIBRATED[name]})]
    names = single or blamed
    change = {name: CALIBRATED[name] for name in names}
    if not single and trials.shakes(**change):
        return None
    return Cause(
        f"with {_dotted(names, 'or' if single else 'and')} so far from the truth the law drives "
        "the camera away from its reference, and no gain helps: correct the calibration",
        change,
    )


def _pushes(scenario: Scenario) -> bool:
    """Whether the law pulls away from the reference in some direction."""
    matrix = pull(scenario)
    if matrix is None:
        return False
    mu = np.linalg.eigvals(matrix)
    return bool(mu.real.min() < -NOTHING * np.abs(mu).max())


def _too_high(trials: Trials) -> Cause:
    """A gain that is too high for what is late, with all of it that would help by itself."""
    scenario = trials.scenario
    late = {
        "latency": scenario.vision.latency, "dead_time": scenario.robot.dead_time,
        "time_constant": scenario.robot.time_constant,
    }  # fmt: skip
    single = [name for name, value in late.items() if value and not trials.shakes(**{name: 0.0})]
    for halvings in range(1, _HALVINGS + 1):
        slower = _slower(scenario, 2.0**-halvings)
        if not trials.shakes(**slower):
            helps = _dotted(["lam", *single], "or")
            return Cause(f"the loop is unstable. Lower {helps}", slower)
    if single:
        return Cause(f"the loop is unstable. Lower {_dotted(single, 'or')}", {single[0]: 0.0})
    return Cause("the loop is unstable, and at lower gains, too: begin with an ideal one", {})


def of_the_task(trials: Trials, *, limited: bool) -> str:
    """What was asked too much of a loop that is sound by itself; empty where no trial told."""
    scenario = trials.scenario
    if limited and trials.arrives(**UNLIMITED):
        return "they are too low: raise the limits of [robot]"
    blurred = _differing(scenario, CLEAR)
    if blurred and trials.arrives(**CLEAR):
        return f"the images are too bad for it: lower {_dotted(blurred, 'and')}"
    if scenario.reference_image.model_dump() != PLANNED and trials.arrives(**PLANNED):
        names = _dotted(_differing(scenario, PLANNED), "and")
        return f"s*(t) is not the image of the reference with {names} as they are: correct them"
    if any(scenario.start.offset) and trials.arrives(offset=(0.0,) * 6):
        return _too_far(trials)
    blamed = _differing(scenario, CALIBRATED)
    if blamed and trials.arrives(**CALIBRATED):
        names = _dotted(blamed, "and")
        return f"near its reference the loop is stable, but not along this way: correct {names}"
    for changes, words in _other_laws(scenario):
        if trials.arrives(**changes):
            return f"near its reference the loop is stable, but not along this way: use {words}"
    return ""


def _too_far(trials: Trials) -> str:
    """What brings the camera to its reference from this start, or from which part of it."""
    scenario = trials.scenario
    helps = []
    if trials.arrives(**_slower(scenario, 0.25)):
        helps.append("lower law.lam")
    for changes, words in _other_laws(scenario):
        if len(helps) < 2 and trials.arrives(**changes):
            helps.append(f"use {words}")
    offset = np.array(scenario.start.offset)
    for share, words in ((0.5, "half"), (0.25, "a quarter of"), (0.1, "a tenth of")):
        if trials.arrives(offset=tuple(share * offset)):
            helps.append(f"start nearer ({words} this start.offset will do)")
            break
    return (
        "near its reference the loop is stable, and it is the start that is too far from it for "
        f"this law: {' or '.join(helps or ['start nearer'])}"
    )


def too_fast(scenario: Scenario) -> str:
    """That a loop that is stable cannot keep up with what moves; empty where nothing does."""
    moves = scenario.reference.twist(scenario.t).any()
    if not moves and not any(scenario.target.drift):
        return ""
    forward = " or law.k_ff" if moves and scenario.law.k_ff < 1 else ""
    return (
        "the loop is stable by itself, and what it follows is too fast for the law. Slow that "
        f"down, else raise law.lam{forward}"
    )


# What the pose scheme has no use for is left out with it.
_POSE: dict[str, Any] = {
    "scheme": "pose", "features": "points", "interaction": "current", "depth": "true",
    "depth_ratio": 1.0, "depth_ratios": None, "predictor": "none", "tau_hat": None,
}  # fmt: skip


def _other_laws(scenario: Scenario) -> Iterator[tuple[dict[str, Any], str]]:
    """Laws that may arrive where this one does not, and their words."""
    law = scenario.law
    if law.scheme == "pose":
        yield {"scheme": "image"}, 'law.scheme = "image"'
        return
    if law.features != "points":
        yield {"features": "points"}, 'law.features = "points"'
    for choice in ("current", "desired", "mean"):
        if law.interaction != choice:
            yield {"interaction": choice}, f'law.interaction = "{choice}"'
    yield _POSE, 'law.scheme = "pose"'


def _slower(scenario: Scenario, share: float) -> dict[str, float]:
    """A share of the gain, of all of it where it is adaptive."""
    law = scenario.law
    zero = {} if law.lam_zero is None else {"lam_zero": share * law.lam_zero}
    return {"lam": share * law.lam} | zero


def _differing(scenario: Scenario, usual: dict[str, Any]) -> list[str]:
    """Which of these keys the scenario has otherwise."""
    return [
        name for name, value in usual.items()
        if getattr(getattr(scenario, TABLE_OF[name]), name) != value
    ]  # fmt: skip


def _dotted(names: list[str], word: str) -> str:
    """``calibration.hand_eye, law.lam or vision.latency``."""
    full = [f"{TABLE_OF[name]}.{name}" for name in names]
    return f" {word} ".join([", ".join(full[:-1]), full[-1]] if len(full) > 1 else full)
