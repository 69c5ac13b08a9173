"""Theory, python-control, exact delay and simulation brought together, and held to each other."""

from vsctrl.study.compensation.comparison import compare_remedies
from vsctrl.study.compensation.results import Remedies, SteadyError, Treated
from vsctrl.study.experiments.dominant_mode import DecayModes, decay_modes
from vsctrl.study.experiments.experiment import Experiment, Measured
from vsctrl.study.experiments.frequency_response import SineResponse, SineRow, sine_response
from vsctrl.study.experiments.matrix_law import LagRow, MatrixLaw, matrix_law
from vsctrl.study.experiments.stability_limit import StabilityEdge, stability_edge
from vsctrl.study.experiments.validation import Validation, validate_all
from vsctrl.study.loop_report import LoopReport, examine
from vsctrl.study.stability import Stability
from vsctrl.study.statements import Statement, Statements, statements
from vsctrl.study.tracking.comparison import Comparison, validate
from vsctrl.study.tracking.lag_history import History
from vsctrl.study.tracking.sine_error import Wave
from vsctrl.study.tracking.steady_lag import SteadyLag

__all__ = [
    "Comparison",
    "DecayModes",
    "Experiment",
    "History",
    "LagRow",
    "LoopReport",
    "MatrixLaw",
    "Measured",
    "Remedies",
    "SineResponse",
    "SineRow",
    "Stability",
    "StabilityEdge",
    "Statement",
    "Statements",
    "SteadyError",
    "SteadyLag",
    "Treated",
    "Validation",
    "Wave",
    "compare_remedies",
    "decay_modes",
    "examine",
    "matrix_law",
    "sine_response",
    "stability_edge",
    "statements",
    "validate",
    "validate_all",
]


def __dir__() -> list[str]:
    return list(__all__)
