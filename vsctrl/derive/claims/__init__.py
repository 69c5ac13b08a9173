"""The paper, statement by statement: proved, or shown to be an erratum, conditional or ambiguous.

A module holds the claims of a part of the paper in its order, and bears the numbers of its
equations or its section: ``equations_1_to_5`` … ``equations_15_to_17``, ``figure_1``,
``section_4_…``. What a claim is stands in ``claim``, what counts as a proof in ``decision``.
"""

import textwrap
from collections.abc import Iterable
from functools import cache

from vsctrl.derive.claims import (
    abstract,
    equations_1_to_5,
    equations_6_to_10,
    equations_11_to_14,
    equations_15_to_17,
    figure_1,
    section_4_1_slide,
    section_4_2_rotation,
    section_4_observations,
    section_4_set_up,
)
from vsctrl.derive.claims.claim import Claim, Evidence, Proof, Status

__all__ = ["Claim", "Evidence", "Proof", "Status", "as_text", "ledger"]

_WIDTH = 100
_PARTS = (
    abstract,
    equations_1_to_5,
    equations_6_to_10,
    figure_1,
    equations_11_to_14,
    equations_15_to_17,
    section_4_set_up,
    section_4_1_slide,
    section_4_observations,
    section_4_2_rotation,
)


@cache
def ledger() -> tuple[Claim, ...]:
    """Every numbered equation of the paper and what else of it can be checked, in its order.

    Nothing is derived until ``Claim.prove`` is called; all of them take some seconds.

    >>> len(vs.derive.ledger())
    62
    """
    return tuple(
        entry for part in _PARTS for entry in vars(part).values() if isinstance(entry, Claim)
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
