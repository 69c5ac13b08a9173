"""Figure 1 of the paper: its diagram, and its closed forms, derived from the diagram.

Nothing is typed in, so a changed diagram changes its formulas.
"""

from vsctrl.loop.figure1 import Placement, diagram, figure1
from vsctrl.loop.limits import fastest_gain, gain_limit, per_sample
from vsctrl.loop.tracking import nulling_feedforward, tracking_error, tracking_transfer

__all__ = [
    "Placement",
    "diagram",
    "fastest_gain",
    "figure1",
    "gain_limit",
    "nulling_feedforward",
    "per_sample",
    "tracking_error",
    "tracking_transfer",
]
