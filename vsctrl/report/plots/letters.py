"""How a parameter is called on an axis: by its letter, where its name is the name of one."""

from __future__ import annotations

import re
from functools import cache

from vsctrl.report.plots.canvas import plain

#: Labels of the parameters whose meaning and unit are known.
KNOWN = {
    "lam": "gain λ, s⁻¹",
    "tau": "latency τ, s",
    "tau_hat": "modelled latency τ̂, s",
    "T_i": "integral time Tᵢ, s",
    "h": "preview h, s",
}
#: One letter, Latin or Greek, with or without a hat, an index or both.
_LETTER = re.compile(r"(?:\\hat\{)?(?:\\[A-Za-z]+|[A-Za-z])\}?(?:_\{[\w, ]*\})?")


@cache
def lettered(name: str) -> str:
    r"""The label of a parameter: what it is known as, its letter (``$\theta$``), or its name."""
    if name in KNOWN:
        return KNOWN[name]
    if not re.fullmatch(r"[A-Za-z]\w*", name, re.ASCII):
        return plain(name)
    import sympy  # here, since its printer alone takes as long as a figure

    latex = sympy.latex(sympy.Symbol(name.replace("_hat", "hat")))
    return f"${latex}$" if _LETTER.fullmatch(latex) else plain(name)
