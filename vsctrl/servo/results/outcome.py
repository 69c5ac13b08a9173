"""What a run came to: a few numbers and sentences for people, the same ones everywhere.

The command line prints them, figures take their captions from them.
"""

from dataclasses import asdict, dataclass
from importlib import metadata
from typing import Any, NamedTuple

import numpy as np

from vsctrl.arrays import Array
from vsctrl.errors import InputError
from vsctrl.servo.results.columns import measured_in_pixels
from vsctrl.servo.results.frames import Frames
from vsctrl.servo.results.status import Event, Status
from vsctrl.servo.robot.gantry import Gantry
from vsctrl.tables import Printed

SCHEMA = "vsctrl-simulate/1"
# Less than this is rounding to a reader, in mm, mrad, px and their speeds alike.
NOTHING = 1e-6
# A distance that grows by more than this share in the last quarter has not settled, …
GROWTH = 0.05
# … if that is more than this, m.
UNSETTLED = 1e-4
# Share of the mean lag by which it swings where its last sample says nothing.
SWING = 0.2
# Share of the frames, at the end, that counts as the run's last part.
LAST = 0.25
UNSTEADY = "The distance from the reference is still growing at the end."


class EndAndMean(NamedTuple):
    """A quantity at the last frame, and in the last quarter of a completed run.

    final; mean ± half_range: over that quarter, which is steady where half_range is small; None
    after a failure, which ends before any steady state.
    """

    final: float
    mean: float | None
    half_range: float | None


class Reach(NamedTuple):
    """The joint that came nearest to an end of its range: its number, 1..6, the share of the range
    from the middle (0) to the end (1), when (s), and the least |cos q₅| of the wrist."""

    joint: int
    share: float
    t: float
    wrist: float


@dataclass(frozen=True, slots=True, repr=False)
class Outcome(Printed):
    """Summary of a run.

    along: lag along the motion, m, None for a reference that does not translate; distance: of the
    camera from its reference, m; angle: by which it is turned away, rad; true_error: norm of
    s − s*, px; measured_error: norm of what the law was shown, in measured_unit; speed, rate: the
    camera's greatest, m/s and rad/s, each with its time in s; visible: least number of points that
    the image showed, of ``points``; reach: of the joints, None for a free camera; settled: the run
    completed, and in its last quarter the distance neither reached beyond what it had been before
    nor grew in the root mean square, by more than 5 %.
    """

    name: str
    digest: str
    status: Status
    events: tuple[Event, ...]
    frames: int
    end: float
    along: EndAndMean | None
    distance: EndAndMean
    angle: EndAndMean
    true_error: EndAndMean
    measured_error: EndAndMean
    measured_unit: str
    speed: tuple[float, float]
    rate: tuple[float, float]
    visible: int
    points: int
    reach: Reach | None
    settled: bool

    def data(self) -> dict[str, Any]:
        """The same as JSON takes it; every name ends in its unit."""

        def numbers(value: EndAndMean | None) -> dict[str, float | None] | None:
            return None if value is None else value._asdict()

        return {
            "schema": SCHEMA,
            "version": metadata.version("vsctrl"),
            "scenario": {"name": self.name, "digest": self.digest},
            "status": asdict(self.status),
            "events": [asdict(event) for event in self.events],
            "frames": self.frames,
            "end_s": self.end,
            "lag_along_motion_m": numbers(self.along),
            "distance_m": numbers(self.distance),
            "angle_rad": numbers(self.angle),
            "true_error_px": numbers(self.true_error),
            "measured_error": numbers(self.measured_error),
            "measured_error_unit": self.measured_unit,
            "peak_speed_m_s": self.speed[0],
            "peak_speed_at_s": self.speed[1],
            "peak_rate_rad_s": self.rate[0],
            "peak_rate_at_s": self.rate[1],
            "least_points_visible": self.visible,
            "points": self.points,
            "joints": None if self.reach is None else self.reach._asdict(),
            "settled": self.settled,
        }

    def __str__(self) -> str:
        """A table to print."""
        rows = [
            ("along the motion", self.along, 1e3, "mm", True),
            ("distance from the reference", self.distance, 1e3, "mm", False),
            ("angle to the reference", self.angle, 1e3, "mrad", False),
            ("true image error", self.true_error, 1.0, "px", False),
            ("measured error", self.measured_error, 1.0, self.measured_unit, False),
        ]
        lines = [
            f"{self.name} ({self.digest}), {self.frames} frames to t = {self.end:g} s",
            self.status.sentence,
            *(event.sentence for event in self.events),
            *([UNSTEADY] if self.status.complete and not self.settled else []),
            "",
            f"{'':<28}{'at the end':>14}    last quarter",
        ]
        for label, ends, scale, unit, signed in rows:
            if ends is None:
                lines.append(f"{label:<28}{'-':>14}    the reference does not translate")
                continue
            last = ""
            if ends.mean is not None and ends.half_range is not None:
                spread = number(scale * ends.half_range)
                last = f"{number(scale * ends.mean, signed)} ± {spread} {unit}"
            final = f"{number(scale * ends.final, signed)} {unit}"
            words = f"({side(1e3 * ends.final)})" if signed and side(1e3 * ends.final) else ""
            lines.append(f"{label:<28}{final:>14}    {last:<24}{words}".rstrip())
        for label, (value, t), scale, unit in (
            ("greatest speed", self.speed, 1e3, "mm/s"),
            ("greatest rate of turn", self.rate, 1e3, "mrad/s"),
        ):
            at = f"at t = {t:g} s" if scale * value > NOTHING else ""
            lines.append(f"{label:<28}{number(scale * value) + ' ' + unit:>14}    {at}".rstrip())
        if self.visible < self.points:
            lines.append(
                f"{'points in the image':<28}{self.visible:>14}    of {self.points}, at the least"
            )
        if self.reach is not None:
            at = f"{100 * self.reach.share:.3g} %"
            lines.append(
                f"{'joint nearest to its end':<28}{at:>14}    of its range, joint "
                f"{self.reach.joint} at t = {self.reach.t:g} s"
            )
        return "\n".join(lines)


def outcome(run: Frames) -> Outcome:
    """The summary of a run."""
    speed, rate = (np.linalg.norm(run.twist[:, part], axis=1) for part in (_V, _OMEGA))
    try:
        along = _end_and_mean(run, run.lag_along_motion)
    except InputError:
        along = None
    return Outcome(
        name=run.scenario.name,
        digest=run.scenario.digest,
        status=run.status,
        events=run.events,
        frames=len(run.t),
        end=float(run.t[-1]),
        along=along,
        distance=_end_and_mean(run, distance(run)),
        angle=_end_and_mean(run, np.linalg.norm(run.lag[:, _OMEGA], axis=1)),
        true_error=_end_and_mean(run, np.linalg.norm(run.error, axis=1)),
        measured_error=_end_and_mean(run, np.linalg.norm(run.measured_error, axis=1)),
        measured_unit="px" if measured_in_pixels(run.scenario) else "(own units)",
        speed=_peak(run, speed),
        rate=_peak(run, rate),
        visible=int(run.visible.sum(axis=1).min()),
        points=run.visible.shape[1],
        reach=_reach(run),
        settled=run.status.complete and _settled(distance(run)),
    )


_V, _OMEGA = slice(0, 3), slice(3, 6)


def distance(run: Frames) -> Array:
    """Distance of the camera from its reference, (n,) in m."""
    return np.linalg.norm(run.pose[:, :3, 3] - run.reference_pose[:, :3, 3], axis=1)


def notice(summary: Outcome) -> str:
    """One to three sentences on what a reader of the run's figure should see."""
    parts = [UNSTEADY] if summary.status.complete and not summary.settled else []
    if not summary.status.ok:
        return " ".join([summary.status.sentence, *parts])
    if summary.along is not None and swings(summary.along):
        mean, half = summary.along.mean or 0.0, summary.along.half_range or 0.0
        where = f" about {number(abs(1e3 * mean))} mm {side(mean)}" if side(1e3 * mean) else ""
        parts.append(
            f"In the last quarter of the run its lag along the motion swings by ±"
            f"{number(1e3 * half)} mm{where}."
        )
    elif summary.along is None:
        parts.append(
            f"The camera ends {number(1e3 * summary.distance.final)} mm from its reference."
        )
    elif not side(1e3 * summary.along.final):
        parts.append("The camera ends level with its reference along the motion.")
    else:
        lag = 1e3 * summary.along.final
        where = {"ahead": "ahead of", "behind": "behind"}[side(lag)]
        parts.append(f"The camera ends {number(abs(lag))} mm {where} its reference.")
    true, seen = summary.true_error.final, summary.measured_error.final
    if summary.along is not None and swings(summary.along):
        most = (summary.true_error.mean or 0.0) + (summary.true_error.half_range or 0.0)
        parts.append(f"The true image error is up to {number(most)} px then.")
    elif summary.measured_unit != "px":
        parts.append(f"The true image error is then {number(true)} px.")
    else:
        only = "only " if true > 2 * seen + NOTHING else ""
        parts.append(
            f"The true image error is then {number(true)} px; the law was shown {only}"
            f"{number(seen)} px."
        )
    if summary.visible < summary.points:
        parts.append(
            f"At the least {summary.visible} of {summary.points} points were in the image."
        )
    return " ".join(parts)


def swings(lag: EndAndMean) -> bool:
    """Whether a lag (m) moves so much in the last quarter that its last sample says nothing."""
    if lag.mean is None or lag.half_range is None:
        return False
    return lag.half_range > max(SWING * abs(lag.mean), UNSETTLED)


def number(value: float, signed: bool = False) -> str:
    """Four significant digits with a true minus sign; rounding is 0."""
    if abs(value) < NOTHING:
        return "0"
    text = f"{value:+.4g}" if 1e-4 <= abs(value) < 1e4 else f"{value:+.3e}"
    if 1e4 <= abs(value) < 1e7:
        text = f"{value:+.0f}"
    return (text if signed else text.lstrip("+")).replace("-", "−")


def side(lag: float) -> str:
    """Whether a lag in mm is "ahead" or "behind"; nothing for a lag of nothing."""
    return "" if abs(lag) < NOTHING else "ahead" if lag > 0 else "behind"


def _reach(run: Frames) -> Reach | None:
    if run.joints is None:
        return None
    gantry = Gantry()
    share = gantry.range_share(run.joints)
    k, joint = np.unravel_index(np.argmax(share), share.shape)
    wrist = float(gantry.singularity(run.joints).min())
    return Reach(int(joint) + 1, float(share[k, joint]), float(run.t[k]), wrist)


def _settled(distances: Array) -> bool:
    n = max(1, round(LAST * len(distances)))
    if 2 * n > len(distances):
        return True
    before, quarter, last = distances[:-n], distances[-2 * n : -n], distances[-n:]
    # The peak of what comes and goes was there before; that of noise is no greater on the whole.
    beyond = float(last.max()) > (1 + GROWTH) * float(before.max())
    grown = float(np.sum(last**2)) > (1 + GROWTH) ** 2 * float(np.sum(quarter**2))
    more = float(last.max()) - float(before.max()) > UNSETTLED
    return not (beyond and grown and more)


def _end_and_mean(run: Frames, values: Array) -> EndAndMean:
    final = float(values[-1])
    if not run.status.complete:
        return EndAndMean(final, None, None)
    last = values[-max(1, round(LAST * len(values))) :]
    low, high = float(last.min()), float(last.max())
    return EndAndMean(final, float(last.mean()), (high - low) / 2)


def _peak(run: Frames, values: Array) -> tuple[float, float]:
    k = int(np.argmax(values))
    return float(values[k]), float(run.t[k])
