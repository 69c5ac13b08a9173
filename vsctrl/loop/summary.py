"""A loop at a glance: what the command line prints of figure 1 for one gain and one delay."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from typing import Any

from vsctrl import checks as check
from vsctrl.diagram import Ramp
from vsctrl.errors import InputError
from vsctrl.loop.figure1 import Placement, figure1
from vsctrl.loop.limits import fastest_gain, gain_limit
from vsctrl.loop.tracking import tracking_error

LEAST, MOST = 1e-30, 1e30  #: of a product that can still be multiplied and divided


@dataclass(frozen=True)
class Summary:
    """Margins, limits (s⁻¹), rightmost roots (rad/s) and steady errors per unit of speed (s).

    None stands for a limit that nothing sets, or a steady error that an unstable loop has not.
    """

    lam: float
    tau: float
    period: float | None
    kappa: float
    k_ff: float
    stable: bool
    unstable_roots: int
    gain_margin: float | None
    phase_margin_rad: float | None
    delay_margin_s: float | None
    peak_sensitivity: float
    limit_continuous: float | None
    limit_sampled: float | None
    stable_as_sampled: bool | None
    fastest_continuous: float | None
    fastest_sampled: float | None
    roots: tuple[tuple[float, float], ...]
    error_per_speed: dict[str, float | None]

    def json(self) -> str:
        """The summary as JSON text."""
        return json.dumps(asdict(self), indent=2, ensure_ascii=False)

    def __repr__(self) -> str:
        """The table, which is what somebody at a prompt wants to see."""
        return str(self)

    def __str__(self) -> str:
        verdict = "stable" if self.stable else f"UNSTABLE, {self.unstable_roots} roots on the right"
        if self.stable_as_sampled is not None:
            sampled = "stable" if self.stable_as_sampled else "UNSTABLE"
            verdict += f"; sampled: {sampled}"
        lines = [
            f"λ = {self.lam:g} s⁻¹, τ = {self.tau:g} s, κ = {self.kappa:g}, k_ff = {self.k_ff:g}",
            f"{'continuous loop':28}{verdict}",
            f"{'gain margin':28}{_shown(self.gain_margin)}",
            f"{'phase margin':28}{_shown(self.phase_margin_rad, math.degrees(1))}°",
            f"{'delay margin':28}{_shown(self.delay_margin_s, 1e3)} ms",
            f"{'sensitivity peak Ms':28}{self.peak_sensitivity:.4f}",
            f"{'stable up to':28}{_shown(self.limit_continuous)} s⁻¹{self._held('limit_sampled')}",
            f"{'fastest, no oscillation':28}{_shown(self.fastest_continuous)} s⁻¹"
            f"{self._held('fastest_sampled')}",
            f"{'rightmost roots, rad/s':28}" + ", ".join(_root(*root) for root in self.roots),
        ]
        for placement, error in self.error_per_speed.items():
            value = "–" if error is None else f"{1e3 * error:+.4g} mm at 1 m/s".replace("-", "−")
            lines.append(f"{'ramp error, ' + placement:28}{value}")
        return "\n".join(lines)

    def _held(self, name: str) -> str:
        value = getattr(self, name)
        return (
            "" if self.period is None else f", held over {1e3 * self.period:g} ms {_shown(value)}"
        )


def summarise(
    lam: float, tau: float, *, period: float | None = None, kappa: float = 1.0, k_ff: float = 1.0
) -> Summary:
    """Margins, limits, roots and tracking errors of figure 1.

    `lam` in s⁻¹, `tau` and `period` in s. Errors: `InputError` for a gain, κ or period that is not
    above 0, a negative delay, or numbers whose product
    is too large or too small to compute with; `LimitError` for roots that are too many to count.
    """
    check.positive("gain", lam)
    check.positive("ratio", kappa)
    check.delay("delay", tau)
    _check_sizes(lam, kappa, tau)
    if period is not None:
        check.positive("period", period)
    limits = gain_limit(tau, kappa=kappa), fastest_gain(tau, kappa=kappa)
    held: tuple[Any, Any] = (None, None)
    if period is not None:
        held = (
            gain_limit(tau, period=period, kappa=kappa),
            fastest_gain(tau, period=period, kappa=kappa),
        )
    system = figure1.at(lam=lam, tau=tau, ell=kappa, ell_hat=1.0, k_ff=k_ff)
    margins = system.open("S_meas").margins()
    known = {"lam": lam, "tau": tau, "kappa": kappa, "k_ff": k_ff}
    placements: tuple[Placement, ...] = ("measurement", "aligned", "actuator")
    return Summary(
        lam=lam,
        tau=tau,
        period=period,
        kappa=kappa,
        k_ff=k_ff,
        stable=margins.stable,
        unstable_roots=int(margins.unstable_roots),
        gain_margin=_finite(margins.gain if margins.stable else margins.gain_down),
        phase_margin_rad=_finite(margins.phase),
        delay_margin_s=_finite(margins.delay),
        peak_sensitivity=margins.peak_sensitivity,
        limit_continuous=_finite(limits[0]),
        limit_sampled=held[0],
        stable_as_sampled=None if period is None else lam < held[0],
        fastest_continuous=_finite(limits[1]),
        fastest_sampled=held[1],
        roots=tuple((root.real, root.imag) for root in system.poles(4)),
        error_per_speed={
            placement: float(tracking_error(Ramp(1.0), placement, **known))
            if margins.stable and (period is None or lam < held[0])
            else None
            for placement in placements
        },
    )


def _check_sizes(lam: float, kappa: float, tau: float) -> None:
    """Errors: `InputError` for numbers within the range of doubles whose products are not."""
    if not LEAST < lam * kappa < MOST:
        raise InputError(
            f"gain = {lam:g} s⁻¹ and ratio = {kappa:g} are not usable together, their product "
            f"being {lam * kappa:g}; give numbers whose product lies from {LEAST:g} to {MOST:g}."
        )
    if tau and not LEAST < tau < MOST:
        raise InputError(
            f"delay = {tau:g} s is not usable; give 0 s, or from {LEAST:g} to {MOST:g} s."
        )


def _finite(value: Any) -> float | None:
    return float(value) if math.isfinite(value) else None


def _shown(value: float | None, factor: float = 1.0) -> str:
    return "∞" if value is None else f"{value * factor:.4g}".replace("-", "−")


def _root(real: float, imag: float) -> str:
    text = f"{real:.4g}" if imag == 0 else f"{real:.4g}{imag:+.4g}j"
    return text.replace("-", "−")
