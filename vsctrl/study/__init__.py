"""Theory, python-control, exact delay and simulation brought together, and held to each other."""

from vsctrl.study.comparison import Comparison, Row, validate
from vsctrl.study.examination import Examination, examine
from vsctrl.study.stability import Stability

__all__ = ["Comparison", "Examination", "Row", "Stability", "examine", "validate"]
