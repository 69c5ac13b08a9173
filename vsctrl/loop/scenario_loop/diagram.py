"""The diagram of a scenario's elements: figure 1, and what this loop has besides.

All signals are those of figure 1, in units of the image; ℓ/ℓ̂ is the κ of a direction.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import sympy as sp

from vsctrl.diagram import Block, Diagram, Sum
from vsctrl.loop.figure1 import diagram as figure1
from vsctrl.loop.scenario_loop.elements import Elements, Filter
from vsctrl.loop.scenario_loop.kalman import steady_filter
from vsctrl.symbols import T_a, T_i, ell, ell_hat, h, k_ff, lam, s, tau, tau_hat, theta

if TYPE_CHECKING:
    from vsctrl.diagram.system import System

Part = Block | Sum


def scenario_diagram(elements: Elements) -> Diagram:
    """The diagram, with a block for each element that there is.

    Input S_ref, the reference, early by the preview; output S, the image; S_star is the reference
    of now. Parameters: lam, k_ff, ell, ell_hat, and of what there is tau, theta, T_a, T_i, tau_hat,
    h and h_ff (s). A Kalman filter stands with its numbers, at its steady gain.
    """
    if elements == _plain(elements):
        return figure1(elements.placement)
    parts = [*_comparison(elements), *_law(elements), *_robot(elements), *_vision(elements)]
    early = elements.preview or elements.preview_ff
    return Diagram(parts, inputs=["S_ref"], outputs=["S", "S_star"] if early else ["S"])


def scenario_system(elements: Elements, kappa: float) -> System:
    """The diagram with its numbers, for one κ."""
    drawn = scenario_diagram(elements)
    numbers: dict[str, Any] = {
        "lam": elements.lam,
        "k_ff": elements.k_ff,
        "ell": kappa,
        "ell_hat": 1.0,
        "tau": elements.tau,
        "theta": elements.dead_time,
        "T_a": elements.time_constant,
        "T_i": elements.T_i,
        "tau_hat": elements.tau_hat,
        "h": elements.preview,
        "h_ff": elements.preview_ff,
    }
    return drawn.at({name: numbers[name] for name in drawn.parameters})


def digital_blocks(elements: Elements) -> dict[str, str]:
    """The blocks that run in the computer, and their method, for `System.sampled`."""
    blocks = {"feed-forward": "backward"}
    if elements.T_i is not None:
        blocks["gain"] = "backward"
    if elements.filter is not None:
        blocks |= {"filter": "tustin", "drift": "tustin"}
    return blocks


def _plain(elements: Elements) -> Elements:
    """The elements of figure 1 among them."""
    return Elements(elements.lam, elements.k_ff, elements.tau, elements.placement, elements.period)


H_FF = sp.Symbol("h_ff", positive=True)  #: how early the derivative is used beyond the rest, s


def _comparison(elements: Elements) -> list[Part]:
    """From S_ref to the error e."""
    parts: list[Part] = []
    signal = "S_ref"
    if elements.preview_ff:
        parts.append(Block("derivative alone early", sp.exp(-H_FF * s), f"{signal} -> S_cmp"))
        signal = "S_cmp"
    if elements.preview or elements.preview_ff:
        factor = sp.exp(-h * s) if elements.preview else sp.Integer(1)
        parts.append(Block("now", factor, f"{signal} -> S_star"))
    if elements.placement == "aligned":
        parts.append(Block("alignment", sp.exp(-tau * s), f"{signal} -> S_ref_late"))
        signal = "S_ref_late"
    seen = "S_meas" if elements.tau_hat is None else "S_pred"
    return [Sum(f"e = {signal} - {seen}"), *parts]


def _law(elements: Elements) -> list[Part]:
    """From the error to the command T, with what predicts."""
    gain = lam if elements.T_i is None else lam * (1 + 1 / (T_i * s))
    parts: list[Part] = [
        Block("gain", gain, "e -> u_fb"),
        Block("feed-forward", k_ff * s, "S_ref -> u_ff"),
        Sum(f"u = u_fb + u_ff{'' if elements.filter is None else ' - u_drift'}"),
        Block("inverse model", 1 / ell_hat, "u -> T"),
    ]
    if elements.smith:
        ahead = ell_hat * (1 - sp.exp(-tau_hat * s)) / s
        parts += [Block("model", ahead, "T -> S_ahead"), Sum("S_pred = S_meas + S_ahead")]
    if elements.filter is not None:
        position, rate = _filter_blocks(elements.filter, elements)
        parts += [
            # The hand tells how the camera moved: what is left of the image is the target's own.
            Block("odometry", ell_hat / ell, "S -> S_moved"),
            Block("odometry then", sp.exp(-tau_hat * s), "S_moved -> S_then"),
            Sum("o = S_meas - S_then"),
            Block("filter", position, "o -> o_now"),
            Block("drift", rate, "o -> u_drift"),
            Sum("S_pred = o_now + S_moved"),
        ]
    return parts


def _robot(elements: Elements) -> list[Part]:
    """From the command to where the camera is."""
    parts: list[Part] = []
    signal = "T"
    for name, factor, there in (
        ("actuator", sp.exp(-tau * s), elements.placement == "actuator"),
        ("dead time", sp.exp(-theta * s), bool(elements.dead_time)),
        ("axes", 1 / (1 + T_a * s), bool(elements.time_constant)),
    ):
        if there:
            after = f"T_{name.split()[0]}"
            parts.append(Block(name, factor, f"{signal} -> {after}"))
            signal = after
    return [*parts, Block("robot, camera", ell / s, f"{signal} -> S")]


def _vision(elements: Elements) -> list[Part]:
    late = elements.placement != "actuator"
    return [Block("vision", sp.exp(-tau * s) if late else sp.Integer(1), "S -> S_meas")]


def _filter_blocks(table: Filter, elements: Elements) -> tuple[sp.Expr, sp.Expr]:
    """From what the target seems to do to where it is now, and how fast: transfer functions in s.

    Those of the filter in z, with z = (1 + sTₛ/2)/(1 − sTₛ/2), so that Tustin's rule gives the
    digital filter back exactly.
    """
    found = steady_filter(table, elements.period, elements.tau_hat or 0.0)
    q = len(found.gain)
    z = (1 + s * sp.Rational(str(elements.period)) / 2) / (
        1 - s * sp.Rational(str(elements.period)) / 2
    )
    F, K, ahead = (
        sp.Matrix(np_array.tolist()).applyfunc(lambda x: sp.Rational(str(x)))
        for np_array in (found.transition, found.gain.reshape(-1, 1), found.ahead)
    )
    kept = (sp.eye(q) - K * sp.eye(q)[0, :]) * F
    state = (z * sp.eye(q) - kept).LUsolve(z * K)
    now = (ahead * state).applyfunc(sp.cancel)
    return now[0], now[1]
