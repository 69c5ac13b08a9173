"""An explorer of a loop as an element of a page: what is moved, over which ranges."""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Mapping
from typing import Any

import numpy as np
import sympy as sp
from markupsafe import Markup

from vsctrl.diagram import Applied, Block, Diagram, Loop
from vsctrl.diagram.document.units import in_si
from vsctrl.errors import InputError, LimitError
from vsctrl.report.explorer.model import PERIOD, as_json, model
from vsctrl.report.section import Scripted
from vsctrl.symbols import ell, ell_hat

MOST_SLIDERS = 5
SPREAD = 8.0  #: a slider goes from a value divided by this to that times this
SPEED = 0.04  #: m/s, of figure 1's ramp
SECONDS = {"ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}

Spec = dict[str, Any]


def explorer(loop: Loop, anchor: str) -> Scripted | None:
    """The explorer of any loop, None where the script could not compute with it."""
    try:
        data = model(loop)
        if not data["values"]:
            return None
        chosen = chosen_parameters(loop)
        sliders = [_slider(loop, key) for key in chosen]
        if loop.period:
            sliders = [*sliders[: MOST_SLIDERS - 1], _period(loop)]
        return _scripted(loop, anchor, data, sliders, chart=_chart(chosen), ramp=_ramp(loop))
    except (InputError, LimitError):
        return None


def figure_1_explorer(scenario_loop: Any, placement: str, anchor: str) -> Scripted | None:
    """That of figure 1, with its κ, its challenges, and the ramp of 4 cm/s in millimetres."""
    loop = figure_1_loop(scenario_loop, placement)
    try:
        data = model(loop)
    except (InputError, LimitError):
        return None
    data["challenges"] = True
    ranges: list[tuple[str, str, str, float, float, float, bool, str]] = [
        ("lam", "λ", "s⁻¹", 1.0, 0.2, 60.0, True, "gain"),
        ("tau", "τ", "ms", 1e-3, 0.0, 0.4, False, "latency"),
        (PERIOD, "Tₛ", "ms", 1e-3, 0.002, 0.2, True, "period over which a velocity is held"),
        ("k_ff", "k_ff", "", 1.0, 0.0, 1.5, False, "feed-forward"),
        ("kappa", "κ", "", 1.0, 0.5, 2.0, True, "true over modelled image Jacobian"),
    ]
    names = ("key", "name", "unit", "factor", "low", "high", "log", "meaning")
    sliders: list[Spec] = [dict(zip(names, row, strict=True)) for row in ranges]
    for each in sliders:
        value = data["values"][each["key"]]
        each |= {"value": value, "low": min(each["low"], value), "high": max(each["high"], value)}
    ramp = {
        "title": "Ahead (+) or behind (−) on a ramp of 4 cm/s",
        "label": "mm",
        "tracks": True,
        "steady": True,
        "size": 1e3 * SPEED * 0.4,
        "scale": 1e3 * SPEED,
    }
    return _scripted(loop, anchor, data, sliders, chart=["lam", "tau"], ramp=ramp)


def figure_1_loop(scenario_loop: Any, placement: str) -> Loop:
    """Figure 1 with κ = ℓ/ℓ̂ as one parameter, in the numbers of a scenario."""
    from vsctrl.loop.figure1 import diagram

    whole = diagram(placement)
    kappa = sp.Symbol("kappa", positive=True)
    parts = [
        Block(part.name, part.expr.subs({ell: kappa, ell_hat: 1}), part.wiring)
        if isinstance(part, Block)
        else part
        for part in whole.parts
    ]
    scenario = scenario_loop.scenario
    values = {
        "lam": scenario.law.lam,
        "k_ff": scenario.law.k_ff,
        "kappa": float(scenario_loop.directions[0].kappa.real),
        "tau": scenario.vision.latency,
    }
    return Loop(
        Diagram(parts, whole.inputs, whole.outputs),
        values,
        name="figure 1",
        opened="T",
        applied=(Applied("S_ref", "ramp", SPEED),),
        duration=float(np.clip(8 / values["lam"], 1.0, 10.0)),
        period=scenario.vision.period,
        hold="T",
        digital={"feed-forward": "backward"},
    )


def _scripted(
    loop: Loop,
    anchor: str,
    data: Mapping[str, Any],
    sliders: list[Spec],
    chart: list[str] | None,
    ramp: Spec,
) -> Scripted:
    whole = {
        "sliders": sliders,
        "chart": chart,
        "ramp": ramp,
        "range": _band(loop),
        "horizon": float(loop.horizon),
        "time": {"unit": loop.time_unit, "factor": SECONDS[loop.time_unit]},
        "challenges": bool(data.get("challenges")),
        "model": {key: value for key, value in data.items() if key != "challenges"},
    }
    return Scripted(
        Markup(
            '<div class="explorer" data-explorer id="{}" hidden>'
            '<script type="application/json">{}</script></div>\n'
            '<noscript><p class="sub">With script switched on, sliders stand here that move the '
            "numbers of this loop; all that they show at the loop's own numbers is below.</p>"
            "</noscript>"
        ).format(anchor, Markup(as_json(whole)))
    )


def _band(loop: Loop) -> dict[str, float]:
    """The frequencies (rad/s) that are drawn: two decades below the crossings and one above."""
    margins = loop.open.margins()
    at = [w for w, _ in (*margins.gain_crossings, *margins.phase_crossings) if 0 < w < math.inf]
    low, high = (min(at) / 20, max(at[:2]) * 5) if at else (1e-2, 1e2)
    return {"low": 10.0 ** math.floor(math.log10(low)), "high": 10.0 ** math.ceil(math.log10(high))}


def chosen_parameters(loop: Loop) -> list[str]:
    """The parameters most worth moving: a gain and a delay of the loop first, at most five."""
    diagram = loop.diagram
    late = {
        symbol
        for block in diagram.blocks
        for delay in block.rational.delays.values()
        for symbol in delay.free_symbols
    }
    order = [
        symbol for block in diagram.blocks for symbol in sorted(block.expr.free_symbols, key=str)
    ]
    keys = sorted(loop.values, key=lambda key: order.index(diagram.parameters[key]))
    usable = [key for key in keys if loop.values[key]]
    delays = [key for key in usable if diagram.parameters[key] in late]
    delays.sort(key=lambda key: key.endswith("hat"))  # what a model believes comes after what is
    gains = [key for key in usable if key not in delays and _is_gain(loop, key)]
    rest = [key for key in usable if key not in delays and key not in gains[:1]]
    return [*gains[:1], *delays[:1], *[k for k in rest + delays[1:] if k not in delays[:1]]][
        :MOST_SLIDERS
    ]


def letters(name: str) -> str:
    """A parameter's name as it is read: theta_hat is θ_hat, lam is λ."""
    return "_".join(map(_letter, name.split("_")))


def _letter(word: str) -> str:
    name = {"lam": "lamda", "lambda": "lamda"}.get(word.lower(), word.lower())
    size = "CAPITAL" if word[:1].isupper() else "SMALL"
    try:
        return unicodedata.lookup(f"GREEK {size} LETTER {name.upper()}") if name else word
    except KeyError:
        return word


def _is_gain(loop: Loop, key: str) -> bool:
    """Whether L is proportional to a parameter."""
    s = 1j * np.array([0.31, 1.7]) / max(loop.horizon / 20, 1e-12)
    try:
        own, other = loop.open(s), loop.with_(**{key: 1.5 * loop.values[key]}).open(s)
    except (InputError, LimitError):
        return False
    return bool(np.allclose(other, 1.5 * own, rtol=1e-9))


def _slider(loop: Loop, key: str) -> Spec:
    value = float(loop.values[key])
    unit = loop.units.get(key, "")
    scale = in_si(1.0, unit) if unit else 1.0
    return {
        "key": key,
        "name": letters(key),
        "unit": unit,
        "factor": scale,
        "low": value / SPREAD if value > 0 else 3 * value,
        "high": value * SPREAD if value > 0 else 0.0,
        "log": value > 0,
        "value": value,
        "meaning": loop.meanings.get(key, ""),
    }


def _period(loop: Loop) -> Spec:
    value, unit = float(loop.period or 0.0), loop.time_unit
    return {
        "key": PERIOD,
        "name": "period",
        "unit": unit,
        "factor": SECONDS[unit],
        "low": value / SPREAD,
        "high": value * SPREAD,
        "log": True,
        "value": value,
        "meaning": "sampling period",
    }


def _chart(chosen: list[str]) -> list[str] | None:
    """Two parameters for the stability chart, as the sliders are named."""
    return chosen[:2] if len(chosen) > 1 else None


def _ramp(loop: Loop) -> Spec:
    """How the response to a ramp is drawn: as what it misses where the output tracks the input."""
    source = loop.applied[0].input if loop.applied else loop.diagram.inputs[0]
    target = loop.watched[0]
    tracks = bool(np.isclose(abs(loop.system[source, target](1e-9 / loop.horizon)), 1, rtol=1e-6))
    what = f"{target} − {source}" if tracks else target
    return {
        "title": f"Ramp of slope 1 in {source}",
        "label": what,
        "tracks": tracks,
        "steady": False,
        "size": float(loop.horizon),
        "scale": 1.0,
    }
