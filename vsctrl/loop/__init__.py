"""Figure 1 of the paper: its diagram, and its closed forms, derived from the diagram.

Nothing is typed in, so a changed diagram changes its formulas. ``figure1`` is the diagram,
``variants`` those with a Smith predictor, PI or preview; ``steady`` the steady error of any
diagram, ``tracking`` that of figure 1, ``constants`` its error constants; ``limits`` the gain
limits, with ``fractional_delay`` between whole periods and ``compensated_limits`` of the variants;
``criteria`` and ``design`` the gain for a wanted quality; ``matrix`` the loop in six degrees of
freedom; ``scenario_loop`` the loop of a scenario, with all that is linear in it (`of`);
``summary`` all of it for one gain and one delay.
"""

from vsctrl.loop.closed import pade_gain_limit, pole, sampled_sine_error, step_response
from vsctrl.loop.compensated_limits import pi_gain_limit, smith_gain_limit
from vsctrl.loop.constants import ErrorConstants, error_constants, error_sensitivities
from vsctrl.loop.design import gain_for, least_error_gain, squared_error
from vsctrl.loop.figure1 import Placement as Placement
from vsctrl.loop.figure1 import diagram, figure1
from vsctrl.loop.limits import fastest_gain, gain_limit, per_sample
from vsctrl.loop.matrix import (
    calibration_matrix,
    depth_error_matrix,
    focal_error_matrix,
    matrix_gain_limit,
    steady_lag,
)
from vsctrl.loop.scenario_loop.of import ScenarioLoop, of
from vsctrl.loop.steady import amplitude_and_phase, error_transfer, steady_error
from vsctrl.loop.tracking import (
    harmful_feedforward_gain,
    nulling_feedforward,
    tracking_error,
    tracking_transfer,
)
from vsctrl.loop.variants import nulling_preview, pi, preview, previewed_feedforward, smith

__all__ = [
    "ErrorConstants",
    "ScenarioLoop",
    "amplitude_and_phase",
    "calibration_matrix",
    "depth_error_matrix",
    "diagram",
    "error_constants",
    "error_sensitivities",
    "error_transfer",
    "fastest_gain",
    "figure1",
    "focal_error_matrix",
    "gain_for",
    "gain_limit",
    "harmful_feedforward_gain",
    "least_error_gain",
    "matrix_gain_limit",
    "nulling_feedforward",
    "nulling_preview",
    "of",
    "pade_gain_limit",
    "per_sample",
    "pi",
    "pi_gain_limit",
    "pole",
    "preview",
    "previewed_feedforward",
    "sampled_sine_error",
    "smith",
    "smith_gain_limit",
    "squared_error",
    "steady_error",
    "steady_lag",
    "step_response",
    "tracking_error",
    "tracking_transfer",
]


def __dir__() -> list[str]:
    return list(__all__)
