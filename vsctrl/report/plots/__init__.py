"""The report's figures: each function draws one result object and computes nothing.

Figures are Matplotlib `Figure` objects, never pyplot's, so that drawing has no global state.
"""

from vsctrl.report.plots.chart import stability_chart as stability_chart
from vsctrl.report.plots.history import histories as histories
from vsctrl.report.plots.measured import sine_response as sine_response
from vsctrl.report.plots.paper import error_traces as error_traces
from vsctrl.report.plots.paper import first_point as first_point
from vsctrl.report.plots.paper import paths as paths
from vsctrl.report.plots.paper import velocities as velocities
from vsctrl.report.plots.positioning import arrival as arrival
from vsctrl.report.plots.positioning import predicted_lag as predicted_lag
from vsctrl.report.plots.remedies import remedies as remedies
from vsctrl.report.plots.responses import errors as errors
from vsctrl.report.plots.responses import responses as responses
from vsctrl.report.plots.responses import top_view as top_view
from vsctrl.report.plots.run import picture as picture
from vsctrl.report.plots.run import run_figure as run_figure
from vsctrl.report.plots.stability import bode as bode
from vsctrl.report.plots.stability import nyquist as nyquist
from vsctrl.report.plots.stability import root_locus as root_locus
from vsctrl.report.plots.style import EXACT as EXACT
from vsctrl.report.plots.style import GREY as GREY
from vsctrl.report.plots.style import INK as INK
from vsctrl.report.plots.style import PADE as PADE
from vsctrl.report.plots.style import STYLE as STYLE
from vsctrl.report.plots.style import WITH as WITH
from vsctrl.report.plots.style import WITHOUT as WITHOUT
from vsctrl.report.plots.style import to_svg as to_svg
