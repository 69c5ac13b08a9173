"""Margins in words: the line above a figure, and the sentences below it."""

from __future__ import annotations

import math

from vsctrl.diagram.frequency.margins import Margins
from vsctrl.report.plots.subject import Subject
from vsctrl.report.wording import digits


def short(value: float, unit: str = "") -> str:
    """A number of three digits with its unit, as text: −0.0123 s, ∞."""
    return f"{digits(0.0 if abs(value) < 1e-9 else value, 3)}{unit}"


def nearest_gain(m: Margins) -> tuple[float, float] | None:
    """(ω, factor) of the change of gain, up or down, that is nearest to doing something."""
    known = [(w, f) for w, f in m.phase_crossings if f > 0]
    return min(known, key=lambda pair: abs(math.log(pair[1])), default=None)


def nearest_phase(m: Margins) -> tuple[float, float] | None:
    """(ω, phase margin in rad) of the gain crossing nearest to −1."""
    return min(m.gain_crossings, key=lambda pair: abs(pair[1]), default=None)


def outside(subject: Subject) -> str:
    """Where the roots of an unstable loop are."""
    sampled = subject.top < math.inf
    return f"on or {'outside the unit circle' if sampled else 'right of the imaginary axis'}"


def title(subject: Subject) -> str:
    """What the margins are, in a line; the name of what is no opened loop."""
    m = subject.margins
    if m is None:
        return subject.name
    if not m.stable:
        return f"unstable: {roots(m.unstable_roots)} {outside(subject)}"
    parts = [f"gain margin {short(m.gain)}"] if m.gain < math.inf else ["no gain limit"]
    if m.gain_down > 0:
        parts.append(f"gain down to {short(m.gain_down)}")
    if m.phase < math.inf:
        parts.append(f"phase margin {short(math.degrees(m.phase))}°")
    parts.append(f"delay margin {short(m.delay, ' s')}")
    return ", ".join(parts)


def sentence(subject: Subject) -> str:
    """The margins with their frequencies; empty for what is no opened loop."""
    m = subject.margins
    if m is None:
        return f"{subject.name}: {subject.trouble}" if subject.trouble else ""
    if not m.stable:
        text = f"{subject.name}: the closed loop is unstable, with {roots(m.unstable_roots)} "
        text += outside(subject)
        if (near := nearest_gain(m)) is not None and near[1] != 1:
            text += f"; roots cross it at {short(near[1])} times the gain{_at(m, near[1])}"
        return f"{text}."
    parts = [f"gain margin {short(m.gain)}{_at(m, m.gain)}"]
    if m.gain_down > 0:
        parts.append(f"stable down to {short(m.gain_down)} times the gain{_at(m, m.gain_down)}")
    if (near := nearest_phase(m)) is not None:
        degrees = short(math.degrees(near[1]))
        parts.append(f"phase margin {degrees}° at {short(near[0], ' rad/s')}")
    parts.append(f"delay margin {short(m.delay, ' s')}")
    parts.append(f"peak of S {short(m.peak_sensitivity)} at {short(m.peak_frequency, ' rad/s')}")
    return f"{subject.name}: {', '.join(parts)}; the closed loop is stable."


def _at(m: Margins, factor: float) -> str:
    """The frequency of a gain margin, where it has one."""
    places = [w for w, f in m.phase_crossings if f == factor]
    return f" at {short(places[0], ' rad/s')}" if places else ""


def roots(number: float) -> str:
    """So many roots, infinitely many of a neutral loop."""
    if math.isinf(number):
        return "infinitely many roots"
    return f"{number:g} root{'' if number == 1 else 's'}"
