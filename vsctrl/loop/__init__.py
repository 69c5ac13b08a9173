"""Figure 1 of the paper: its diagram, and its closed forms, derived from the diagram.

Nothing is typed in, so a changed diagram changes its formulas.
"""

from vsctrl.loop.design import gain_for, least_error_gain, squared_error
from vsctrl.loop.figure1 import Placement, diagram, figure1
from vsctrl.loop.limits import fastest_gain, gain_limit, per_sample
from vsctrl.loop.tolerance import pi_gain_limit, smith_gain_limit
from vsctrl.loop.tracking import nulling_feedforward, tracking_error, tracking_transfer
from vsctrl.loop.variants import pi, preview, previewed_feedforward, smith, tracking_errors

__all__ = [
    "Placement",
    "diagram",
    "fastest_gain",
    "figure1",
    "gain_for",
    "gain_limit",
    "least_error_gain",
    "nulling_feedforward",
    "per_sample",
    "pi",
    "pi_gain_limit",
    "preview",
    "previewed_feedforward",
    "smith",
    "smith_gain_limit",
    "squared_error",
    "tracking_error",
    "tracking_errors",
    "tracking_transfer",
]
