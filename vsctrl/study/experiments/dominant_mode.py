"""How fast a small offset dies out in the simulator, against the roots of the sampled loop.

The lag obeys some linear recurrence over the last frames; it is fitted to the run (Prony's method)
without a word about its coefficients, and its dominant root is set against that of
z^{d+1} − z^d + κλTₛ.

Source: R. de Prony, Essai expérimental et analytique, Journal de l'École polytechnique 1 (1795).
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from vsctrl import loop
from vsctrl.arrays import Array
from vsctrl.keywords import keywords
from vsctrl.servo import Scenario
from vsctrl.servo.scenario import GivenScenario, as_scenario
from vsctrl.study.experiments.experiment import Experiment, Measured
from vsctrl.study.modes import (
    characteristic,
    dominant,
    eigen_directions,
    eigenvalues,
    gain_limit,
    scales,
)
from vsctrl.study.runs import latency, released
from vsctrl.symbols import kappa, lam, tau

OFFSET = 1e-5  #: of the nearest depth, and rad
FITTED = 1e-8  #: how well the coefficients of the recurrence are known
SHARES = (0.5, 0.9)  #: of the sampled limit, besides the scenario's own gain and the fastest one
DEADBEAT = 0.05  #: modulus below which nothing is left to measure a rate of


@dataclass(frozen=True, repr=False)
class DecayModes(Experiment):
    """Dominant modes in rad/s, decay rate ± j frequency: W₀(−κλτ)/τ, ln z/Tₛ, and as fitted.

    >>> len(vs.study.decay_modes(vs.paper.sliding(), gains=(2.5,)).rows)
    1
    """

    title: ClassVar[str] = "dominant mode of a small offset, rad/s: −rate + frequency j"
    form: ClassVar[str] = "+.5f"


@keywords
def decay_modes(scenario: GivenScenario, gains: tuple[float, ...] | None = None) -> DecayModes:
    """The dominant mode of a small offset at several gains λ (s⁻¹), in the simulator.

    `gains`: by default the scenario's own if it is stable, the fastest without oscillation (a
    double root), and half and nine tenths of the sampled limit. With a depth error translations
    have κ = ρ and rotations κ = 1, and a row each; with a wrong focal length every real eigenvalue
    of M = L̂⁺L has one, for an offset along its vector. Gains at which the offset is gone within a
    frame or two have no rate, and no row. Agreement is asked with the sampled mode.
    Errors: `InputError` where the latency is no whole number of frames, or a gain not above 0.

    >>> vs.study.decay_modes(vs.paper.sliding(), gains=(2.5,)).agrees
    True
    """
    scenario = as_scenario(scenario)
    period, latency_s = scenario.vision.period, scenario.vision.latency
    latency(scenario)
    if gains is None:
        worst = max(abs(mu) for mu in eigenvalues(scenario))
        limit = gain_limit(scenario)
        fastest = float(loop.fastest_gain(latency_s, period=period, kappa=worst))
        own = (scenario.law.lam,) if scenario.law.lam < limit else ()
        gains = (*own, fastest, *(share * limit for share in SHARES))
    rows = [row for gain in dict.fromkeys(gains) for row in _rows(scenario.with_(lam=gain))]
    return DecayModes(scenario, tuple(rows))


def _rows(scenario: Scenario) -> list[Measured]:
    rows: list[Measured] = []
    for each in eigen_directions(scenario):
        if each.eigenvalue.imag:
            continue  # offsets turn into one another, so that none has a mode of its own
        polynomial = characteristic(scenario, each.eigenvalue.real)
        z = dominant(polynomial)
        if abs(z) < DEADBEAT:
            continue
        lag = _odd_lag(scenario, each.direction)
        root = None if lag is None else dominant(_recurrence(lag, scenario))
        period, (error, double) = scenario.vision.period, _root_error(polynomial, z)
        power = "their square root, at a double root" if double else "divided by the slope there"
        rows.append(
            Measured(
                case=f"λ = {scenario.law.lam:.4g} s⁻¹{f', {each.name}' if each.name else ''}",
                predicted=_continuous(scenario, each.eigenvalue.real),
                exact=cmath.log(z) / period,
                simulated=cmath.log(root) / period if root else None,
                allowed=error / (abs(z) * period),
                reason=f"coefficients fitted to 1e−8, {power}",
                note="the run ended before the fit" if lag is None else "",
            )
        )
    return rows


def _odd_lag(scenario: Scenario, direction: Array) -> Array | None:
    """Lags after two opposite offsets, half their difference: bends of second order cancel."""
    unit, frames = scales(scenario), 8 * (scenario.latency_frames + 1) + 30
    along = OFFSET * direction
    both = [released(scenario, side * along, frames) for side in (1, -1)]
    if not all(run.status.complete for run in both):
        return None
    odd: Array = (both[0].lag - both[1].lag) / (2 * OFFSET * unit)
    return odd


def _recurrence(lag: Array, scenario: Scenario) -> Array:
    """1, −a₀, …, −a_d of the recurrence ξ_{k+1} = Σ aⱼ ξ_{k−j} that fits the lags best."""
    d = scenario.latency_frames
    past = np.stack([lag[d - j : len(lag) - 1 - j].ravel() for j in range(d + 1)], axis=-1)
    fitted = np.linalg.lstsq(past, lag[d + 1 :].ravel(), rcond=None)[0]
    return np.concatenate([[1.0], -fitted])


def _root_error(polynomial: NDArray[np.inexact[Any]], z: complex) -> tuple[float, bool]:
    """How far a root moves if each coefficient does by `FITTED`, and whether as a double root."""
    moved = FITTED * float(np.polyval(np.ones(len(polynomial) - 1), abs(z)))
    slope = float(abs(np.polyval(np.polyder(polynomial), z)))
    bend = float(abs(np.polyval(np.polyder(polynomial, 2), z)))
    first = 2 * moved / slope if slope else math.inf
    second = math.sqrt(4 * moved / bend) if bend else math.inf
    return min(first, second), second < first


def _continuous(scenario: Scenario, ratio: float) -> complex:
    """The dominant pole of figure 1 in continuous time, −κλ without latency."""
    latency_s = scenario.vision.latency
    if not latency_s:
        return complex(-ratio * scenario.law.lam)
    pole = complex(loop.pole().subs({kappa: ratio, lam: scenario.law.lam, tau: latency_s}))
    return complex(pole.real, abs(pole.imag))
