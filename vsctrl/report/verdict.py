"""The first lines about a scenario: does it work, how far off, how fast, what limits it, advice.

All of it is of the loop that was given and of its run as configured; where the two disagree that is
the first sentence.
"""

from __future__ import annotations

import numpy as np

from vsctrl.report.gain_limits import advice, limits, little_margin, over
from vsctrl.report.how_far import CLOSE, NOTHING, disagrees, how_far, how_fast, ways_differ
from vsctrl.report.section import Colour as Kind
from vsctrl.report.section import Verdict
from vsctrl.report.wording import length, listed, seconds
from vsctrl.study.examination.examination import Examination

SHORT = 3.0  #: time constants, of which a run must be longer to settle
FAR = 4.0  #: half ranges, beyond which a distance says more than the swing about it
SHOWN = 10.0  #: what a growing mode must grow by within a run to be seen
THROWN = 0.05  #: of the depth of the points, above which noise moves a camera too much
UNMOVED = 0.5  #: of where a camera is, below which the steady lag of its loop is not the reason


def verdict(x: Examination) -> Verdict:
    """Read an examination: the words, and the colour that they have."""
    kind, first = _works(x)
    rest: list[str] = []
    change: list[str] = []
    if x.loop is not None:
        change = advice(x)
        rest = [*how_far(x, not _too_short(x)), *how_fast(x), *limits(x), *change]
    if kind == "good" and x.loop is not None and (little_margin(x) or ways_differ(x)):
        kind = "warning"
    asked = [f"Is this meant? {doubt}" for doubt in x.scenario.doubts]
    said = tuple(sentence for sentence in (first, *rest, *asked) if sentence)
    return Verdict(kind, said, (*change, *asked))


# Does it work ------------------------------------------------------------------------------------
def _works(x: Examination) -> tuple[Kind, str]:
    if x.loop is None and x.run.status.ok:
        return "warning", f"The run ends well, but its loop was not judged: {x.no_loop}"
    if x.loop is None:
        return "bad", f"This cannot work: {_said(x)}"
    return _stable_loop(x) if x.loop.is_stable else _unstable_loop(x)


def _said(x: Examination) -> str:
    """Why a run did not do what it was to do, as its status has it."""
    return x.run.status.sentence[:1].lower() + x.run.status.sentence[1:]


def _unstable_loop(x: Examination) -> tuple[Kind, str]:
    assert x.loop is not None
    start = f"This loop is unstable: {over(x)}"
    status, last = x.run.status, x.last
    if not status.complete:
        when = f"the run ends at t = {x.run.t[-1]:g} s"
        why = "carried away" if status.kind == "diverged" else status.kind
        return "bad", f"{start}; {when}, {why}."
    if last.kind in ("growing", "swinging", "receding") or not status.ok:
        swing = f"in its last quarter the camera swings by ±{length(last.half_range)}"
        if last.kind == "receding" or last.distance > FAR * last.half_range:
            swing = f"in its last quarter the camera is up to {length(last.distance)} away"
        held = _held(x)
        bounded = f"; {held}, which is all that bounds it" if held else ""
        grows = ", growing" if last.kind == "growing" and not held else ""
        return "bad", f"{start}; the run shows it: {swing}{grows}{bounded}."
    if x.scenario.law.lam_zero is not None and last.half_range > NOTHING:
        return "bad", (
            f"{start}; near its reference the camera swings by ±{length(last.half_range)}, as the "
            "gain falls with the error."
        )
    if x.loop.growth ** len(x.run.t) < SHOWN:
        return "bad", f"{start}. The run is too short to show it."
    return "bad", (
        f"{start}. The run does not show it, as nothing sets off the direction that grows."
    )


def _stable_loop(x: Examination) -> tuple[Kind, str]:
    assert x.loop is not None
    status, last = x.run.status, x.last
    if not status.complete:
        return "bad", f"The run fails, though the linear loop is stable: {_said(x)}"
    if not status.ok:
        return "bad", f"The linear loop is stable, but the run does not arrive: {_said(x)}"
    apart = disagrees(x)
    if last.kind in ("growing", "swinging", "receding") and apart:
        what = {
            "growing": f"the camera swings by ±{length(last.half_range)}, growing",
            "swinging": f"the camera swings by ±{length(last.half_range)}",
            "receding": f"the camera falls away from its reference, to {length(last.distance)}",
        }[last.kind]
        return "warning", (
            "Theory and run disagree: the linear loop is stable, but in the last quarter of the "
            f"run {what}{f'; {held}' if (held := _held(x)) else ''}. {_left_out(x)}"
        )
    if _too_short(x):
        constant = 0.0 if x.advice is None else x.advice.constant or 0.0
        return "warning", (
            f"The loop is stable, but a run of {seconds(float(x.run.t[-1]))} is too short for it "
            f"to settle: its slowest errors take {seconds(constant)} to fall to 1/e."
        )
    if x.noisy and last.distance > THROWN * float(x.run.depths[-1].mean()):
        return "warning", (
            "This loop is stable, but what is random moves the camera in the last quarter of the "
            f"run by up to {length(last.distance)}."
        )
    held = _held(x)
    if apart and x.figure_1 is None:
        elsewhere = "the run is elsewhere than the linear loop says"
        because = f"; {held}" if held else ""
        return "warning", f"This loop is stable, but {elsewhere}{because}. {_left_out(x)}".rstrip()
    text = f"This loop is stable, and the run {_does(x)}"
    if held:
        text += f"; {held} on the way"
    kind: Kind = "warning" if x.positioning is not None and not x.arrives else "good"
    return kind, f"{text}."


def _does(x: Examination) -> str:
    """What a run does that has no reason to complain."""
    still = x.last.kind in ("at its reference", "steady")
    if x.scenario.motion.kind != "hold":
        return "settles" if still else "follows its reference"
    if x.positioning is not None:
        if x.arrives:
            return "arrives"
        return "settles, though not at its goal" if still else "stays about its goal"
    if float(np.abs(x.run.lag[:, :3]).max()) < NOTHING:
        return "stays at its reference, as nothing disturbs it"
    return "stays near its reference"


def _too_short(x: Examination) -> bool:
    """Whether the run of a stable loop ended before it could settle, or arrive."""
    assert x.loop is not None
    if not (x.loop.is_stable and x.run.status.complete) or x.noisy:
        return False
    if x.positioning is not None and not x.arrives:
        lag = x.loop.steady_lag
        rest = np.inf if lag is None else float(np.linalg.norm(lag[:3]))
        return not disagrees(x) and rest < UNMOVED * x.last.distance
    constant = 0.0 if x.advice is None else x.advice.constant or 0.0
    moves = x.last.half_range > max(CLOSE * abs(x.last.mean), NOTHING)
    return constant * SHORT > x.run.t[-1] and moves


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
