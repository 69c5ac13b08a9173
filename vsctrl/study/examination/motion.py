"""What the last part of a run is: at rest, following, swinging, growing, or ended too early."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from vsctrl.errors import InputError
from vsctrl.servo import Run
from vsctrl.tables import plain

LAST = 0.25  #: share of the frames that is the last part
STEADY = 0.1  #: of the mean lag, by which what is steady may swing
SMALL = 1e-5  #: m, below which a swing is not spoken of
GROWS = 1.05  #: by which the second half of the last part is larger where a swing grows
SLOWING = 0.9  #: of its way in one half, what goes to an end covers less in the next
FEW = 8  #: frames, of which no last part can be told

Kind = Literal[
    "at its reference", "steady", "settling", "swinging", "growing", "receding", "ended early"
]


@dataclass(frozen=True)
class LastPart:
    """The camera in the last quarter of a run, lengths in m; `frames` is how many that are.

    `mean`: along the motion, or from the reference where that does not translate; `half_range`: to
    either side of it; `distance`: the greatest from the reference; `kind`: in a word.
    """

    kind: Kind
    mean: float
    half_range: float
    distance: float
    along_motion: bool
    frames: int

    def data(self) -> dict[str, Any]:
        """As JSON takes it."""
        return dict(plain(self))


def last_part(run: Run) -> LastPart:
    """The last quarter of a run, as its frames have it."""
    n = max(1, round(LAST * len(run.t)))
    camera = run.pose[:, :3, 3] - run.reference_pose[:, :3, 3]
    distance = np.linalg.norm(camera, axis=1)
    try:
        values, along = run.lag_along_motion, True
    except InputError:
        values, along = distance, False
    last = values[-n:]
    mean, half_range = float(last.mean()), float(np.ptp(last)) / 2
    kind = _kind(run, values, distance, n)
    return LastPart(kind, mean, half_range, float(distance[-n:].max()), along, n)


def _kind(run: Run, values: Any, distance: Any, n: int) -> Kind:
    if not run.status.complete:
        return "ended early"
    last = values[-n:]
    first, second = distance[-n : -n // 2], distance[-n // 2 :]
    if float(distance[-n:].max()) < SMALL:
        return "at its reference"
    if n < FEW:
        return "steady"
    half_range = float(np.ptp(last)) / 2
    if half_range <= max(STEADY * abs(float(last.mean())), SMALL):
        return "steady"
    # A cycle may take longer than the last part: what grows is beyond the half before it too.
    largest, before = float(distance[-n:].max()), float(distance[-3 * n : -n].max(initial=0.0))
    grows = largest > GROWS * before
    if int(np.sum(np.diff(np.sign(np.diff(last))) != 0)) < 2:
        slowing = np.ptp(second) < SLOWING * np.ptp(first)
        if grows:
            return "settling" if slowing else "receding"
        return "settling" if GROWS * largest < before else "swinging"
    # What is random, or swings more slowly than that, is larger in one half than in another too.
    middle = distance[-2 * n : -n]
    halves = [part for part in (*np.array_split(middle, 2), first, second) if len(part)]
    size = [float(np.sqrt(np.mean((half - half.mean()) ** 2))) for half in halves]
    rises = all(b > GROWS * a for a, b in pairwise(size))
    return "growing" if grows and rises else "swinging"
