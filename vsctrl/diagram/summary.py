"""What a diagram in numbers and its channels say of themselves in a line or two."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from vsctrl.diagram.realisation.numeric import Numeric
from vsctrl.errors import InputError, LimitError, cut
from vsctrl.tables import listed

WIDEST = 76  #: characters of a formula


def system_lines(system: Numeric) -> dict[str, str]:
    """Its signals, blocks, parameters and delays."""
    diagram = system.diagram
    delays = sorted({tau for block in system.blocks for tau in block.delays if tau})
    return {
        "diagram": f"{', '.join(diagram.inputs) or 'no input'} → {', '.join(diagram.outputs)}",
        "blocks": listed([block.name for block in diagram.blocks], 8),
        "parameters": listed([f"{name} = {x:g}" for name, x in system.values.items()], 8),
        "delays": f"{listed([f'{float(tau):g}' for tau in delays])}{' s' * bool(delays)}",
    }


def formula(expr: Callable[[], Any]) -> str:
    """A transfer function on a line, its numbers to four digits."""
    return asked(lambda: cut(str(expr().evalf(4)), WIDEST))


def asked(answer: Callable[[], str]) -> str:
    """An answer, or the sentence that refuses it: what is shown never fails."""
    try:
        return answer()
    except (InputError, LimitError) as refused:
        return str(refused)
