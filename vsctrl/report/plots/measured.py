"""Curves measured in the simulator, drawn over those of theory."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from vsctrl.report.plots.style import GREY, INK, WITH, WITHOUT, drawing, phase, takes
from vsctrl.study.experiments.frequency_response import SineResponse

FINE = 60  #: points of a curve, besides those measured
NOTHING = 1e-9  #: an error that only rounding makes: it has no phase, and no place on a log axis


@takes(SineResponse)
def sine_response(response: SineResponse) -> Figure:
    """Amplitude and phase of the error of a sine: the simulator's points over the exact curves.

    >>> found = vs.study.sine_response(vs.paper.sliding(), omega=[2.0])
    >>> figure = vs.plots.sine_response(found)
    >>> figure.alt
    'Amplitude and phase of the error of a sine, simulated and by theory.'
    """
    grid = [row.omega for row in response.rows]
    omega = np.union1d(grid, np.geomspace(0.8 * min(grid), max(grid), FINE))
    with drawing(7.2, 5.2) as figure:
        top, bottom = figure.subplots(2, 1, sharex=True)
        for on, colour, name in ((False, WITHOUT, "without"), (True, WITH, "with")):
            held = response.curve(omega, feedforward=on)
            smooth = response.curve(omega, feedforward=on, held=False)
            dots = [r for r in response.rows if r.feedforward is on and r.simulated is not None]
            places = np.searchsorted(omega, [row.omega for row in dots])
            values = np.array([row.simulated for row in dots], dtype=complex)
            top.loglog(omega, np.abs(held), color=colour, label=f"{name} feed-forward, sampled")
            top.loglog(omega[places], np.abs(values), "o", color=colour, mfc="none")
            unwound = phase(held)
            bottom.semilogx(omega, unwound, color=colour)
            # Turned with the curve, so that a point is never drawn 360° from it.
            turned = unwound[places] + np.degrees(np.angle(values / held[places]))
            bottom.semilogx(omega[places], turned, "o", color=colour, mfc="none")
            if np.abs(smooth).max() > NOTHING:
                thin = {"color": colour, "linestyle": ":", "linewidth": 1.1}
                top.loglog(omega, np.abs(smooth), **thin)
                bottom.semilogx(omega, phase(smooth), **thin)
        top.plot([], [], ":", color=GREY, linewidth=1.1, label="continuous")
        top.plot([], [], "o", color=GREY, mfc="none", label="6-DOF simulation")
        top.axhline(1, color=INK, linewidth=0.8)
        top.set_ylabel("|E/S*|")
        bottom.set_ylabel("arg E/S*, °")
        bottom.set_xlabel("ω, rad/s")
        top.legend(loc="lower right", ncols=2)
        agree = sum(bool(row.agrees) for row in response.rows)
        figure.caption = f"{agree} of {len(response.rows)} points lie on the sampled curves."
        figure.alt = "Amplitude and phase of the error of a sine, simulated and by theory."
    return figure
