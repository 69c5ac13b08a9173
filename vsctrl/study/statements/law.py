"""Section 2 of the paper: what the control law (10) and figure 1 are said to do.

Tried on the slide, whose lateral motion at constant depth the monovariable loop describes exactly.
"""

from __future__ import annotations

import math
from typing import Any

from vsctrl import loop, paper
from vsctrl.servo import Scenario
from vsctrl.study.statements.runs import Bench
from vsctrl.study.statements.statement import Statement, Trial, shown

NOTHING = 0.05  #: mm: what counts as no error, the repeatability of a good robot
NEAR = 0.1  #: share within which a rate or an exponent counts as the one that is claimed
Tried = tuple[str, dict[str, Any]]  #: a condition, and what it changes of the slide
LATENCIES: tuple[Tried, ...] = (("no latency", {"latency": 0.0}), ("80 ms late", {}))
ALIGNED: Tried = ("80 ms late, reference aligned", {"placement": "aligned"})


def law(bench: Bench) -> tuple[Statement, ...]:
    """The statements of section 2."""
    slide = paper.sliding()
    return (_decay(bench, slide), _zero(bench, slide), _one_over(bench, slide), _share(bench))


def _decay(bench: Bench, slide: Scenario) -> Statement:
    """Let go 1 cm beside a resting reference: how fast is what remains going away?"""
    lam, tau, period = slide.law.lam, slide.vision.latency, slide.vision.period
    first, second = 40, 60  # the other modes of the delayed loop are gone by then
    beside = (0.01, 0.0, 0.0, 0.0, 0.0, 0.0)
    still = slide.with_(kind="hold", duration=(second + 1) * period, offset=beside)

    def rate(**changes: Any) -> float:
        x = bench(still.with_(**changes)).lag[:, 0]
        return float(math.log(x[first] / x[second]) / ((second - first) * period))

    cases = tuple(
        Trial(name, found := rate(**changes), abs(found / lam - 1) < NEAR)
        for name, changes in LATENCIES
    )
    fastest = float(loop.fastest_gain(tau, period=period))
    return Statement(
        where="§2, (6)",
        says="the law gives every component of the error “an exponential decay” at the rate λ",
        claim=f"rate = λ = {lam:g} s⁻¹",
        unit="s⁻¹",
        cases=cases,
        sentence=f"Without latency it does, but for the hold over {1e3 * period:g} ms. The late "
        f"image makes the decay {cases[1].value / lam:.2f} times as fast at this gain; above "
        f"λ = {fastest:.2f} s⁻¹ it is no longer a decay but an oscillation.",
        how="simulated from 1 cm beside a resting reference, frames 40 to 60; within 10 %",
    )


def _zero(bench: Bench, slide: Scenario) -> Statement:
    cases = tuple(
        Trial(name, found := 1e3 * bench.lag(slide.with_(**changes)), abs(found) < NOTHING)
        for name, changes in (*LATENCIES, ALIGNED)
    )
    run = bench(slide)
    true, seen = (float((e[-1] @ e[-1]) ** 0.5) for e in (run.error, run.measured_error))
    null = float(loop.nulling_feedforward(lam=slide.law.lam, tau=slide.vision.latency, kappa=1))
    return Statement(
        where="§2, figure 1",
        says="with the derivative term s = s*(t) “without any tracking error”",
        claim="lag = 0 mm",
        unit="mm",
        cases=cases,
        sentence="Figure 1 has no latency. With the platform's own the camera runs ahead by v τ, "
        f"and no measured plot shows it: the law sees {seen:.1f} px where the truth is "
        f"{true:.1f} px. Delaying the reference like the image removes it; so does "
        f"k_ff = {null:.3g}.",
        how="simulated slide, lag along the motion at its end; within 0.05 mm",
    )


def _one_over(bench: Bench, slide: Scenario) -> Statement:
    """The exponent of the lag as a power of λ, from the paper's gain and twice of it."""
    lam, tau = slide.law.lam, slide.vision.latency
    limit = float(loop.gain_limit(tau, period=slide.vision.period))

    def exponent(**changes: Any) -> float:
        lags = [bench.lag(slide.with_(k_ff=0.0, lam=g, **changes)) for g in (lam, 2 * lam)]
        return math.log2(lags[1] / lags[0])

    cases = tuple(
        Trial(name, found := exponent(**changes), abs(found + 1) < NEAR)
        for name, changes in (*LATENCIES, ALIGNED)
    )
    return Statement(
        where="§2, figure 1",
        says="without the derivative term the tracking error is “proportional to 1/λ”",
        claim="exponent of λ = −1",
        cases=cases,
        sentence="With the late image the lag is v (τ − 1/λ): no power of λ, nothing at "
        f"λ = 1/τ = {1 / tau:.4g} s⁻¹, and beyond it a lead. Whoever turns the gain up until the "
        f"camera is on its reference ends there, at {1 / tau / limit:.0%} of the largest stable "
        "gain.",
        how=f"simulated slide at λ = {lam:g} and {2 * lam:g} s⁻¹, logarithm of the ratio of lags; "
        "within 10 %",
    )


def _share(bench: Bench) -> Statement:
    harmful = float(loop.harmful_feedforward_gain(tau=0.08, kappa=1, k_ff=1))

    def removed(**changes: Any) -> float:
        on, off = (bench.lag(paper.sliding(feedforward=f, **changes)) for f in (True, False))
        return 100 * (1 - abs(on / off))

    tried: tuple[Tried, ...] = (
        ("λ = 2.5 s⁻¹, no latency", {"latency": 0.0}),
        ("λ = 2.5 s⁻¹, 80 ms late", {}),
        ("λ = 5 s⁻¹, 80 ms late", {"lam": 5.0}),
        ("λ = 10 s⁻¹, 80 ms late", {"lam": 10.0}),
    )
    cases = tuple(Trial(n, share := removed(**changes), share > 50) for n, changes in tried)
    return Statement(
        where="§2, (10)",
        says="the derivative term compensates the tracking error “with a large efficiency”",
        claim="more than half of the true error removed",
        unit="%",
        cases=cases,
        sentence=f"With the late image it removes ever less as the gain grows, and above "
        f"λ = (2 − κ)/(2κτ) = {harmful:.2f} s⁻¹ it makes the true error larger: at 10 s⁻¹ "
        f"{shown(1 - cases[-1].value / 100)} times as large.",
        how="simulated slide, 1 − |lag with|/|lag without| at its end",
    )
