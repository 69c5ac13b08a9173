"""Theory, python-control, exact delay and simulation brought together, and held to each other."""

from vsctrl.study.comparison import Comparison, Row, validate
from vsctrl.study.decay import DecayModes, decay_modes
from vsctrl.study.edge import StabilityEdge, stability_edge
from vsctrl.study.examination import Examination, examine
from vsctrl.study.matrix import LagRow, MatrixLaw, matrix_law
from vsctrl.study.measured import Experiment, Measured
from vsctrl.study.sine import SineResponse, SineRow, sine_response
from vsctrl.study.stability import Stability
from vsctrl.study.validation import Validation, validate_all

__all__ = [
    "Comparison",
    "DecayModes",
    "Examination",
    "Experiment",
    "LagRow",
    "MatrixLaw",
    "Measured",
    "Row",
    "SineResponse",
    "SineRow",
    "Stability",
    "StabilityEdge",
    "Validation",
    "decay_modes",
    "examine",
    "matrix_law",
    "sine_response",
    "stability_edge",
    "validate",
    "validate_all",
]
