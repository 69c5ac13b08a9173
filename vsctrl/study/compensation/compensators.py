"""The remedies for dead time: what each changes in the law, in the loop and in the simulator.

A remedy is one diagram of `loop` with numbers, and the fields of a scenario that make six degrees
of freedom do the same. What comes out of either is left to `comparison`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

from vsctrl import loop, timing
from vsctrl.diagram import Diagram, Ramp, Signal
from vsctrl.diagram.system import System
from vsctrl.errors import LimitError
from vsctrl.servo import Scenario
from vsctrl.study.compensation import sampled_limits
from vsctrl.study.modes import sideways_ratio
from vsctrl.symbols import v

if TYPE_CHECKING:
    from vsctrl.symbols import Expr

Kind = Literal[
    "none", "aligned", "nulling feed-forward", "preview", "early feed-forward", "PI", "Smith"
]

DAMPED = 4.0  #: Tᵢ = 4/(κλ): a double root of the loop without latency, s² + κλs + κλ/Tᵢ
LATE = 4.0  #: … but not below this many latencies, as no gain is stable for Tᵢ ≤ τ


@dataclass(frozen=True, kw_only=True, eq=False)
class Remedy:
    """One remedy for a scenario's latency τ.

    `diagram` with `values` (by its parameters' keywords) is its loop, `fields` of a scenario its
    experiment. `seen` are the two signals whose difference the law takes for the error, the image
    first; `mismatch` is how wrong it takes the latency, τ̂ − τ in s; `cost` what it needs.
    """

    kind: Kind
    name: str
    diagram: Diagram
    values: dict[str, float]
    fields: dict[str, Any]
    seen: tuple[str, str]
    cost: str
    mismatch: float = 0.0
    limits: Limits = field(repr=False)

    @property
    def formula(self) -> Expr:
        """The steady true error on a ramp of slope v, what is 0 or 1 put in."""
        return self._error(Ramp(v), False, self._simple)

    @property
    def seen_formula(self) -> Expr:
        """The steady error that the law sees on a ramp of slope v."""
        return self._error(Ramp(v), True, self._simple)

    def steady(self, slope: float, *, seen: bool = False) -> float:
        """Either of them with all numbers put in, for a slope in m/s."""
        known = {name: a for name, a in self.values.items() if name not in ("ell", "ell_hat")}
        return float(self._error(Ramp(slope), seen, {**known, "kappa": self.values["ell"]}))

    @property
    def system(self) -> System:
        """The loop in continuous time."""
        return self.diagram.at({n: self.values[n] for n in self.diagram.parameters})

    @property
    def _simple(self) -> dict[str, Any]:
        """The parameters that are 0 or 1, as whole numbers."""
        gain, ratio = self.values["k_ff"], self.values["ell"]
        known = {"k_ff": int(gain)} if gain in (0.0, 1.0) else {}
        return known | ({"kappa": 1} if ratio == 1 else {})

    def _error(self, ramp: Signal, seen: bool, known: dict[str, Any]) -> Expr:
        output, reference = self.seen if seen else (None, None)
        return loop.steady_error(self.diagram, ramp, output=output, reference=reference, **known)


@dataclass(frozen=True)
class Limits:
    """The gain limits of a remedy for any κ, s⁻¹; the continuous one None where it has none."""

    continuous: Callable[[complex], float | None]
    sampled: Callable[[complex], sampled_limits.GainPencil]


def remedies(
    scenario: Scenario, mismatches: Iterable[float], T_i: float | None
) -> Iterator[Remedy | str]:
    """Every remedy for an ideal scenario with its latency in the measurement.

    `mismatches` are τ̂ − τ in s. A remedy that cannot be had is a sentence instead.
    """
    law, period = scenario.law, scenario.vision.period
    # As the simulator has it, so that a latency of whole frames is that in every formula.
    tau = timing.settled(scenario.vision.latency, period)
    ratio = sideways_ratio(scenario)
    values = {"lam": law.lam, "k_ff": law.k_ff, "tau": tau, "ell": ratio, "ell_hat": 1.0}
    fields = {"k_ff": law.k_ff, "placement": "measurement"}
    same = Limits(partial(_plain_limit, tau), partial(sampled_limits.plain, tau, period))
    image, aligned = ("S_meas", "S_ref"), ("S_meas", "S_ref_late")
    yield Remedy(
        kind="none", name="no remedy", diagram=loop.diagram(), values=values, fields=fields,
        seen=image, cost="nothing", limits=same,
    )  # fmt: skip
    yield Remedy(
        kind="aligned", name="aligned", diagram=loop.diagram("aligned"), values=values,
        fields={**fields, "placement": "aligned"}, seen=aligned,
        cost="the reference of τ ago, so the latency must be known", limits=same,
    )  # fmt: skip
    if law.k_ff:
        nulling = float(loop.nulling_feedforward(lam=law.lam, tau=tau, kappa=ratio))
        yield Remedy(
            kind="nulling feed-forward", name=signed(f"nulling feed-forward, k_ff = {nulling:.4g}"),
            diagram=loop.diagram(),
            values={**values, "k_ff": nulling}, fields={**fields, "k_ff": nulling}, seen=image,
            cost="nothing, but it is right at one λ, κ and τ, and on ramps", limits=same,
        )  # fmt: skip
    yield from _previews(values, fields, mismatches, same)
    yield Remedy(
        kind="early feed-forward", name="late in the actuator instead, feed-forward τ early",
        diagram=loop.previewed_feedforward(), values={**values, "h": tau},
        fields={**fields, "placement": "actuator", "preview_ff": tau}, seen=("S_meas", "S_star"),
        cost="the reference known τ ahead", limits=same,
    )  # fmt: skip
    yield from _integrals(values, fields, T_i, period)
    yield from _smiths(values, fields, mismatches, period)


def integral_time(lam: float, ratio: float, tau: float) -> float:
    """Tᵢ = 4/(κλ), but at least 4τ, in s: critically damped without latency, and stable with it."""
    return max(DAMPED / (ratio * lam), LATE * tau)


def _best_preview(lam: float, k_ff: float, tau: float, ratio: float) -> float:
    """The preview that leaves no error on a ramp, in s; negative where the reference is to wait."""
    return float(loop.nulling_preview(lam=lam, k_ff=k_ff, tau=tau, kappa=ratio))


def _previews(
    values: dict[str, float], fields: dict[str, Any], mismatches: Iterable[float], same: Limits
) -> Iterator[Remedy | str]:
    """The whole reference early by the best h, without feed-forward where that leads already."""
    lam, k_ff, tau, ratio = (values[name] for name in ("lam", "k_ff", "tau", "ell"))
    best, instead = _best_preview(lam, k_ff, tau, ratio), ""
    if best < 0 and k_ff:
        best, k_ff, instead = _best_preview(lam, 0.0, tau, ratio), 0.0, " instead of feed-forward"
    if best < 0:
        yield (
            f"preview is left out: at κλτ = {ratio * lam * tau:.3g} the camera leads even without "
            "feed-forward, so there is no lag to buy back."
        )
        return
    for wrong in (0.0, *mismatches):
        early_by = best - wrong  # 1/κλ is known, τ is believed
        if early_by < 0:
            words = f"preview for τ̂ = {1e3 * (tau + wrong):g} ms is left out: h would be negative."
            yield signed(words)
            continue
        believed = f", for τ̂ = {1e3 * (tau + wrong):g} ms" if wrong else ""
        yield Remedy(
            kind="preview", name=f"preview h = {1e3 * early_by:.4g} ms{instead}{believed}",
            diagram=loop.preview(), values={**values, "k_ff": k_ff, "h": early_by},
            fields={**fields, "k_ff": k_ff, "preview": early_by}, seen=("S_meas", "S_ref"),
            cost="the reference known h ahead, and κλ", mismatch=wrong, limits=same,
        )  # fmt: skip


def _integrals(
    values: dict[str, float], fields: dict[str, Any], T_i: float | None, period: float
) -> Iterator[Remedy]:
    tau = values["tau"]
    time = integral_time(values["lam"], values["ell"], tau) if T_i is None else T_i
    limits = Limits(
        partial(_integral_limit, tau, time), partial(sampled_limits.integral, tau, period, time)
    )
    places: tuple[tuple[loop.Placement, str, str, str], ...] = (
        ("measurement", "", "S_ref", "the law is satisfied, and wrong by vτ"),
        ("aligned", ", aligned", "S_ref_late", "the latency must be known"),
    )
    for placement, where, reference, cost in places:
        yield Remedy(
            kind="PI", name=f"PI{where}, Tᵢ = {time:.4g} s", diagram=loop.pi(placement),
            values={**values, "T_i": time}, fields={**fields, "placement": placement, "T_i": time},
            seen=("S_meas", reference), cost=f"gain limit and overshoot; {cost}", limits=limits,
        )  # fmt: skip


def _smiths(
    values: dict[str, float], fields: dict[str, Any], mismatches: Iterable[float], period: float
) -> Iterator[Remedy | str]:
    tau = values["tau"]
    for wrong in (0.0, *mismatches):
        believed = round(tau + wrong, 12)
        if believed <= 0:
            yield signed(
                f"Smith with τ̂ = {1e3 * believed:g} ms is left out: it is no predictor; give a "
                "smaller mismatch."
            )
            continue
        sign = signed(f", {1e3 * wrong:+g} ms wrong") if wrong else ""
        yield Remedy(
            kind="Smith", name=f"Smith, τ̂ = {1e3 * believed:g} ms{sign}", diagram=loop.smith(),
            values={**values, "tau_hat": believed},
            fields={**fields, "predictor": "smith", "tau_hat": believed}, seen=("S_pred", "S_ref"),
            cost="a model of latency and image", mismatch=wrong,
            limits=Limits(
                partial(_smith_limit, tau, believed),
                partial(sampled_limits.predicted, tau, period, believed),
            ),
        )  # fmt: skip


# Functions of their own with numbers put in, since closures could not be sent to another process.
def _plain_limit(tau: float, mu: complex) -> float:
    return float(loop.gain_limit(tau, kappa=mu))


def _integral_limit(tau: float, T_i: float, mu: complex) -> float | None:
    return None if mu.imag else loop.pi_gain_limit(tau, T_i, mu.real)


def _smith_limit(tau: float, believed: float, mu: complex) -> float | None:
    try:
        return None if mu.imag else loop.smith_gain_limit(tau, believed, mu.real)
    except LimitError:  # too slight a mismatch to be followed to its limit
        return None


def signed(text: str) -> str:
    """With minus signs for the hyphens before numbers."""
    return text.replace(" -", " −")
