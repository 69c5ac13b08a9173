"""vsctrl: how far behind a visual-servoing camera will be, how fast it may go, and why.

The public names load on first use, so that ``import vsctrl`` is instant.
"""

from importlib import import_module, metadata
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vsctrl import derive as derive
    from vsctrl import loop as loop
    from vsctrl import paper as paper
    from vsctrl import servo as servo
    from vsctrl import study as study
    from vsctrl.diagram import Applied as Applied
    from vsctrl.diagram import Block as Block
    from vsctrl.diagram import Diagram as Diagram
    from vsctrl.diagram import Exponential as Exponential
    from vsctrl.diagram import Loop as Loop
    from vsctrl.diagram import Parabola as Parabola
    from vsctrl.diagram import Pulse as Pulse
    from vsctrl.diagram import Ramp as Ramp
    from vsctrl.diagram import Samples as Samples
    from vsctrl.diagram import Sine as Sine
    from vsctrl.diagram import Step as Step
    from vsctrl.diagram import Sum as Sum
    from vsctrl.documents import load as load
    from vsctrl.errors import InputError as InputError
    from vsctrl.errors import LimitError as LimitError
    from vsctrl.loop import per_sample as per_sample
    from vsctrl.loop.figure1 import figure1 as figure1
    from vsctrl.report import Report as Report
    from vsctrl.report import plots as plots
    from vsctrl.report import write_report as write_report
    from vsctrl.report.plots import plot as plot
    from vsctrl.report.plots.animation import animate as animate
    from vsctrl.servo import Run as Run
    from vsctrl.servo import Scenario as Scenario
    from vsctrl.servo.simulate import simulate as simulate
    from vsctrl.study import validate as validate
    from vsctrl.study import validate_all as validate_all

_HOME = {
    "Applied": "vsctrl.diagram",
    "Block": "vsctrl.diagram",
    "Diagram": "vsctrl.diagram",
    "Exponential": "vsctrl.diagram",
    "InputError": "vsctrl.errors",
    "LimitError": "vsctrl.errors",
    "Loop": "vsctrl.diagram",
    "Parabola": "vsctrl.diagram",
    "Pulse": "vsctrl.diagram",
    "Ramp": "vsctrl.diagram",
    "Report": "vsctrl.report",
    "Run": "vsctrl.servo",
    "Samples": "vsctrl.diagram",
    "Scenario": "vsctrl.servo",
    "Sine": "vsctrl.diagram",
    "Step": "vsctrl.diagram",
    "Sum": "vsctrl.diagram",
    "animate": "vsctrl.report.plots.animation",
    "figure1": "vsctrl.loop",
    "load": "vsctrl.documents",
    "per_sample": "vsctrl.loop",
    "plot": "vsctrl.report.plots",
    "simulate": "vsctrl.servo",
    "validate": "vsctrl.study",
    "validate_all": "vsctrl.study",
    "write_report": "vsctrl.report",
}
_ROOMS = {name: f"vsctrl.{name}" for name in ("derive", "loop", "paper", "servo", "study")}
_ROOMS["plots"] = "vsctrl.report.plots"

__all__ = [*_HOME, *_ROOMS]
__version__ = metadata.version("vsctrl")


def __getattr__(name: str) -> object:
    if name in _ROOMS:
        return import_module(_ROOMS[name])
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'vsctrl' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
