"""What can go wrong in a run, in sentences, and whether the run then ends or goes on."""

from collections.abc import Mapping
from typing import Self

import numpy as np

from vsctrl.arrays import Array
from vsctrl.servo.results.status import POLICY, Event, Kind, Status
from vsctrl.servo.robot.joints import Stop


class Told(str):
    """A fault in words: what happened, and what usually is to be done about it."""

    happened: str  #: the first part alone, to which a cause may be added that was looked for

    def __new__(cls, happened: str, remedy: str) -> Self:
        """Both parts as one text."""
        told = super().__new__(cls, f"{happened} {remedy}")
        told.happened = happened
        return told


class Faults:
    """The faults of a run so far; it evolves with the run.

    policy: "end" or "continue" by the keys of [faults].
    """

    def __init__(self, policy: Mapping[str, str]) -> None:
        self._policy = policy
        self._first: dict[str, tuple[int, str]] = {}
        self._frames: dict[str, int] = {}
        self.happened = ""  #: of the fault that ended the run

    def met(self, kind: Kind, frame: int, told: Told) -> Status | None:
        """A fault at a frame: the status that ends the run, or None where it goes on."""
        if self._policy[POLICY[kind]] == "end":
            return self.ended(kind, frame, told)
        self.noted(kind, frame, told)
        return None

    def ended(self, kind: Kind, frame: int, told: Told) -> Status:
        """The status of a run that ends here whatever the policy is."""
        self.happened = told.happened
        return Status(False, kind, frame, str(told))

    def noted(self, kind: str, frame: int, sentence: str) -> None:
        """Something that the run goes on in spite of."""
        self._first.setdefault(kind, (frame, str(sentence)))
        self._frames[kind] = self._frames.get(kind, 0) + 1

    def since(self, kind: str) -> int | None:
        """The frame in which something was first noted, None if it never was."""
        return self._first[kind][0] if kind in self._first else None

    def events(self) -> tuple[Event, ...]:
        """All that the run went on in spite of, in the order in which it began."""
        events = [
            Event(
                kind,
                frame,
                self._frames[kind],
                f"{sentence} That was so in {_times(self._frames[kind])}.",
            )
            for kind, (frame, sentence) in self._first.items()
        ]
        return tuple(sorted(events, key=lambda event: event.frame))


def completed(n: int) -> Status:
    """The status of a run that reached the last of its n frames."""
    return Status(True, "completed", n - 1, f"The run completed all {n} frames.")


def diverged(k: int, t: float, farthest: float, still: bool, saturated: int | None) -> Told:
    """The camera is farther away than any image would show.

    still: neither target nor reference moves, so that nothing outran the camera; saturated: the
    first frame in which the robot's limits held it back, None if they never did.
    """
    remedy = "Lower law.lam or vision.latency"
    if saturated is not None:
        held = f"The robot's limits held it back, first in frame {saturated}:"
        less = "start nearer to the reference" if still else "slow down what it follows"
        why = (
            "they are too low, or the law is too slow or too quick for what it is asked; raise the "
            f"limits of [robot] or {less}."
        )
    elif still:
        held = "Nothing that it follows moves and no limit held it back:"
        why = f"the loop is unstable. {remedy}, or start nearer to the reference."
    else:
        held = "No limit of the robot held it back:"
        why = (
            "the loop is unstable, or what it follows is too fast for the law. "
            f"{remedy} if it shakes, else raise law.lam."
        )
    return Told(
        f"At frame {k} (t = {t:g} s) the camera was more than {farthest:.3g} m from its reference, "
        f"and the run ends before this frame. {held}",
        why,
    )


def behind(k: int, t: float, z: Array) -> Told:
    """A point is not in front of the camera."""
    i = int(np.argmin(z))
    return Told(
        f"At frame {k} (t = {t:g} s) point {i + 1} would lie at depth {z[i]:.3g} m, behind the "
        "camera.",
        "Lower law.lam or start nearer to the reference.",
    )


def lost(k: int, t: float, seen: int) -> tuple[Kind, Told]:
    """The image that the law is shown has fewer than three points."""
    kind: Kind = "too few points" if seen else "all points lost"
    shows = f"only {seen} of the points" if seen else "none of the points"
    return kind, Told(
        f"At frame {k} (t = {t:g} s) the image showed {shows}, and three are needed.",
        "Choose another motion, more points, or a larger camera.size_px.",
    )


def rank_loss(k: int, t: float, rank: int, why: str = "") -> Told:
    """L̂ does not tell all motions apart; why: that it does so at no pose, if that is so."""
    return Told(
        f"At frame {k} (t = {t:g} s) the interaction matrix of the law had rank {rank} of 6, so "
        "that the image no longer tells all motions apart; its twist is of least norm.",
        _sentence(why) or "Use other points or another law.interaction.",
    )


def blurred(k: int, t: float, rank: int, why: str) -> Told:
    """L does not tell all motions apart, and only errors of the image keep L̂ from saying so."""
    return Told(
        f"At frame {k} (t = {t:g} s) the image tells only {rank} of 6 motions apart, and what the "
        "law makes of the rest are errors of its image.",
        _sentence(why),
    )


def no_pose(k: int, t: float, why: str = "") -> Told:
    """No pose of the camera fits the image, or many do, as ``why`` then says."""
    return Told(
        f"At frame {k} (t = {t:g} s) no pose of the camera fitted the image"
        f"{', or many did' if why else ''}.",
        _sentence(why) or "Use more points, or start nearer to the reference.",
    )


def stopped(k: int, t: float, stop: Stop) -> Told:
    """A joint of the robot is at its end, or it was sent nowhere that is a number."""
    if stop.joint is None:
        return Told(
            f"At frame {k} (t = {t:g} s) the twist that reached the robot was beyond every number, "
            "and the camera stays where it is.",
            "The loop is unstable. Lower law.lam or vision.latency.",
        )
    unit = "m" if stop.joint <= 3 else "rad"
    return Told(
        f"At frame {k} (t = {t:g} s) joint {stop.joint} of the robot would pass the end of its "
        f"range: it would stand at {stop.value:.6g} {unit}, and the limit is {stop.limit:.6g} "
        f"{unit}.",
        "Begin elsewhere (robot.joints), shorten the motion, or set robot.avoidance = true.",
    )


def _sentence(words: str) -> str:
    return f"{words[0].upper()}{words[1:]}." if words else ""


def saturated(k: int, t: float) -> str:
    """The robot did less than it was told (``Carrier.saturated``)."""
    return f"From frame {k} (t = {t:g} s) on, the robot's limits held it back."


def _times(frames: int) -> str:
    return f"{frames} frame{'s' if frames > 1 else ''}"
