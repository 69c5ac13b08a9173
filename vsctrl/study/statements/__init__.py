"""What the paper says about its law and its experiments, each statement tried and judged.

The equations are in ``vs.derive.ledger()``; here is what they are said to do. Every number is
computed when it is asked for, by simulation or from the loop, and every verdict follows from them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from vsctrl import paper
from vsctrl.servo import Scenario
from vsctrl.study.statements.law import law
from vsctrl.study.statements.oscillation import oscillation
from vsctrl.study.statements.platform import conclusion, platform
from vsctrl.study.statements.rotation import rotation, sign
from vsctrl.study.statements.runs import Bench, Pair, Traces
from vsctrl.study.statements.slide import slide
from vsctrl.study.statements.statement import Statement, Statements, Trial

__all__ = ["Bench", "Pair", "Statement", "Statements", "Traces", "Trial", "about", "statements"]


@cache
def statements() -> Statements:
    """The paper's statements about sections 2, 4 and 5, in its order, tried and judged.

    About a hundred runs of the simulator, made once; the result is kept.

    >>> len(vs.study.statements().rows)
    26
    """
    bench = Bench()
    parts = (law, sign, platform, slide, oscillation, rotation, conclusion)
    return Statements(tuple(row for part in parts for row in part(bench)))


def about(scenario: Scenario) -> Statements:
    """The paper's statements if the scenario is an experiment of the paper as preset, else none.

    The derivative term may be there or not. What somebody has changed is not the paper's any more.
    """
    makers: tuple[Callable[..., Scenario], ...] = (paper.sliding, paper.oscillation, paper.rotation)
    presets = [make(feedforward=on) for make in makers for on in (True, False)]
    return statements() if scenario in presets else Statements(())
