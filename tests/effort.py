"""How many random cases a run of the tests draws: a share of each kind, or all with ``--long``.

The share of a hypothesis test is drawn from a fixed seed, so that two runs without ``--long`` try
the same cases. Published values, regressions and closed forms are no random cases: they always run.
"""

from collections.abc import Sequence
from typing import Any

from hypothesis import settings

#: Whether this run was asked for with ``--long``; set by `conftest` before any test is collected.
long = False


def choose(everything: bool) -> None:
    """Set the effort of this run."""
    global long
    long = everything
    settings.register_profile("share", deadline=None, derandomize=True)
    settings.register_profile("long", deadline=None)
    settings.load_profile("long" if everything else "share")


def share(cases: int, least: int = 4) -> int:
    """Of a number of random cases a twelfth, but not less than `least`; all with ``--long``."""
    return cases if long else min(cases, max(least, cases // 12))


def some(cases: Sequence[Any], number: int) -> list[Any]:
    """Of listed cases `number`, spread evenly; all with ``--long``."""
    if long or number >= len(cases):
        return list(cases)
    return [cases[(2 * k + 1) * len(cases) // (2 * number)] for k in range(number)]
