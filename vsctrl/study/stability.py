"""How close a scenario's loop is to its limits: margins, gain limits, and what Padé makes of them.

The exact-delay engine gives the margins; python-control gives them again from a Padé model, as a
second opinion, and the Bode, Nyquist and root-locus data of those models. SymPy's closed forms give
the gain limits. What they look like is left to `report`.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from vsctrl import loop, timing
from vsctrl.diagram import Ramp, Step
from vsctrl.servo import Scenario
from vsctrl.study.modes import critical_eigenvalue, gain_limit
from vsctrl.study.tracking.cases import ratio_along_motion
from vsctrl.tables import finite

if TYPE_CHECKING:
    from vsctrl.diagram.channel import OpenLoop
    from vsctrl.diagram.frequency.margins import Margins
    from vsctrl.diagram.system import System


PADE_ORDERS = (1, 2, 4)  #: shown against the exact delay
SECOND_OPINION = 8  #: Padé order of the model whose margins python-control computes


@dataclass(frozen=True)
class Limits:
    """Gain limits in s⁻¹: λ_max stable and λ fastest without oscillation; inf without latency.

    Continuous time, and with the twist held over one video period.
    """

    continuous: float
    sampled: float
    fastest_continuous: float
    fastest_sampled: float


@dataclass(frozen=True)
class Reading:
    """What one reading of a gain means: λ in s⁻¹, margins, and the lag it leaves."""

    label: str
    lam: float
    per_sample: float
    margins: Margins
    share_of_continuous: float  #: λ/λ_max, 1 = at the limit
    share_of_sampled: float
    lag: float | None  #: steady lag without feed-forward, m; None where there is none
    settling: float  #: 3/(κλ), s

    def data(self) -> dict[str, Any]:
        """The reading as JSON takes it; names end in their units where these are not s⁻¹."""
        return {
            "label": self.label,
            "lam": self.lam,
            "per_sample": self.per_sample,
            "gain_margin": finite(self.margins.gain),
            "phase_margin_rad": finite(self.margins.phase),
            "share_of_continuous": self.share_of_continuous,
            "share_of_sampled": self.share_of_sampled,
            "lag_without_feedforward_m": self.lag,
            "settling_s": self.settling,
        }


@dataclass(frozen=True)
class PadeRow:
    """What a Padé model of one order gets wrong on this loop."""

    order: int
    gain_limit: float  #: s⁻¹, from python-control's gain margin
    gain_limit_error: float  #: relative to the exact one
    step_error: float  #: largest error of the closed loop's step response, relative to the step


@dataclass(frozen=True)
class SecondOpinion:
    """python-control's own margins of the Padé model of this order."""

    order: int
    gain: float
    phase: float  #: rad
    delay: float  #: s


@dataclass(frozen=True)
class Stability:
    """The stability of a scenario's loop, with the systems that its plots are drawn from.

    Margins, limits and poles are those of the direction that is unstable first, whose κ is `ratio`:
    a wrong depth acts on translations alone, and a wrong focal length on both. Time responses and
    errors are those along the motion, by `motion` with κ = `ratio_along_motion`.

    >>> found = vs.study.examine(vs.paper.sliding())
    >>> found.stability.margins.stable
    True
    """

    scenario: Scenario
    ratio: float
    ratio_along_motion: float
    system: System
    motion: System
    opened: OpenLoop
    margins: Margins
    second_opinion: SecondOpinion
    limits: Limits
    readings: tuple[Reading, ...]
    pade: tuple[PadeRow, ...]
    nulling_feedforward: float  #: k_ff that leaves no error on the ramp

    @property
    def sampled_in_closed_form(self) -> bool:
        """Whether the sampled limits are closed forms: those of whole numbers of periods are."""
        vision = self.scenario.vision
        return timing.whole_periods(vision.latency, vision.period) is not None

    @property
    def is_stable(self) -> bool:
        """Whether the loop is stable both in continuous time and as sampled."""
        return self.margins.stable and self.scenario.law.lam < self.limits.sampled

    @property
    def stable_gain(self) -> System:
        """The system itself, or at half the gain limit where it is unstable, for its responses."""
        if self.margins.stable:
            return self.motion
        return self.motion.with_(lam=self.limits.continuous / 2)

    def data(self) -> dict[str, Any]:
        """Margins, limits and readings as JSON takes them, gains in s⁻¹; null = no limit."""
        lam = self.scenario.law.lam
        limits = {name: finite(limit) for name, limit in vars(self.limits).items()}
        return {
            "margins": _margins(self.margins, self.second_opinion),
            "limits": {"lam": lam, "stable_as_sampled": lam < self.limits.sampled, **limits},
            "readings": [reading.data() for reading in self.readings],
            "pade": [asdict(row) for row in self.pade],
        }


def _margins(exact: Margins, second: SecondOpinion) -> dict[str, Any]:
    return {
        "stable": exact.stable,
        "unstable_roots": int(exact.unstable_roots),
        "gain": finite(exact.gain),
        "phase_rad": finite(exact.phase),
        "delay_s": finite(exact.delay),
        "peak_sensitivity": exact.peak_sensitivity,
        "python_control_pade_order": second.order,
        "python_control_gain": finite(second.gain),
        "python_control_phase_rad": finite(second.phase),
        "python_control_delay_s": finite(second.delay),
    }


def stability(scenario: Scenario) -> Stability:
    """Margins and limits of figure 1 with a scenario's gain, latency and depth ratio."""
    law, period, tau = scenario.law, scenario.vision.period, scenario.vision.latency
    kappa, along = abs(critical_eigenvalue(scenario)), ratio_along_motion(scenario)
    system, motion = (
        loop.diagram(law.placement).at(lam=law.lam, k_ff=law.k_ff, ell=ratio, ell_hat=1.0, tau=tau)
        for ratio in (kappa, along)
    )
    opened = system.open("S_meas")
    limits = Limits(
        gain_limit(scenario, sampled=False),
        gain_limit(scenario),
        float(loop.fastest_gain(tau, kappa=kappa)),
        float(loop.fastest_gain(tau, period=period, kappa=kappa)),
    )
    return Stability(
        scenario=scenario,
        ratio=kappa,
        ratio_along_motion=along,
        system=system,
        motion=motion,
        opened=opened,
        margins=opened.margins(),
        second_opinion=_second_opinion(opened),
        limits=limits,
        readings=_readings(scenario, system, limits),
        pade=_pade_rows(system, limits) if tau else (),
        nulling_feedforward=float(
            loop.nulling_feedforward(law.placement, lam=law.lam, tau=tau, kappa=along)
        ),
    )


def _second_opinion(opened: OpenLoop) -> SecondOpinion:
    import control

    model = opened.pade(SECOND_OPINION)
    gain, phase, _, _, crossing, _ = control.stability_margins(model)
    delay = math.radians(phase) / crossing if np.isfinite(phase) and crossing else math.inf
    return SecondOpinion(SECOND_OPINION, float(gain), math.radians(float(phase)), float(delay))


def _readings(scenario: Scenario, system: System, limits: Limits) -> tuple[Reading, ...]:
    """The scenario's gain, the paper's two per sample, and the same number read per second."""
    period, own = scenario.vision.period, scenario.law.lam
    number = own * period
    gains = {
        f"{number:.3g} per sample (this scenario)": own,
        "0.1 per sample": loop.per_sample(0.1, period),
        "0.2 per sample": loop.per_sample(0.2, period),
        f"{number:.3g} per second instead": number,
    }
    out: list[Reading] = []
    for label, lam in gains.items():
        if not any(math.isclose(lam, reading.lam, rel_tol=1e-9) for reading in out):
            out.append(_reading(label, lam, scenario, system, limits))
    return tuple(out)


def _reading(label: str, lam: float, scenario: Scenario, system: System, limits: Limits) -> Reading:
    margins = system.with_(lam=lam).open("S_meas").margins()
    kappa, speed = ratio_along_motion(scenario), scenario.speed
    error: Any = loop.tracking_error(
        Ramp(speed),
        scenario.law.placement,
        kappa=kappa,
        lam=lam,
        tau=scenario.vision.latency,
        k_ff=0,
    )
    stable = margins.stable and lam < limits.sampled
    return Reading(
        label=label,
        lam=lam,
        per_sample=lam * scenario.vision.period,
        margins=margins,
        share_of_continuous=lam / limits.continuous,
        share_of_sampled=lam / limits.sampled,
        lag=float(error) if stable else None,
        settling=3 / (kappa * lam),
    )


def _pade_rows(system: System, limits: Limits) -> tuple[PadeRow, ...]:
    import control

    # Step responses are compared where every order is stable, at the scenario's gain if it is low.
    calm = system.with_(k_ff=0.0, lam=min(system.values["lam"], 0.5 * limits.continuous))
    t = np.linspace(0.0, 20 * system.values["tau"], 801)
    exact = calm["S_ref", "S"].response(Step(), t).y.ravel()
    rows = []
    for order in PADE_ORDERS:
        gain = float(control.stability_margins(system.open("S_meas").pade(order))[0])
        limit = gain * system.values["lam"]
        step = control.step_response(calm["S_ref", "S"].pade(order), t).y.ravel()
        rows.append(
            PadeRow(order, limit, limit / limits.continuous - 1, float(np.abs(step - exact).max()))
        )
    return tuple(rows)
