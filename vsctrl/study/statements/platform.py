"""The platform and its settings (section 4), and what follows from all experiments (section 5)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vsctrl import loop, paper
from vsctrl.servo import Scenario
from vsctrl.study.statements.law import NOTHING
from vsctrl.study.statements.oscillation import WAVEFORMS
from vsctrl.study.statements.runs import Bench, size
from vsctrl.study.statements.statement import Statement, Trial, shown

CLOSE = 0.1  #: share of the slide's length within which a camera is still on its trajectory


def platform(bench: Bench) -> tuple[Statement, ...]:
    """The statements about the platform and its settings."""
    return (_latency(), _inaccurate(bench), _gain(bench))


def conclusion(bench: Bench) -> tuple[Statement, ...]:
    """What is said after the experiments."""
    return (_dynamics(bench), _validated(bench), _depth(bench))


def _latency() -> Statement:
    vision = paper.sliding().vision
    tau, period = vision.latency, vision.period
    limits = [float(loop.gain_limit(latency, period=period)) for latency in (tau, 0.0)]
    smooth = float(loop.gain_limit(tau))
    return Statement(
        where="§4",
        says="the application runs at video rate, 40 ms, with “a dataflow latency of 80 ms”",
        claim="largest stable λ",
        unit="s⁻¹",
        cases=(
            Trial("80 ms late, held over 40 ms", limits[0]),
            Trial("no latency, held over 40 ms", limits[1]),
            Trial("80 ms late, continuous time", smooth),
        ),
        sentence="Neither time can be checked, and the law (10) does not know of either. Together "
        f"they leave {limits[0] / limits[1]:.0%} of the gain that the loop could have, and "
        f"continuous-time theory promises {smooth / limits[0] - 1:.0%} more than that.",
        how="closed forms, derived from figure 1 and held to the simulator in vs.validate_all",
    )


def _inaccurate(bench: Bench) -> Statement:
    """Depths are used twice: in L̂, where feedback forgives errors, and in s*(t)."""
    slide = paper.sliding()
    length = 1e3 * slide.speed * slide.motion.duration
    wrong = 0.9
    places = {
        "in L̂": {"depth_ratio": wrong},
        "in s*(t)": {"reference_depth_ratio": wrong},
        "in both": {"depth_ratio": wrong, "reference_depth_ratio": wrong},
    }
    runs = {name: bench(slide.with_(**ratios)) for name, ratios in places.items()}
    lags = {name: 1e3 * float(run.lag_along_motion[-1]) for name, run in runs.items()}
    seen = float(size(runs["in s*(t)"].measured_error)[-1])
    return Statement(
        where="§4",
        says="the depth of the LEDs used in visual servoing “is not accurate”, and yet it works",
        claim=f"|lag| with depths 10 % too small < {CLOSE * length:.0f} mm (10 % of the slide)",
        unit="mm",
        cases=tuple(Trial(name, lag, abs(lag) < CLOSE * length) for name, lag in lags.items()),
        sentence="Feedback forgives wrong depths in L̂. In the reference image (16) nothing does: "
        f"the camera slides at {1e3 * slide.speed / wrong:.1f} mm/s instead of "
        f"{1e3 * slide.speed:.0f} mm/s, with an error of {seen:.1f} px for the law to see and on "
        "the very path of figure 6.",
        how="simulated slide with the derivative term, 80 ms late, lag along the motion at its end",
    )


def _gain(bench: Bench) -> Statement:
    printed, slide = 0.1, paper.sliding(feedforward=False)
    length = 1e3 * slide.speed * slide.motion.duration
    readings = {
        "per second": printed,
        "per 40 ms sample": float(loop.per_sample(printed, period=slide.vision.period)),
    }
    lags = {name: 1e3 * bench.lag(slide.with_(lam=lam)) for name, lam in readings.items()}
    return Statement(
        where="§4.1",
        says="λ = 0.1 on the slide (0.2 on the oscillation), without a unit",
        claim=f"|lag without the term| < 10 % of the {length:.0f} mm slide",
        unit="mm",
        cases=tuple(Trial(n, lag, abs(lag) < CLOSE * length) for n, lag in lags.items()),
        sentence="Figures 5 and 6 show a camera near its trajectory, which only a gain per sample "
        f"gives: λ = {readings['per 40 ms sample']:g} s⁻¹. Per second the camera ends "
        f"{-lags['per second'] / length:.0%} of the slide behind, and falling further.",
        how="simulated slide without the derivative term, 80 ms late, lag at its end",
    )


def _dynamics(bench: Bench) -> Statement:
    """Jumps of the command after the start, as accelerations over one video period."""
    jumps = {}
    for waveform in WAVEFORMS:
        pair = bench.pair(paper.oscillation(waveform))
        for name, run in zip(("with", "without"), pair, strict=True):
            V, half = run.command[:, 0], run.scenario.motion.duration / 2
            jump = np.abs(np.diff(V))[run.t[1:] > half].max()
            jumps[waveform, name] = float(jump / run.scenario.vision.period)
    gentle = jumps["triangle", "without"]
    return Statement(
        where="§4.2, end",
        says="the law cannot be used “in all cases”: the dynamics of the robot must be respected",
        claim="term demands more acceleration than the loop without it",
        unit="m/s²",
        cases=tuple(
            Trial(f"{waveform}, {name} the term", value, _more(value, gentle, waveform, name))
            for (waveform, name), value in jumps.items()
        ),
        sentence="The term passes every jump of the reference's velocity on at once: at the "
        f"triangle's turns {jumps['triangle', 'with'] / gentle:.1f} times what feedback alone "
        "asks. A smooth reference costs nothing: on the sine both ask the same.",
        how="simulated oscillation, largest change of the commanded velocity between two frames "
        "of the second half, over 40 ms",
    )


def _more(value: float, gentle: float, waveform: str, name: str) -> bool | None:
    """Whether the term asks for more; the smooth reference shows when it need not."""
    return value > gentle if (waveform, name) == ("triangle", "with") else None


def _validated(bench: Bench) -> Statement:
    motions: dict[str, Callable[..., Scenario]] = {
        "slide": paper.sliding,
        "oscillation": paper.oscillation,
        "rotation": paper.rotation,
    }
    lags = {name: 1e3 * bench.lag(make()) for name, make in motions.items()}
    aligned = {n: 1e3 * bench.lag(make(placement="aligned")) for n, make in motions.items()}
    worst = max(aligned.values(), key=abs)
    return Statement(
        where="§5",
        says="the first results “validate our approach on elementary trajectories”",
        claim="lag with the term = 0 mm",
        unit="mm",
        cases=(
            *(Trial(f"{name}, as built", lag, abs(lag) < NOTHING) for name, lag in lags.items()),
            Trial("all three, reference aligned", worst, abs(worst) < NOTHING),
        ),
        sentence="Each camera ends ahead of its reference by the way of 80 ms, whatever the gain. "
        "The law is right; it compares an old image with a new reference.",
        how="simulated experiments with the derivative term, lag along the motion at the end; "
        "within 0.05 mm",
    )


def _depth(bench: Bench) -> Statement:
    """What better depths do to |lag|, from either side, with and without latency."""
    slide = paper.sliding()
    lam, tau = slide.law.lam, slide.vision.latency

    def gained(ratio: float, latency: float) -> float:
        wrong, right = (
            abs(bench.lag(slide.with_(depth_ratio=rho, latency=latency))) for rho in (ratio, 1.0)
        )
        return 1e3 * (right - wrong)

    cases = tuple(
        Trial(f"depths {words}, {1e3 * latency:g} ms late", by := gained(ratio, latency), by < 0)
        for latency in (0.0, tau)
        for ratio, words in ((0.9, "10 % too small"), (1.1, "10 % too large"))
    )
    lucky = 1 / (1 + lam * tau)
    lag = 1e3 * bench.lag(slide.with_(depth_ratio=lucky))
    return Statement(
        where="§5, §4",
        says="a better estimation of the depth “should improve the accuracy”",
        claim="change of |lag| as the depths become right < 0",
        unit="mm",
        cases=cases,
        sentence="With the late image two errors can cancel: depths that are "
        f"{1 - lucky:.0%} too small leave a lag of {shown(lag, 'mm')}, and getting them right "
        f"brings back the lead of {1e3 * slide.speed * tau:.1f} mm. Calibrate latency first.",
        how="simulated slide with the derivative term, |lag| at right depths minus that at wrong",
    )
