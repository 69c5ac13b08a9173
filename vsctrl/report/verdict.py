"""The first lines about a scenario: does it work, how far off, how fast, what limits it, advice.

All of it is of the loop that was given and of its run as configured; where the two disagree that is
the first sentence.
"""

from __future__ import annotations

import math

from vsctrl.report.section import Colour as Kind
from vsctrl.report.section import Verdict
from vsctrl.report.sentences import agreement, tracking
from vsctrl.report.wording import digits, length, listed, per_second, seconds
from vsctrl.study.examination.examination import Examination

CLOSE = 0.02  #: of the way that a lag is, by which run and theory agree, and …
NOTHING = 1e-5  #: … m, a difference that is none
SHORT = 3.0  #: time constants, of which a run must be longer to settle
SHOWN = 10.0  #: what a growing mode must grow by within a run to be seen


def verdict(x: Examination) -> Verdict:
    """Read an examination: the words, and the colour that they have."""
    kind, first = _works(x)
    if kind == "good" and x.figure_1 is not None and x.figure_1.comparison.agrees is False:
        kind = "warning"
    rest = [] if x.loop is None else [*_far(x), *_fast(x), *_limits(x), *_advice(x)]
    rest += [f"Is this meant? {doubt}" for doubt in x.scenario.doubts]
    return Verdict(kind, tuple(sentence for sentence in (first, *rest) if sentence))


# Does it work ------------------------------------------------------------------------------------
def _works(x: Examination) -> tuple[Kind, str]:
    if x.loop is None:
        return "bad", f"This cannot work: {_said(x)}"
    return _stable_loop(x) if x.loop.is_stable else _unstable_loop(x)


def _said(x: Examination) -> str:
    """Why a run did not do what it was to do, as its status has it."""
    return x.run.status.sentence[:1].lower() + x.run.status.sentence[1:]


def _unstable_loop(x: Examination) -> tuple[Kind, str]:
    assert x.loop is not None
    start = f"This loop is unstable: {_over(x)}"
    status, last = x.run.status, x.last
    if not status.complete:
        when = f"the run ends at t = {x.run.t[-1]:g} s"
        why = "carried away" if status.kind == "diverged" else status.kind
        return "bad", f"{start}; {when}, {why}."
    if last.kind in ("growing", "swinging") or not status.ok:
        swing = f"in its last quarter the camera swings by ±{length(last.half_range)}"
        held = _held(x)
        bounded = f"; {held}, which is all that bounds it" if held else ""
        grows = ", growing" if last.kind == "growing" and not held else ""
        return "bad", f"{start}; the run shows it: {swing}{grows}{bounded}."
    if x.loop.growth ** len(x.run.t) < SHOWN:
        return "bad", f"{start}. The run is too short to show it."
    return "bad", (
        f"{start}. The run does not show it, as nothing sets off the direction that grows."
    )


def _over(x: Examination) -> str:
    """Why it is unstable: the gain over its limit, and what sets that limit."""
    assert x.loop is not None
    lam, limit, period = x.loop.elements.lam, x.loop.gain_limit, x.loop.elements.period
    late = _late(x)
    if limit == 0:
        return f"no gain λ is stable{f' with {late}' if late else ''}{_critical(x)}"
    held = f"the twist held over {1e3 * period:g} ms"
    if lam > limit:
        causes = f"{late} and {held}" if late else held
        most = f"the most that {causes} allow{_critical(x)}"
        return f"λ = {lam:g} s⁻¹ is above {per_second(limit)}, {most}"
    return f"λ = {lam:g} s⁻¹ lies in a range of gains that is not stable{_critical(x)}"


def _stable_loop(x: Examination) -> tuple[Kind, str]:
    assert x.loop is not None
    status, last = x.run.status, x.last
    if not status.complete:
        return "bad", f"Theory and run disagree: the linear loop is stable, but {_said(x)}"
    if not status.ok:
        return "bad", f"The linear loop is stable, but the run does not arrive: {_said(x)}"
    disagrees = _disagrees(x)
    if last.kind in ("growing", "swinging", "receding") and disagrees:
        what = {
            "growing": f"the camera swings by ±{length(last.half_range)}, growing",
            "swinging": f"the camera swings by ±{length(last.half_range)}",
            "receding": f"the camera falls away from its reference, to {length(last.distance)}",
        }[last.kind]
        return "warning", (
            "Theory and run disagree: the linear loop is stable, but in the last quarter of the "
            f"run {what}{f'; {held}' if (held := _held(x)) else ''}. {_left_out(x)}"
        )
    constant = 0.0 if x.advice is None else x.advice.constant or 0.0
    moves = last.half_range > max(CLOSE * abs(last.mean), NOTHING)
    if constant * SHORT > x.run.t[-1] and moves:
        return "warning", (
            f"The loop is stable, but {x.run.t[-1]:g} s are too short for it to settle: its "
            f"slowest errors take {seconds(constant)} to fall to 1/e."
        )
    held = _held(x)
    text = "This loop is stable, and the run settles"
    if last.kind not in ("at its reference", "steady"):
        text = "This loop is stable, and the run follows its reference"
    if x.scenario.motion.kind == "hold":
        arrives = "arrives" if x.positioning else "stays at its reference, as nothing disturbs it"
        text = f"This loop is stable, and the run {arrives}"
    if held:
        text += f"; {held} on the way"
    if disagrees and not x.figure_1:
        return "warning", f"{text}, but not where the linear loop says. {_left_out(x)}".rstrip()
    return "good", f"{text}."


def _disagrees(x: Examination) -> bool:
    """Whether the run leaves the linear loop in its last quarter by more than second order."""
    if x.difference is None:
        return False
    way = abs(x.last.mean) + x.last.half_range
    allowed = x.last.half_range if x.noisy else CLOSE * way
    return x.difference > max(NOTHING, allowed)


def _held(x: Examination) -> str:
    """That the robot's limits acted, and how often."""
    if not x.held_frames:
        return ""
    return f"the robot's limits hold it in {x.held_frames} of {len(x.run.t)} frames"


def _left_out(x: Examination) -> str:
    assert x.loop is not None
    names = list(x.loop.left_out)
    if names:
        return f"Theory leaves out {listed(names)}."
    return "The motion or the start is so large that the linear loop is only its first order."


# How far off -------------------------------------------------------------------------------------
def _far(x: Examination) -> list[str]:
    assert x.loop is not None
    if x.figure_1 is not None and x.loop.is_stable:
        return [*tracking(x.figure_1), *agreement(x.figure_1.comparison)]
    if not x.run.status.complete or not x.loop.is_stable:
        return []
    if x.scenario.motion.kind == "hold":
        return [_arrived(x)] if x.positioning is not None else []
    last = x.last
    where = _where(x)
    if last.kind == "steady" and last.along_motion and x.loop.steady_lag is not None:
        return [f"{where}{_agrees(x)}"]
    return [f"{where}{_agrees(x)}"] if where else []


def _where(x: Examination) -> str:
    """Where the camera is in the last quarter, never by its last frame alone."""
    last = x.last
    if last.kind == "at its reference":
        return "The camera is on its reference, to less than 10 µm."
    if not last.along_motion:
        return f"In the last quarter of the run it is within {length(last.distance)} of its goal."
    side = "behind" if last.mean < 0 else "ahead of"
    swing = last.half_range
    if swing > max(abs(last.mean), NOTHING):
        return (
            f"In the last quarter of the run its lag along the motion swings by ±{length(swing)}"
            f" about {length(abs(last.mean))} {'behind' if last.mean < 0 else 'ahead'}."
        )
    if swing > max(0.02 * abs(last.mean), NOTHING):
        return f"The camera is {length(abs(last.mean))} ± {length(swing)} {side} its reference."
    return f"The camera follows {length(abs(last.mean))} {side} its reference."


def _agrees(x: Examination) -> str:
    """What the linear loop has to say of it."""
    if x.difference is None:
        return ""
    if _disagrees(x):
        return f" The linear loop is {length(x.difference)} away from that."
    if x.noisy:
        mean = length(x.difference)
        return f" What is random moves it; its mean is that of the linear loop to {mean}."
    return f" The linear loop says the same, frame by frame, to {length(x.difference)}."


def _arrived(x: Examination) -> str:
    p = x.positioning
    assert p is not None
    start = f"It starts {length(p.distance)} and {digits(math.degrees(p.angle), 3)}° away"
    found = p.simulated
    if found.to_image is None or found.to_space is None:
        return f"{start} and ends within {length(x.last.distance)} of its goal."
    text = (
        f"{start}, is within 1 px of its image after {found.to_image:.3g} s and within 1 mm after "
        f"{found.to_space:.3g} s"
    )
    if p.predicted and p.predicted.to_image is not None and p.predicted.to_space is not None:
        text += f" (the linear loop: {p.predicted.to_image:.3g} s and {p.predicted.to_space:.3g} s)"
    over = f", overshooting by {found.overshoot:.0%}" if found.overshoot > 0.01 else ""
    return f"{text}{over}; its greatest speed is {1e3 * found.peak_speed:.3g} mm/s."


# How fast ----------------------------------------------------------------------------------------
def _fast(x: Examination) -> list[str]:
    if x.advice is None or x.advice.constant is None or x.loop is None:
        return []
    constant = x.advice.constant
    if constant < x.loop.elements.period:
        return ["Errors die out within a few frames."]
    return [
        f"Errors fall to 1/e in {seconds(constant)}, to a hundredth in {seconds(4.6 * constant)}."
    ]


# What limits it ----------------------------------------------------------------------------------
def _limits(x: Examination) -> list[str]:
    assert x.loop is not None
    if not x.loop.is_stable:
        return []
    lam, limit = x.loop.elements.lam, x.loop.gain_limit
    if not math.isfinite(limit):
        return ["No gain makes it shake."]
    factor = limit / lam
    times = f"{factor:.2g}" if factor < 100 else f"{factor:.0f}"
    late = _late(x)
    held = f"the twist held over {1e3 * x.loop.elements.period:g} ms"
    text = (
        f"λ = {lam:g} s⁻¹ may be raised {times}-fold, to {per_second(limit)}, before it shakes: "
        f"{f'{late} and ' if late else ''}{held} set that limit"
    )
    promised = _continuous_limit(x)
    if promised is not None and promised > 1.01 * limit:
        text += (
            f"; continuous-time theory, {per_second(promised)}, promises "
            f"{promised / limit - 1:.0%} too much"
        )
    return [text + _critical(x) + "."]


def _continuous_limit(x: Examination) -> float | None:
    """The gain limit in continuous time, None where there is none or that loop is unstable."""
    assert x.loop is not None
    if x.loop.critical.kappa.imag:
        return None
    margins = x.loop.open().margins()
    if not margins.stable or not math.isfinite(margins.gain):
        return None
    return float(margins.gain) * x.loop.elements.lam


def _late(x: Examination) -> str:
    """All that is late or slow in the loop."""
    assert x.loop is not None
    e = x.loop.elements
    parts = [f"{1e3 * e.tau:g} ms of latency"] if e.tau else []
    parts += [f"{1e3 * e.dead_time:g} ms of dead time in the robot"] if e.dead_time else []
    parts += [f"axes with {1e3 * e.time_constant:g} ms"] if e.time_constant else []
    parts += [f"the integral with T_i = {e.T_i:g} s"] if e.T_i is not None else []
    return ", ".join(parts)


def _critical(x: Examination) -> str:
    """Which direction that is of, where they differ."""
    assert x.loop is not None
    if len(x.loop.directions) < 2:
        return ""
    first = x.loop.critical
    kappa = f"{first.kappa.real:.3g}" if not first.kappa.imag else f"{first.kappa:.3g}"
    name = "" if first.name.startswith("κ") else f"{first.name}, "
    return f" (in the direction that shakes first: {name}κ = {kappa})"


# What to do --------------------------------------------------------------------------------------
def _advice(x: Examination) -> list[str]:
    assert x.loop is not None
    advice = x.advice
    if advice is None:
        return []
    if not x.loop.is_stable:
        if advice.fastest is None:
            return ["A lower gain does not help: shorten what is late, or remove the integral."]
        return [
            f"Lower λ: at {per_second(advice.fastest)} errors die out fastest, to 1/e in "
            f"{seconds(advice.fastest_constant or 0.0)}."
        ]
    if x.figure_1 is None and advice.k_ff is not None and x.last.kind == "steady":
        return [f"k_ff = {advice.k_ff:.3g} would leave no lag along this motion."]
    return []
