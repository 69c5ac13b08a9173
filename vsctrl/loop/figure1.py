"""The monovariable servo loop of figure 1 as a diagram, with its latency where it may be."""

from functools import cache
from typing import Literal, get_args

import sympy as sp

from vsctrl.checks import quoted
from vsctrl.diagram import Block, Diagram, Sum
from vsctrl.errors import InputError, nearest
from vsctrl.keywords import keywords
from vsctrl.symbols import ell, ell_hat, k_ff, lam, s, tau

Placement = Literal["measurement", "aligned", "actuator"]


@keywords
@cache
def diagram(placement: Placement = "measurement") -> Diagram:
    """Figure 1 of the paper with the latency τ placed where `placement` says.

    `measurement`: the vision system is late (S_meas = e^{−τs} S); `aligned`: so is the reference
    that it is compared with, by the same τ; `actuator`: the velocity is applied late instead.
    Input S_ref, output S. Parameters: lam (s⁻¹), k_ff, ell, ell_hat, tau (s).

    >>> vs.loop.diagram("actuator").outputs
    ('S',)
    """
    check_placement(placement)
    delay = sp.exp(-tau * s)
    aligned, actuator = placement == "aligned", placement == "actuator"
    parts: list[Block | Sum] = [
        Sum(f"e = {'S_ref_late' if aligned else 'S_ref'} - S_meas"),
        Block("gain", lam, "e -> u_fb"),
        Block("feed-forward", k_ff * s, "S_ref -> u_ff"),
        Sum("u = u_fb + u_ff"),
        Block("inverse model", 1 / ell_hat, "u -> T"),
        *([Block("actuator", delay, "T -> T_late")] if actuator else []),
        Block("robot, camera", ell / s, f"{'T_late' if actuator else 'T'} -> S"),
        Block("vision", sp.Integer(1) if actuator else delay, "S -> S_meas"),
        *([Block("alignment", delay, "S_ref -> S_ref_late")] if aligned else []),
    ]
    return Diagram(parts, inputs=["S_ref"], outputs=["S"])


def check_placement(placement: str) -> None:
    """Refuse a placement that is none. Errors: `InputError`."""
    if placement not in get_args(Placement):
        raise InputError(
            f"placement: {quoted(placement)} is unknown{nearest(placement, get_args(Placement))}; "
            f"choose {', '.join(get_args(Placement))}."
        )


figure1 = diagram()
