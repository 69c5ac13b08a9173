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
    equations_1_to_5,
    equations_6_to_10,
    equations_11_to_14,
    equations_15_to_17,
    figure_1,
    section_4_1_slide,
    section_4_2_rotation,
    section_4_observations,
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
        *equations_15_to_17.ABSTRACT,
        *equations_1_to_5.CLAIMS,
        *equations_6_to_10.CLAIMS,
        *figure_1.CLAIMS,
        *equations_11_to_14.CLAIMS,
        *equations_15_to_17.CLAIMS,
        *section_4_1_slide.SETUP,
        *section_4_observations.SETUP,
        *section_4_1_slide.CLAIMS,
        *section_4_observations.CLAIMS,
        *section_4_2_rotation.CLAIMS,
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
