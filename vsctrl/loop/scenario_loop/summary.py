"""What the loop of a scenario says of itself, in six lines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

from vsctrl.arrays import Array
from vsctrl.loop.scenario_loop.directions import Direction
from vsctrl.loop.scenario_loop.elements import Elements
from vsctrl.tables import limit, listed

#: Where the latency acts, in a word or two.
_PLACES = {"measurement": "seen late", "aligned": "seen late, aligned", "actuator": "moved late"}
_SMALL = 5e-10  #: m or rad, of a lag that is shown as 0


class _Found(Protocol):
    """What is told of a loop."""

    @property
    def elements(self) -> Elements: ...
    @property
    def directions(self) -> tuple[Direction, ...]: ...
    @property
    def left_out(self) -> dict[str, str]: ...
    @property
    def critical(self) -> Direction: ...
    @property
    def growth(self) -> float: ...
    @property
    def gain_limit(self) -> float: ...
    @property
    def steady_lag(self) -> Array | None: ...


def summary_lines(found: _Found) -> dict[str, str]:
    """Law and delays, κ of each direction, stability, limit of the gain, lag, what is left out."""
    several = len(found.directions) > 1
    which = f", {found.critical.name}" if several else ""
    word = "stable" if found.growth < 1 else "unstable"
    return {
        "loop": _elements(found.elements),
        "κ": listed([_named(each) for each in found.directions], 3),
        "as sampled": f"{word}{_decay(found)}",
        "gain limit": f"{limit(found.gain_limit, 's⁻¹')}{which if _finite(found) else ''}",
        "steady lag": _lag(found.steady_lag),
        "left out": listed(list(found.left_out), 8),
    }


def _elements(e: Elements) -> str:
    parts = [f"λ = {e.lam:g} s⁻¹, k_ff = {e.k_ff:g}", f"{1e3 * e.tau:g} ms {_PLACES[e.placement]}"]
    parts += [f"dead time {1e3 * e.dead_time:g} ms"] if e.dead_time else []
    parts += [f"axes of {1e3 * e.time_constant:g} ms"] if e.time_constant else []
    parts += [f"T_i = {e.T_i:g} s"] if e.T_i is not None else []
    parts += ["Smith predictor"] if e.smith else []
    parts += ["Kalman filter"] if e.filter is not None else []
    parts += ["preview"] if e.preview or e.preview_ff else []
    return ", ".join([*parts, f"every {1e3 * e.period:g} ms"])


def _named(direction: Direction) -> str:
    kappa, name = direction.kappa, direction.name
    shown = f"{kappa:.4g}" if kappa.imag else f"{kappa.real:.4g}"
    return shown if name.startswith("κ") else f"{shown} ({name})"


def _decay(found: _Found) -> str:
    if found.growth >= 1:
        return f", grows {found.growth:.4g}-fold each frame" if found.growth > 1 else ""
    if found.growth <= 0:
        return ", at rest after a few frames"
    return f", errors fall to 1/e in {-found.elements.period / math.log(found.growth):.3g} s"


def _finite(found: _Found) -> bool:
    return math.isfinite(found.gain_limit)


def _lag(lag: Array | None) -> str:
    if lag is None:
        return "none: no constant twist, or unstable"
    return f"({_listed(lag[:3])}) mm, ({_listed(lag[3:])}) mrad"


def _listed(part: Sequence[float] | Array) -> str:
    return ", ".join(f"{0.0 if abs(x) < _SMALL else 1e3 * x:.4g}" for x in part).replace("-", "−")
