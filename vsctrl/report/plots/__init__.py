"""The report's figures: each function draws one result object and computes nothing.

Figures are Matplotlib `Figure` objects, never pyplot's, so that drawing has no global state.
"""

from vsctrl.report.plots.chart import stability_chart
from vsctrl.report.plots.history import histories
from vsctrl.report.plots.measured import sine_response
from vsctrl.report.plots.paper import error_traces, first_point, paths, velocities
from vsctrl.report.plots.remedies import remedies
from vsctrl.report.plots.responses import errors, responses, top_view
from vsctrl.report.plots.run import picture, run_figure
from vsctrl.report.plots.stability import bode, nyquist, root_locus
from vsctrl.report.plots.style import EXACT, GREY, INK, PADE, STYLE, WITH, WITHOUT, to_svg

__all__ = [
    "EXACT",
    "GREY",
    "INK",
    "PADE",
    "STYLE",
    "WITH",
    "WITHOUT",
    "bode",
    "error_traces",
    "errors",
    "first_point",
    "histories",
    "nyquist",
    "paths",
    "picture",
    "remedies",
    "responses",
    "root_locus",
    "run_figure",
    "sine_response",
    "stability_chart",
    "to_svg",
    "top_view",
    "velocities",
]
