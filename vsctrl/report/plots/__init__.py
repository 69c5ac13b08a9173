"""Figures of results, each drawn by one call: ``vs.plots.bode(system.open("y"))``.

Figures are Matplotlib `Figure` objects, never pyplot's, so that drawing has no global state and a
notebook shows a figure once. Those of our own making have a `caption`, what to notice, and an
`alt`, what is drawn, both plain text. `plot` chooses by the type of what it is given.
"""

from vsctrl.report.plots.bode_diagram import bode
from vsctrl.report.plots.chart import stability_chart
from vsctrl.report.plots.comparisons import comparison, validation
from vsctrl.report.plots.diagram_picture import block_diagram
from vsctrl.report.plots.dispatch import plot, register
from vsctrl.report.plots.four_sensitivities import gang_of_four
from vsctrl.report.plots.history import histories
from vsctrl.report.plots.measured import sine_response
from vsctrl.report.plots.nichols_chart import nichols
from vsctrl.report.plots.nyquist_diagram import nyquist
from vsctrl.report.plots.overviews import loop_overview, system_overview
from vsctrl.report.plots.pade_study import pade
from vsctrl.report.plots.paper import error_traces, first_point, paths, velocities
from vsctrl.report.plots.parameter_margins import margins
from vsctrl.report.plots.positioning import arrival, distances, predicted_lag
from vsctrl.report.plots.remedies import remedies
from vsctrl.report.plots.responses import errors, responses, top_view
from vsctrl.report.plots.root_maps import pole_map, root_locus
from vsctrl.report.plots.run import picture, run_figure
from vsctrl.report.plots.stability import (
    bode_against_pade,
    locus_against_pade,
    nyquist_against_pade,
)
from vsctrl.report.plots.style import EXACT, GREY, INK, PADE, STYLE, WITH, WITHOUT
from vsctrl.report.plots.svg import to_svg, to_svgs
from vsctrl.report.plots.time_responses import in_unit, response, step, time_response

__all__ = [
    "EXACT",
    "GREY",
    "INK",
    "PADE",
    "STYLE",
    "WITH",
    "WITHOUT",
    "arrival",
    "block_diagram",
    "bode",
    "bode_against_pade",
    "comparison",
    "distances",
    "error_traces",
    "errors",
    "first_point",
    "gang_of_four",
    "histories",
    "in_unit",
    "locus_against_pade",
    "loop_overview",
    "margins",
    "nichols",
    "nyquist",
    "nyquist_against_pade",
    "pade",
    "paths",
    "picture",
    "plot",
    "pole_map",
    "predicted_lag",
    "register",
    "remedies",
    "response",
    "responses",
    "root_locus",
    "run_figure",
    "sine_response",
    "stability_chart",
    "step",
    "system_overview",
    "time_response",
    "to_svg",
    "to_svgs",
    "top_view",
    "validation",
    "velocities",
]


def __dir__() -> list[str]:
    return list(__all__)
