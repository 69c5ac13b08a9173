"""What is asked of a rectangle in which roots are looked for."""

from __future__ import annotations

from vsctrl.checks import quoted, reals
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.realisation.reduction import delays_in_loops
from vsctrl.diagram.roots.newton import FARTHEST
from vsctrl.errors import InputError

Side = tuple[float, float]


def sides(what: str, re: object, im: object) -> tuple[Side, Side]:
    """(low, high) of Re s and of Im s, in rad/s. Errors: `InputError` for what is no rectangle."""
    found: list[Side] = []
    for name, side in (("re", re), ("im", im)):
        ends = reals(side)
        if ends is None or ends.shape != (2,) or not ends[0] < ends[1]:
            raise InputError(
                f"{what}: {name} = {quoted(side)} is not usable; give (low, high) in rad/s."
            )
        found.append((float(ends[0]), float(ends[1])))
    return found[0], found[1]


def check_reach(what: str, re: Side, system: DelaySystem, name: str = "re") -> None:
    """Refuse a rectangle that reaches so far left that e^{−sτ} overflows. Errors: `InputError`."""
    delay_s = float(max(delays_in_loops(system).delays, default=0))
    if -re[0] * delay_s > FARTHEST:
        raise InputError(
            f"{what}: {name} = {quoted(re)} reaches too far left for a delay of {delay_s:g} s; "
            f"begin at {-FARTHEST / delay_s:.4g} rad/s or more."
        )
