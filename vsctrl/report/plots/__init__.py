"""The report's figures: each function draws one result object and computes nothing.

Figures are Matplotlib `Figure` objects, never pyplot's, so that drawing has no global state.
"""

from vsctrl.report.plots.chart import stability_chart
from vsctrl.report.plots.measured import sine_response
from vsctrl.report.plots.responses import errors, responses, top_view
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
    "errors",
    "nyquist",
    "responses",
    "root_locus",
    "sine_response",
    "stability_chart",
    "to_svg",
    "top_view",
]
