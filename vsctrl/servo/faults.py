"""What can go wrong in a run, in sentences, and whether the run then ends or goes on."""

from collections.abc import Mapping

import numpy as np

from vsctrl.arrays import Array
from vsctrl.servo.results.status import POLICY, Event, Kind, Status
from vsctrl.servo.robot.joints import Stop


class Faults:
    """The faults of a run so far; it evolves with the run.

    policy: "end" or "continue" by the keys of [faults].
    """

    def __init__(self, policy: Mapping[str, str]) -> None:
        self._policy = policy
        self._first: dict[str, tuple[int, str]] = {}
        self._frames: dict[str, int] = {}

    def met(self, kind: Kind, frame: int, sentence: str) -> Status | None:
        """A fault at a frame: the status that ends the run, or None where it goes on."""
        if kind not in POLICY or self._policy[POLICY[kind]] == "end":
            return Status(False, kind, frame, sentence)
        self.noted(kind, frame, sentence)
        return None

    def noted(self, kind: str, frame: int, sentence: str) -> None:
        """Something that the run goes on in spite of."""
        self._first.setdefault(kind, (frame, sentence))
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


def diverged(k: int, t: float, farthest: float, still: bool, saturated: int | None) -> str:
    """The camera is farther away than any image would show.

    still: neither target nor reference moves, so that nothing outran the camera; saturated: the
    first frame in which the robot's limits held it back, None if they never did.
    """
    remedy = "Lower law.lam or vision.latency"
    if saturated is not None:
        less = "start nearer to the reference" if still else "slow down what it follows"
        why = (
            f"The robot's limits held it back, first in frame {saturated}: they are too low, or "
            f"the loop is unstable. {remedy} if it shakes, else raise the limits of [robot] or "
            f"{less}."
        )
    elif still:
        why = (
            "Nothing that it follows moves and no limit held it back: the loop is unstable. "
            f"{remedy}."
        )
    else:
        why = (
            "No limit of the robot held it back: the loop is unstable, or what it follows is too "
            f"fast for the law. {remedy} if it shakes, else raise law.lam or law.k_ff."
        )
    return (
        f"At frame {k} (t = {t:g} s) the camera was more than {farthest:.3g} m from its reference, "
        f"and the run ends before this frame. {why}"
    )


def behind(k: int, t: float, z: Array) -> str:
    """A point is not in front of the camera."""
    i = int(np.argmin(z))
    return (
        f"At frame {k} (t = {t:g} s) point {i + 1} would lie at depth {z[i]:.3g} m, behind the "
        "camera. Lower law.lam or start nearer to the reference."
    )


def lost(k: int, t: float, seen: int) -> tuple[Kind, str]:
    """The image that the law is shown has fewer than three points."""
    kind: Kind = "too few points" if seen else "all points lost"
    shows = f"only {seen} of the points" if seen else "none of the points"
    return kind, (
        f"At frame {k} (t = {t:g} s) the image showed {shows}, and three are needed. Choose "
        "another motion, more points, or a larger camera.size_px."
    )


def rank_loss(k: int, t: float, rank: int) -> str:
    """L̂ does not tell all motions apart."""
    return (
        f"At frame {k} (t = {t:g} s) the interaction matrix of the law had rank {rank} of 6, so "
        "that the image no longer tells all motions apart; its twist is of least norm. Use "
        "other points or another law.interaction."
    )


def no_pose(k: int, t: float) -> str:
    """No pose of the camera fits the image."""
    return (
        f"At frame {k} (t = {t:g} s) no pose of the camera fitted the image. Use more points, or "
        "start nearer to the reference."
    )


def stopped(k: int, t: float, stop: Stop) -> str:
    """A joint of the robot is at its end, or it was sent nowhere that is a number."""
    if stop.joint is None:
        return (
            f"At frame {k} (t = {t:g} s) the twist that reached the robot was beyond every number: "
            "the loop is unstable, and the camera stays where it is. Lower law.lam or "
            "vision.latency."
        )
    unit = "m" if stop.joint <= 3 else "rad"
    return (
        f"At frame {k} (t = {t:g} s) joint {stop.joint} of the robot would pass the end of its "
        f"range: it would stand at {stop.value:.6g} {unit}, and the limit is {stop.limit:.6g} "
        f"{unit}. Begin elsewhere (robot.joints), shorten the motion, or set robot.avoidance = "
        "true."
    )


def saturated(k: int, t: float) -> str:
    """The robot did less than it was told (``Carrier.saturated``)."""
    return f"From frame {k} (t = {t:g} s) on, the robot's limits held it back."


def _times(frames: int) -> str:
    return f"{frames} frame{'s' if frames > 1 else ''}"
