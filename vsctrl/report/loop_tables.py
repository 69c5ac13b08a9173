"""The tables about a loop: its parameters, margins, roots and step responses."""

from __future__ import annotations

import math
from typing import Any

from vsctrl.diagram import Loop
from vsctrl.diagram.channel import OpenLoop
from vsctrl.diagram.frequency.margins import Margins
from vsctrl.errors import InputError, LimitError
from vsctrl.report.section import Table
from vsctrl.report.wording import digits, percent, time

MANY = 6  #: crossings of a kind and roots that are listed


def parameter_table(loop: Loop) -> Table:
    """Every parameter with its value in SI and what it is."""
    rows = [
        (name, f"{value:.6g}".replace("-", "−"), loop.meanings.get(name, ""))
        for name, value in loop.values.items()
    ]
    return Table(("parameter", "value, SI", "meaning"), rows, "Parameters", left=3)


def margins_table(loop: Loop, opened: Any, margins: Margins, caption: str) -> Table:
    """Margins with every crossing behind them, Ms, Mt, delay and, of an L(s), disk margin."""
    rows = [
        ("closed loop", "stable" if margins.stable else "unstable"),
        ("gain margin", _factor(margins.gain)),
        ("phase margin", _degrees(margins.phase)),
        ("delay margin", _time(margins.delay, loop)),
        ("Ms = max |S|", digits(margins.peak_sensitivity, 4)),
    ]
    if (complementary := getattr(margins, "peak_complementary", None)) is not None:
        rows.append(("Mt = max |T|", digits(complementary, 4)))
    try:
        disk = opened.disk_margin() if isinstance(opened, OpenLoop) else None
    except (InputError, LimitError):
        disk = None
    if disk is not None:
        rows.append(
            (
                "disk margin",
                f"α = {digits(disk.alpha, 4)}: gain × {digits(disk.gain_min, 3)} to "
                f"{digits(disk.gain_max, 3)}, or phase ± {digits(math.degrees(disk.phase), 3)}°",
            )
        )
    rows.append(("|L| = 1 at", _listed(margins.gain_crossings)))
    rows.append(("L real and negative at", _listed(margins.phase_crossings)))
    return Table((), rows, caption, left=2)


def roots_table(loop: Loop) -> Table:
    """The rightmost roots, with damping and time constant."""
    rows = []
    for root in loop.system.poles(MANY):
        if root.imag < 0:
            continue
        damping = -root.real / abs(root) if root else 0.0
        falls = f"1/e in {time(-1 / root.real, loop.time_unit)}" if root.real < 0 else "grows"
        pair = f" ± {digits(root.imag, 4)}j" if root.imag else ""
        rows.append((f"{digits(root.real, 4)}{pair}".replace("-", "−"), f"{damping:.3f}", falls))
    return Table(("root, rad/s", "damping", "a disturbance"), rows, "Rightmost roots")


def step_table(loop: Loop) -> Table | None:
    """Rise, settling, overshoot and IAE of the responses to steps."""
    rows = []
    for one in loop.applied:
        if one.kind != "step":
            continue
        for signal in loop.watched:
            row = _step_row(loop, one.input, signal)
            if row is not None:
                rows.append(row)
    heads = ("unit step", "final", "rise 10–90 %", "settling 2 %", "overshoot", "peak", "IAE")
    title = f"Step responses{', at the samples' * (loop.sampled is not None)}"
    return Table(heads, rows, title) if rows else None


def _step_row(loop: Loop, source: str, target: str) -> tuple[str, ...] | None:
    try:
        info = loop.step_info(source, target)
    except (InputError, LimitError):
        return None
    try:
        against = "input" if info.final and abs(info.final - 1) < 1e-6 else "zero"
        error = loop.channel(source, target).integral_errors(against=against).iae
    except (InputError, LimitError):
        error = math.inf
    unit = loop.time_unit
    return (
        f"{source} → {target}",
        _number(info.final),
        "–" if info.rise_time is None else time(info.rise_time, unit),
        _time(info.settling_time, loop, "never"),
        "–" if info.overshoot is None else percent(info.overshoot),
        _number(info.peak),
        "–" if not math.isfinite(error) else f"{digits(error, 4)} s",
    )


def _number(value: float | None) -> str:
    return "–" if value is None else digits(value, 4).replace("-", "−")


def _factor(value: float) -> str:
    return f"× {digits(value, 5)}" if math.isfinite(value) else "no limit"


def _degrees(value: float) -> str:
    return f"{digits(math.degrees(value), 4)}°" if math.isfinite(value) else "no limit"


def _time(value: float, loop: Loop, other: str = "no limit") -> str:
    return time(value, loop.time_unit) if math.isfinite(value) else other


def _listed(frequencies: Any) -> str:
    found = [float(w) for w, _ in frequencies]
    if not found:
        return "no frequency"
    more = f" and {len(found) - MANY} more" if len(found) > MANY else ""
    return ", ".join(digits(w, 5) for w in found[:MANY]) + f" rad/s{more}"
