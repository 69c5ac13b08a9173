"""The figures about the loop of figure 1, each with a caption and with its finding in words."""

from __future__ import annotations

import math

import numpy as np

from vsctrl.report import plots
from vsctrl.report.figures import figure
from vsctrl.report.section import Picture
from vsctrl.report.wording import digits, length, per_second
from vsctrl.servo import Run
from vsctrl.study import LoopReport
from vsctrl.study.plot_data import Curves, curves

_NOTHING = 1e-9  #: an image error (px) that is nothing but rounding
_PARTED = 0.05  #: of the largest image error, from which on two lines are seen to part


class Figures:
    """The figures of a result, drawn when they are asked for; `prefix` keeps their ids apart."""

    def __init__(self, result: LoopReport, prefix: str) -> None:
        self._result, self._prefix = result, prefix
        self._curves: Curves = curves(result.stability)

    def bode(self) -> Picture:
        """The opened loop over frequency, with its margins, against Padé models."""
        m = self._result.stability.margins
        found = []
        if m.phase_crossings:
            omega, factor = m.phase_crossings[0]
            found.append(f"gain margin {digits(factor, 3)} at {digits(omega, 3)} rad/s")
        if m.gain_crossings:
            omega, margin = m.gain_crossings[0]
            angle = digits(math.degrees(margin), 3)
            found.append(f"phase margin {angle}° at {digits(omega, 3)} rad/s")
        drawn = plots.bode_against_pade(self._curves.frequency, self._result.stability)
        return figure(
            drawn,
            self._prefix,
            "bode",
            alt=f"Bode plot of the opened loop: {', '.join(found) or 'no crossing'}.",
            caption="Opened loop L(jω). The delay leaves the magnitude alone and turns the phase "
            "without end; each Padé model follows it up to some frequency and then gives up. Below "
            "that frequency the margins of either can be trusted.",
        )

    def nyquist(self) -> Picture:
        """The opened loop round −1."""
        m = self._result.stability.margins
        return figure(
            plots.nyquist_against_pade(self._curves.frequency, self._result.stability),
            self._prefix,
            "nyquist",
            alt=f"Nyquist plot: L stays {digits(1 / m.peak_sensitivity, 3)} away from −1, the loop "
            f"is {'stable' if m.stable else 'unstable'}.",
            caption="Nyquist plot. The circle round −1 touches the curve: its radius 1/Ms is the "
            "distance to instability. Dashed: the unit circle.",
        )

    def locus(self) -> Picture | None:
        """The roots over the gain; None without a delay."""
        if self._curves.locus is None:
            return None
        limit = self._result.stability.limits.continuous
        return figure(
            plots.locus_against_pade(self._curves.locus, self._result.stability),
            self._prefix,
            "locus",
            alt=f"Characteristic roots as λ grows: they cross the axis at {per_second(limit)}.",
            caption="Characteristic roots as λ grows. The exact loop has infinitely many; the Padé "
            "model follows those near the origin and invents the others.",
        )

    def responses(self) -> Picture:
        """Step and ramp in time, against Padé models."""
        stability = self._result.stability
        half = (
            ""
            if stability.margins.stable
            else " (half the gain limit, since this scenario's own gain has none)"
        )
        at = f"λ = {stability.stable_gain.values['lam']:.3g} s⁻¹{half}"
        errors = [p.step_error for p in stability.pade]
        wrong = f"; Padé models miss the step by up to {max(errors):.1e}" if errors else ""
        return figure(
            plots.responses(self._curves.times),
            self._prefix,
            "responses",
            alt=f"Step response, Padé errors and tracking error on the ramp at {at}{wrong}.",
            caption=f"Time responses at {at}. The step looks alike for every order, but each Padé "
            "model is wrong where the delay acts first; on the ramp all settle on the closed form.",
        )

    def errors(self) -> Picture:
        """The image error of both runs, true and as measured."""
        on, off = self._result.with_feedforward, self._result.without_feedforward
        number = 7 if self._result.comparison.on_legs or self._result.comparison.waves else 5
        text = (
            f"Image error E over all points (figure {number} of the paper), with and without the "
            f"derivative term. {seen(self._result)}"
        )
        ends = [f"{np.linalg.norm(run.error[-1]):.1f} px" for run in (off, on)]
        return figure(
            plots.errors(on, off),
            self._prefix,
            "errors",
            alt=f"Image error over time: it ends at {ends[0]} without the derivative term and at "
            f"{ends[1]} with it.",
            caption=" ".join([text, *ended(self._result)]),
        )

    def top(self) -> Picture:
        """The paths of both runs from above, and where they end."""
        on, off = self._result.with_feedforward, self._result.without_feedforward
        ends = [f"{length(float(np.linalg.norm(run.lag[-1, :3])))}" for run in (off, on)]
        earlier = (
            " Where one run ends before the other, that is the moment of the earlier end."
            if ended(self._result)
            else ""
        )
        return figure(
            plots.top_view(on, off),
            self._prefix,
            "top",
            alt=f"Paths of the camera from above: it ends {ends[0]} from its reference without the "
            f"derivative term, {ends[1]} with it.",
            caption="Top view of the camera's path (figure 6 of the paper) and its end enlarged: "
            "the cross is where the reference is at that moment, the dots where the two cameras "
            f"are.{earlier}",
        )

    def histories(self) -> Picture | None:
        """The lag over time where there is no one number for it; None where there is."""
        comparison = self._result.comparison
        own = comparison.own_histories
        if not own:
            return None
        runs = (self._result.without_feedforward, self._result.with_feedforward)
        steady = comparison.rows or comparison.waves
        turn = (
            " What was a lag before a turn is a lead after it, until the camera has turned too."
            if comparison.on_legs
            else ""
        )
        names = {True: "with", False: "without"}
        largest = ", ".join(
            f"{length(each.largest)} {names[each.feedforward]} the derivative term"
            for each in own
            if not each.note
        )
        return figure(
            plots.histories(comparison, own, runs),
            self._prefix,
            "histories",
            alt=f"Lag of the camera over time: at most {largest or 'without end'}.",
            caption="Above, the first point in the image and where it should be"
            f"{' (figure 8 of the paper)' if steady else ''}. Below, the lag of the camera "
            f"{'along its direction of oscillation' if steady else 'along the motion'}: the line "
            "is figure 1 with its velocity held over a frame, driven by the same reference; the "
            f"dots are the simulation.{turn}",
        )


def seen(result: LoopReport) -> str:
    """What the lines of the image error are: the truth, and what the law is shown of it."""
    runs = (result.with_feedforward, result.without_feedforward)
    true, shown = (
        [np.linalg.norm(getattr(run, name), axis=1) for run in runs]
        for name in ("error", "measured_error")
    )
    if max(map(np.max, true)) < _NOTHING:
        return "It is zero: the camera never leaves its reference."
    latency, placement = result.scenario.vision.latency, result.scenario.law.placement
    text = "Solid is the truth; dotted is what the law is shown"
    if not latency:
        return f"{text}, without latency the same."
    if placement == "actuator":
        return f"{text}, the same, since the image is not late: the latency is in the actuator."
    text += f", an image {1e3 * latency:g} ms old against the reference of "
    if placement == "aligned":
        return f"{text}the same moment: the truth, {1e3 * latency:g} ms later."
    text += "now."
    if any(np.max(np.abs(t - e)) < _PARTED * np.max(t) for t, e in zip(true, shown, strict=True)):
        return text
    return f"{text} Notice where they part: a measured plot alone misjudges both laws."


def ended(result: LoopReport) -> list[str]:
    """The runs that ended early, each in a sentence."""
    runs = {"without": result.without_feedforward, "with": result.with_feedforward}
    return [_end(name, run) for name, run in runs.items() if not run.status.complete]


def _end(name: str, run: Run) -> str:
    text = f"The run {name} the derivative term ends early, at t = {run.t[-1]:g} s"
    if run.status.kind == "diverged":
        return f"{text}, where the loop has carried the camera away."
    return f"{text}: {run.status.kind}."
