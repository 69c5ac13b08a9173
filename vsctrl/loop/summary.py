"""A loop at a glance: what the command line prints of figure 1 for one gain and one delay."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

from vsctrl import checks as check
from vsctrl.diagram import Ramp
from vsctrl.errors import InputError
from vsctrl.loop.figure1 import Placement, figure1
from vsctrl.loop.limits import fastest_gain, gain_limit
from vsctrl.loop.tracking import tracking_error
from vsctrl.tables import Printed, finite, text

LEAST, MOST = 1e-30, 1e30  #: of a product that can still be multiplied and divided


@dataclass(frozen=True, repr=False)
class Summary(Printed):
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

    def data(self) -> dict[str, Any]:
        """The same as JSON takes it; every name with a unit of its own ends in it."""
        return asdict(self)

    def __str__(self) -> str:
        verdict = "stable" if self.stable else f"UNSTABLE, {self.unstable_roots} roots on the right"
        if self.stable_as_sampled is not None:
            sampled = "stable" if self.stable_as_sampled else "UNSTABLE"
            verdict += f"; sampled: {sampled}"
        head = f"λ = {self.lam:g} s⁻¹, τ = {self.tau:g} s, κ = {self.kappa:g}, k_ff = {self.k_ff:g}"
        rows = {
            "continuous loop": verdict,
            "gain margin": _shown(self.gain_margin),
            "phase margin": f"{_shown(self.phase_margin_rad, math.degrees(1))}°",
            "delay margin": f"{_shown(self.delay_margin_s, 1e3)} ms",
            "sensitivity peak Ms": f"{self.peak_sensitivity:.4f}",
            "stable up to": self._gains(self.limit_continuous, self.limit_sampled),
            "fastest, no oscillation": self._gains(self.fastest_continuous, self.fastest_sampled),
            "rightmost roots, rad/s": ", ".join(_root(*root) for root in self.roots),
        }
        for placement, error in self.error_per_speed.items():
            value = "–" if error is None else f"{1e3 * error:+.4g} mm at 1 m/s".replace("-", "−")
            rows[f"ramp error, {placement}"] = value
        return f"{head}\n{text(rows.items(), '{:28}{}')}"

    def _gains(self, continuous: float | None, sampled: float | None) -> str:
        limit = f"{_shown(continuous)} s⁻¹"
        if self.period is None:
            return limit
        return f"{limit}, held over {1e3 * self.period:g} ms {_shown(sampled)}"


def summarise(
    lam: float, tau: float, *, period: float | None = None, kappa: float = 1.0, k_ff: float = 1.0
) -> Summary:
    """Margins, limits, roots and tracking errors of figure 1.

    `lam` in s⁻¹, `tau` and `period` in s. Errors: `InputError` for a gain, κ or period that is not
    above 0, a negative delay, or numbers whose product is too large or too small to compute with;
    `LimitError` for roots that are too many to count.
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
        gain_margin=finite(margins.gain if margins.stable else margins.gain_down),
        phase_margin_rad=finite(margins.phase),
        delay_margin_s=finite(margins.delay),
        peak_sensitivity=margins.peak_sensitivity,
        limit_continuous=finite(float(limits[0])),
        limit_sampled=held[0],
        stable_as_sampled=None if period is None else lam < held[0],
        fastest_continuous=finite(float(limits[1])),
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


def _shown(value: float | None, factor: float = 1.0) -> str:
    return "∞" if value is None else f"{value * factor:.4g}".replace("-", "−")


def _root(real: float, imag: float) -> str:
    text = f"{real:.4g}" if imag == 0 else f"{real:.4g}{imag:+.4g}j"
    return text.replace("-", "−")
