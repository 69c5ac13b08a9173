"""Figures of results, each drawn by one call: ``vs.plots.bode(system.open("y"))``.

Figures are Matplotlib `Figure` objects, never pyplot's, so that drawing has no global state and a
notebook shows a figure once. Those of our own making have a `caption`, what to notice, and an
`alt`, what is drawn, both plain text. `plot` chooses by the type of what it is given.
"""

from vsctrl.report.plots.bode_diagram import bode as bode
from vsctrl.report.plots.chart import stability_chart as stability_chart
from vsctrl.report.plots.comparisons import comparison as comparison
from vsctrl.report.plots.comparisons import validation as validation
from vsctrl.report.plots.diagram_picture import block_diagram as block_diagram
from vsctrl.report.plots.dispatch import plot as plot
from vsctrl.report.plots.dispatch import register as register
from vsctrl.report.plots.dispatch import system_overview as system_overview
from vsctrl.report.plots.four_sensitivities import gang_of_four as gang_of_four
from vsctrl.report.plots.history import histories as histories
from vsctrl.report.plots.measured import sine_response as sine_response
from vsctrl.report.plots.nichols_chart import nichols as nichols
from vsctrl.report.plots.nyquist_diagram import nyquist as nyquist
from vsctrl.report.plots.pade_study import pade as pade
from vsctrl.report.plots.paper import error_traces as error_traces
from vsctrl.report.plots.paper import first_point as first_point
from vsctrl.report.plots.paper import paths as paths
from vsctrl.report.plots.paper import velocities as velocities
from vsctrl.report.plots.parameter_margins import margins as margins
from vsctrl.report.plots.positioning import arrival as arrival
from vsctrl.report.plots.positioning import distances as distances
from vsctrl.report.plots.positioning import predicted_lag as predicted_lag
from vsctrl.report.plots.remedies import remedies as remedies
from vsctrl.report.plots.responses import errors as errors
from vsctrl.report.plots.responses import responses as responses
from vsctrl.report.plots.responses import top_view as top_view
from vsctrl.report.plots.root_maps import pole_map as pole_map
from vsctrl.report.plots.root_maps import root_locus as root_locus
from vsctrl.report.plots.run import picture as picture
from vsctrl.report.plots.run import run_figure as run_figure
from vsctrl.report.plots.stability import bode_against_pade as bode_against_pade
from vsctrl.report.plots.stability import locus_against_pade as locus_against_pade
from vsctrl.report.plots.stability import nyquist_against_pade as nyquist_against_pade
from vsctrl.report.plots.style import EXACT as EXACT
from vsctrl.report.plots.style import GREY as GREY
from vsctrl.report.plots.style import INK as INK
from vsctrl.report.plots.style import PADE as PADE
from vsctrl.report.plots.style import STYLE as STYLE
from vsctrl.report.plots.style import WITH as WITH
from vsctrl.report.plots.style import WITHOUT as WITHOUT
from vsctrl.report.plots.style import to_svg as to_svg
from vsctrl.report.plots.time_responses import in_unit as in_unit
from vsctrl.report.plots.time_responses import response as response
from vsctrl.report.plots.time_responses import step as step
from vsctrl.report.plots.time_responses import time_response as time_response
