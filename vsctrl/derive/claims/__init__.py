"""The paper, statement by statement: proved, or shown to be an erratum, conditional or ambiguous.

A module a part of the paper, a function an equation, named by its number: ``task_function`` (1) to
(5), ``control_law`` (6) to (10), ``figure1``, ``kinematics`` (11) to (14), ``trajectories`` (15) to
(17), ``observations``, ``slide`` and ``turn`` section 4. ``claim`` says what a claim is, ``zero``
what counts as a proof.
"""

import textwrap
from collections.abc import Iterable
from functools import cache

from vsctrl.derive.claims import (
    control_law,
    figure1,
    kinematics,
    observations,
    slide,
    task_function,
    trajectories,
    turn,
)
from vsctrl.derive.claims.claim import Claim, Evidence, Proof, Status

__all__ = ["Claim", "Evidence", "Proof", "Status", "as_text", "ledger"]

_WIDTH = 100


@cache
def ledger() -> tuple[Claim, ...]:
    """Every numbered equation of the paper and what else of it can be checked, in its order.

    Nothing is derived until ``Claim.prove`` is called; all of them take some seconds.
    """
    return (
        *trajectories.ABSTRACT,
        *task_function.CLAIMS,
        *control_law.CLAIMS,
        *figure1.CLAIMS,
        *kinematics.CLAIMS,
        *trajectories.CLAIMS,
        *slide.SETUP,
        *observations.SETUP,
        *slide.CLAIMS,
        *observations.CLAIMS,
        *turn.CLAIMS,
    )


def as_text(claims: Iterable[Claim]) -> str:
    """Claims as a table in plain text: equation, status, statement, and → the corrected form.

    Lines of at most 100 characters, each statement and correction wrapped in its own column.
    """
    rows = list(claims)
    first = max((len(row.equation) for row in rows), default=0)
    second = max((len(row.status) for row in rows), default=0)
    room = _WIDTH - first - second - 4
    lines = []
    for row in rows:
        said = textwrap.wrap(row.statement, room) or [""]
        said += textwrap.wrap(row.correction, room, initial_indent="→ ", subsequent_indent="  ")
        for i, line in enumerate(said):
            left = f"{row.equation:<{first}}  {row.status:<{second}}" if i == 0 else ""
            lines.append(f"{left:<{first + second + 2}}  {line}")
    return "\n".join(lines)
