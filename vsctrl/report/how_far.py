"""How far off the camera of a scenario is, how it arrives, and how fast its errors die out."""

from __future__ import annotations

import math

import numpy as np

from vsctrl.report.sentences import agreement, tracking
from vsctrl.report.wording import digits, length, seconds
from vsctrl.study import Comparison
from vsctrl.study.examination.examination import Examination
from vsctrl.study.examination.motion import SMALL

CLOSE = 0.02  #: of the way that a lag is, by which run and theory agree, and …
NOTHING = SMALL  #: … m, a difference that is none
BESIDE = 1.2  #: of the lag along the motion, above which the distance in all is told too
STRAIGHT = 1e-4  #: rad, below which a turn is none
OVERSHOT = 0.01  #: of the first distance


def how_far(x: Examination, settled: bool) -> list[str]:
    """Where the camera is, by its own run; `settled`: whether the run was long enough to settle."""
    assert x.loop is not None
    if x.figure_1 is not None and x.loop.is_stable and _compared(x.figure_1.comparison):
        own = [] if settled else [f"{where(x)}{_agrees(x)}"]
        return [*own, *tracking(x.figure_1, settled), *agreement(x.figure_1.comparison)]
    if not x.run.status.complete or not x.loop.is_stable:
        return []
    if x.positioning is not None:
        return [_arrives(x)]
    return [f"{where(x)}{_agrees(x)}"]


def _compared(comparison: Comparison) -> bool:
    return bool(comparison.rows or comparison.waves or comparison.histories)


def ways_differ(x: Examination) -> bool:
    """Whether the ways to the paper's loop differ in a case that they are compared in."""
    return x.figure_1 is not None and x.figure_1.comparison.agrees is False


def disagrees(x: Examination) -> bool:
    """Whether the run leaves the linear loop in its last quarter by more than second order."""
    if x.difference is None or (x.positioning is not None and x.arrives):
        return False
    way = abs(x.last.mean) + x.last.half_range
    allowed = x.last.half_range if x.noisy else CLOSE * way
    return x.difference > max(NOTHING, allowed)


def where(x: Examination) -> str:
    """Where the camera is in the last quarter, never by its last frame alone."""
    last = x.last
    if last.kind == "at its reference":
        return f"The camera is on its reference, to less than 10 µm.{_turned(x)}"
    if not last.along_motion:
        goal = "goal" if x.scenario.motion.kind == "hold" else "reference"
        text = f"In the last quarter of the run it is within {length(last.distance)} of its {goal}."
        return f"{text}{_turned(x)}"
    mean, swing = abs(last.mean), last.half_range
    side = "behind" if last.mean < 0 else "ahead"
    beside = ""
    if last.distance > BESIDE * (mean + swing) + NOTHING:
        beside = f" In all directions together it is up to {length(last.distance)} away."
    if swing > max(mean, NOTHING):
        return (
            "In the last quarter of the run its lag along the motion swings by "
            f"±{length(swing)} about {length(mean)} {side}.{beside}"
        )
    of_it = "behind its reference" if last.mean < 0 else "ahead of its reference"
    if swing > max(CLOSE * mean, NOTHING):
        return (
            f"In the last quarter of the run the camera is {length(mean)} ± {length(swing)} "
            f"{of_it}.{beside}"
        )
    return f"The camera follows {length(mean)} {of_it}.{beside}"


def _turned(x: Examination) -> str:
    """By how much its orientation is off, of a camera whose place says little."""
    angle = float(np.linalg.norm(x.run.lag[-x.last.frames :, 3:], axis=1).max())
    if angle < STRAIGHT:
        return ""
    return f" It is turned by up to {digits(1e3 * angle, 3)} mrad from it."


def _agrees(x: Examination) -> str:
    """What the linear loop has to say of it."""
    if x.difference is None:
        return ""
    if disagrees(x):
        return f" The linear loop is {length(x.difference)} away from that."
    if x.noisy:
        mean = length(x.difference)
        return f" What is random moves it; its mean is that of the linear loop to {mean}."
    return f" The linear loop says the same, frame by frame, to {length(x.difference)}."


def _arrives(x: Examination) -> str:
    p = x.positioning
    assert p is not None
    angle = math.degrees(p.angle) if p.angle >= STRAIGHT else 0.0
    start = f"It starts {length(p.distance)} and {digits(angle, 3)}° away"
    found = p.simulated
    if found.to_image is None or found.to_space is None:
        text = f"{start} and is within {length(x.last.distance)} of its goal in the last quarter"
    else:
        text = (
            f"{start}, is within 1 px of its image after {seconds(found.to_image)} and within 1 mm "
            f"after {seconds(found.to_space)}"
        )
        if p.predicted and p.predicted.to_image is not None and p.predicted.to_space is not None:
            theory = f"{seconds(p.predicted.to_image)} and {seconds(p.predicted.to_space)}"
            text += f" (the linear loop: {theory})"
        if found.overshoot > OVERSHOT:
            text += f", overshooting by {digits(100 * found.overshoot, 2)} %"
    return f"{text}; its greatest speed is {length(found.peak_speed)}/s."


def how_fast(x: Examination) -> list[str]:
    """In which time errors die out near the reference."""
    if x.advice is None or x.advice.constant is None or x.loop is None:
        return []
    constant = x.advice.constant
    if constant < x.loop.elements.period:
        return ["Errors die out within a few frames."]
    return [
        f"Errors fall to 1/e in {seconds(constant)}, to a hundredth in {seconds(4.6 * constant)}."
    ]
