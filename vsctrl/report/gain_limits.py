"""What limits the gain of a scenario's loop, what sets that limit, and what helps."""

from __future__ import annotations

import math
from dataclasses import replace

from vsctrl.loop.scenario_loop.elements import Elements
from vsctrl.loop.scenario_loop.gain_range import gain_limit
from vsctrl.report.sentences import cure
from vsctrl.report.wording import digits, listed, per_second, seconds
from vsctrl.study.examination.examination import Examination

LITTLE = 1.5  #: factor up to the limit, below which a gain has little margin
SAME = 1.01  #: ratio of two limits that are as good as one
MOST_FEED_FORWARD = 5.0  #: beyond which nothing but the lag of one motion would be cured
FEW = 1.05  #: factor up to the limit, below which it is told in per cent


def little_margin(x: Examination) -> bool:
    """Whether the gain of a stable loop is close to its limit."""
    assert x.loop is not None
    return 1 < x.loop.gain_limit / x.loop.elements.lam < LITTLE


def limits(x: Examination) -> list[str]:
    """How far the gain of a stable loop may be raised, and what sets that limit."""
    assert x.loop is not None
    if not x.loop.is_stable:
        return []
    lam, limit = x.loop.elements.lam, x.loop.gain_limit
    if not math.isfinite(limit):
        return ["No gain makes it shake."]
    if limit <= lam:
        return [f"λ = {lam:g} s⁻¹ is stable, though gains just above {per_second(limit)} are not."]
    factor = limit / lam
    times = f"{digits(factor, 2 if factor < 100 else 3)}-fold"
    if factor < FEW:
        times = f"by {digits(100 * (factor - 1), 2)} % only"
    set_by = listed(causes(x))
    text = (
        f"λ = {lam:g} s⁻¹ may be raised {times}, to {per_second(limit)}, before it shakes: "
        f"{set_by} {'set' if ' and ' in set_by else 'sets'} that limit"
    )
    promised = _continuous_limit(x)
    if promised is not None and promised > SAME * limit:
        too_much = f"{digits(100 * (promised / limit - 1), 2)} % too much"
        text += f"; continuous-time theory, {per_second(promised)}, promises {too_much}"
    return [text + _critical(x) + "."]


def over(x: Examination) -> str:
    """Why a loop is unstable: the gain over its limit, and what sets that limit."""
    assert x.loop is not None
    lam, limit = x.loop.elements.lam, x.loop.gain_limit
    if limit == 0:
        if _wrong_way(x):
            return f"the law pulls the wrong way at every gain λ{_critical(x)}"
        return f"no gain λ is stable with {listed(_late(x.loop.elements))}{_critical(x)}"
    if lam > limit:
        named = listed(causes(x))
        allow = "allow" if " and " in named else "allows"
        most = f"the most that {named} {allow}{_critical(x)}"
        return f"λ = {lam:g} s⁻¹ is above {per_second(limit)}, {most}"
    return f"λ = {lam:g} s⁻¹ lies in a range of gains that is not stable{_critical(x)}"


def advice(x: Examination) -> list[str]:
    """What to do: another gain, another feed-forward, another belief."""
    assert x.loop is not None
    found = x.advice
    if found is None:
        return []
    if not x.loop.is_stable:
        return [_back(x)]
    if x.figure_1 is not None:
        return cure(x.figure_1)
    usable = found.k_ff is not None and abs(found.k_ff) <= MOST_FEED_FORWARD
    if usable and x.last.kind == "steady":
        return [f"k_ff = {digits(found.k_ff or 0.0, 3)} would leave no lag along this motion."]
    return []


def _back(x: Examination) -> str:
    """What makes an unstable loop stable."""
    assert x.loop is not None and x.advice is not None
    fastest = x.advice.fastest
    if fastest is not None:
        lower = "Lower λ" if fastest < x.loop.elements.lam else "Raise λ"
        return (
            f"{lower}: at {per_second(fastest)} errors die out fastest, to 1/e in "
            f"{seconds(x.advice.fastest_constant or 0.0)}."
        )
    if _wrong_way(x):
        return "No gain helps: correct what the law believes of camera, depths and hand."
    e = x.loop.elements
    if e.T_i is not None and gain_limit(replace(e, T_i=None), x.loop.critical.kappa) > 0:
        return "A lower gain does not help: make T_i longer, or leave the integral out."
    return "A lower gain does not help: shorten what is late."


def _wrong_way(x: Examination) -> bool:
    assert x.loop is not None
    return any(each.kappa.real <= 0 for each in x.loop.directions)


def _continuous_limit(x: Examination) -> float | None:
    """The gain limit in continuous time, None where there is none or that loop is unstable."""
    assert x.loop is not None
    if x.loop.critical.kappa.imag:
        return None
    margins = x.loop.open().margins()
    if not margins.stable or not math.isfinite(margins.gain):
        return None
    return float(margins.gain) * x.loop.elements.lam


def _late(e: Elements) -> list[str]:
    """All that is late or slow in a loop, in words."""
    return list(_named(e).values())


def causes(x: Examination) -> list[str]:
    """Of all that is late or slow what does set the limit, and the hold, which always does."""
    assert x.loop is not None
    e, critical = x.loop.elements, x.loop.critical.kappa
    limit = x.loop.gain_limit
    found = [
        words
        for key, words in _named(e).items()
        if not limit <= gain_limit(_without(e, key), critical) < SAME * limit
    ]
    return [*found, f"the twist held over {_ms(e.period)}"]


def _named(e: Elements) -> dict[str, str]:
    """Element → what to call it, of those that are there and late."""
    out = {}
    if e.tau:
        out["tau"] = f"{_ms(e.tau)} of latency"
    if e.tau_hat is not None and abs(e.tau_hat - e.tau - e.dead_time) > 1e-9:
        out["tau_hat"] = f"a predictor that believes in {_ms(e.tau_hat)}"
    if e.dead_time:
        out["dead_time"] = f"{_ms(e.dead_time)} of dead time in the robot"
    if e.time_constant:
        out["time_constant"] = f"axes with {_ms(e.time_constant)}"
    if e.T_i is not None:
        out["T_i"] = f"the integral with T_i = {digits(e.T_i, 4)} s"
    return out


def _without(e: Elements, key: str) -> Elements:
    """The elements without one of them; what a predictor knows of it goes with it."""
    if key == "T_i":
        return replace(e, T_i=None)
    if key == "tau_hat":
        return replace(e, tau_hat=e.tau + (e.dead_time if e.smith else 0.0))
    if key == "time_constant":
        return replace(e, time_constant=0.0)
    known = e.tau_hat
    if known is not None and (key == "tau" or e.smith):
        known = max(0.0, known - getattr(e, key))
    if key == "tau":
        return replace(e, tau=0.0, tau_hat=known)
    return replace(e, dead_time=0.0, tau_hat=known)


def _ms(time: float) -> str:
    if time >= 1.0:
        return f"{digits(time, 5)} s"
    return f"{digits(1e3 * time, 5)} ms"


def _critical(x: Examination) -> str:
    """Which direction that is of, where they differ."""
    assert x.loop is not None
    if len(x.loop.directions) < 2:
        return ""
    first = x.loop.critical
    kappa = digits(first.kappa.real, 3)
    if first.kappa.imag:
        kappa += f" ± {digits(abs(first.kappa.imag), 3)}j"
    name = "" if first.name.startswith("κ") else f"{first.name}, "
    return f" (in the direction that shakes first: {name}κ = {kappa})"
