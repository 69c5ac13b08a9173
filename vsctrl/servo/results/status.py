"""How a run ends and what it goes on in spite of: the kinds, and the records of both."""

from dataclasses import dataclass
from typing import Literal

Kind = Literal[
    "completed",
    "reference not reached",
    "target behind camera",
    "too few points",
    "all points lost",
    "rank loss",
    "pose not found",
    "joint limit",
    "diverged",
]


@dataclass(frozen=True, slots=True)
class Event:
    """Something that a run went on in spite of: what, from which frame on, in how many frames.

    >>> run = vs.simulate(vs.paper.sliding(latency=0).with_(speed_limit=0.03))
    >>> run.events[0].frames
    226
    """

    kind: str
    frame: int
    frames: int
    sentence: str


@dataclass(frozen=True, slots=True)
class Status:
    """How a run ended.

    ok: every frame was computed, and the camera did not end elsewhere than at its reference; kind:
    what happened; frame: the last frame of a complete run, else the frame that failed; sentence:
    the same for a reader, with the cause and the remedy.

    >>> vs.simulate(vs.paper.sliding()).status.kind
    'completed'
    """

    ok: bool
    kind: Kind
    frame: int
    sentence: str

    @property
    def complete(self) -> bool:
        """Whether every frame was computed, wherever the camera ended."""
        return self.kind in ("completed", "reference not reached")


#: The key of [faults] that decides about each kind; what is not here always ends the run.
POLICY: dict[Kind, str] = {
    "target behind camera": "on_behind",
    "too few points": "on_lost",
    "all points lost": "on_lost",
    "rank loss": "on_rank_loss",
    "pose not found": "on_rank_loss",
    "joint limit": "on_joint_limit",
}
#: Kinds whose frame has an image and a command still.
SEEN: frozenset[Kind] = frozenset(POLICY) - {"target behind camera"}
