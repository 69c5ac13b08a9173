"""What is applied to an input of a loop: a set-point step, a disturbance, from some time on."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from vsctrl.checks import is_finite
from vsctrl.diagram.signals.elementary import Exponential, Parabola, Pulse, Ramp, Sine, Step
from vsctrl.diagram.signals.signal import Signal
from vsctrl.errors import nearest
from vsctrl.problems import Problem, show

LATEST = 1e12  #: s

#: kind → (what makes it, the key that it has besides its size)
KINDS: dict[str, tuple[Callable[..., Any], str]] = {
    "step": (Step, ""),
    "ramp": (Ramp, ""),
    "parabola": (Parabola, ""),
    "sine": (Sine, "omega"),
    "exponential": (Exponential, "rate"),
    "pulse": (Pulse, "width"),
}


@dataclass(frozen=True)
class Applied:
    """A signal at an input: `size` times a step, ramp, parabola, sine, exponential or pulse.

    It begins `at` (s). `size` is the amplitude, of a ramp the slope (1/s), of a parabola the
    acceleration (1/s²). A sine has `omega` (rad/s), an exponential `rate` (1/s), a pulse `width`
    (s). A `Loop` refuses those that are not usable.

    >>> vs.Applied("r", "step", size=2).kind
    'step'
    """

    input: str
    kind: str = "step"
    size: float = 1.0
    at: float = 0.0
    omega: float | None = None
    rate: float | None = None
    width: float | None = None

    @property
    def signal(self) -> Signal:
        """What a channel responds to, delayed until it begins."""
        make, key = KINDS[self.kind]
        begun: Signal = make(getattr(self, key), self.size) if key else make(self.size)
        return begun.delayed(self.at)

    def problems(self, inputs: tuple[str, ...]) -> Iterator[Problem]:
        """What is wrong with it, at a diagram that has these inputs."""
        if self.input not in inputs:
            known = ", ".join(inputs) or "none"
            yield (
                "input",
                f"{show(self.input)} is no input{nearest(self.input, inputs)}; "
                f"the loop has {known}",
            )
        for key in ("size", "at"):
            if not is_finite(value := getattr(self, key)):
                yield key, f"{show(value)} is not a finite number; give one"
        if is_finite(self.at) and not 0 <= self.at <= LATEST:
            yield "at", f"{show(self.at)} s is no time of the response; give 0 s to {LATEST:g} s"
        if not isinstance(self.kind, str) or self.kind not in KINDS:
            hint = nearest(self.kind, KINDS)
            yield "kind", f"{show(self.kind)} is unknown{hint}; choose {', '.join(KINDS)}"
            return
        wanted = KINDS[self.kind][1]
        for key in ("omega", "rate", "width"):
            value = getattr(self, key)
            if key == wanted and not (is_finite(value) and (value > 0 or key == "rate")):
                yield key, f"{show(value)} is not usable; give a {self.kind} its {key} above 0"
            elif key != wanted and value is not None:
                yield key, f"belongs to another kind than {self.kind}; leave it out"
