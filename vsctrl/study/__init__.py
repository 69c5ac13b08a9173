"""Theory, python-control, exact delay and simulation brought together, and held to each other."""

from vsctrl.study.comparison import Comparison, History, Row, Wave, validate
from vsctrl.study.compensation import compare_remedies
from vsctrl.study.decay import DecayModes, decay_modes
from vsctrl.study.edge import StabilityEdge, stability_edge
from vsctrl.study.examination import Examination, examine
from vsctrl.study.matrix import LagRow, MatrixLaw, matrix_law
from vsctrl.study.measured import Experiment, Measured
from vsctrl.study.sine import SineResponse, SineRow, sine_response
from vsctrl.study.stability import Stability
from vsctrl.study.statements import Statement, Statements, statements
from vsctrl.study.treated import Remedies, SteadyError, Treated
from vsctrl.study.validation import Validation, validate_all

__all__ = [
    "Comparison",
    "DecayModes",
    "Examination",
    "Experiment",
    "History",
    "LagRow",
    "MatrixLaw",
    "Measured",
    "Remedies",
    "Row",
    "SineResponse",
    "SineRow",
    "Stability",
    "StabilityEdge",
    "Statement",
    "Statements",
    "SteadyError",
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
