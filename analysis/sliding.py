"""The paper's slide, one picture: where the camera is, by closed form, exact delay and simulation.

Run it with ``python analysis/sliding.py [OUT]``; it writes ``sliding.svg`` and prints the table.
"""

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

import vsctrl as vs
from vsctrl.study import Comparison

COLOURS = {False: "#d95f02", True: "#1b9e77"}
NAMES = {False: "without derivative term", True: "with derivative term"}


def main(out: Path) -> Comparison:
    """Validate the slide, draw the lag over time three ways, and return the comparison."""
    comparison = vs.validate(vs.paper.sliding())
    out.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context({"svg.hashsalt": "vsctrl", "font.size": 10}):
        draw().savefig(out / "sliding.svg", metadata={"Date": None}, facecolor="white")
    print(comparison)
    return comparison


def draw() -> Figure:
    """Lag along the motion in mm: simulation (dots), exact delay (line), closed form (dashes)."""
    figure = Figure(figsize=(8, 4.2), layout="constrained")
    axes = figure.subplots()
    axes.axhline(0, color="black", linewidth=0.8)
    for on in (False, True):
        scenario = vs.paper.sliding(feedforward=on)
        law, tau = scenario.law, scenario.vision.latency
        speed, k_ff = scenario.motion.V[0], law.k_ff
        run = vs.simulate(scenario)
        seen = run.t <= 4
        axes.plot(
            run.t[seen], 1e3 * run.lag_along_motion[seen], ".", color=COLOURS[on], markersize=4
        )
        t = np.linspace(0, 4, 801)
        loop = vs.figure1.at(lam=law.lam, tau=tau, ell=1, ell_hat=1, k_ff=k_ff)
        S = loop["S_ref", "S"].response(vs.Ramp(speed), t).y.ravel()
        axes.plot(t, 1e3 * (S - speed * t), color=COLOURS[on], label=NAMES[on])
        known = {"lam": law.lam, "tau": tau, "kappa": 1, "k_ff": k_ff}
        steady = 1e3 * float(vs.loop.tracking_error(vs.Ramp(speed), **known))
        axes.axhline(steady, color=COLOURS[on], linewidth=0.8, linestyle="--")
        words = f"{abs(steady):.1f} mm {'behind' if steady < 0 else 'ahead'}"
        axes.annotate(words, (4, steady), (-4, 5), textcoords="offset points", ha="right")
    axes.plot([], [], ".", color="grey", label="six-degree-of-freedom simulation, every frame")
    axes.plot([], [], color="grey", label="exact-delay engine")
    axes.plot([], [], color="grey", linewidth=0.8, linestyle="--", label="closed form")
    axes.margins(y=0.12)
    axes.set(xlim=(0, 4), xlabel="t, s", ylabel="camera − reference along the motion, mm")
    axes.set_title("Sliding at 40 mm/s, λ = 2.5 s⁻¹, image 80 ms late", loc="left")
    axes.legend(loc="center right", frameon=False)
    return figure


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "analysis"))
