"""How far behind, in sentences, and how well the ways agree on it: by the kind of motion."""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal
from typing import TypeVar

import numpy as np

from vsctrl.report.wording import digits
from vsctrl.servo import Run, Scenario
from vsctrl.study import Comparison, LoopReport, SteadyLag, Wave

Case = TypeVar("Case", SteadyLag, Wave)

EXACT = 1e-12  #: a lag (m) that is nothing but rounding
UNSEEN = 1e-5  #: a lag (m) that is not worth a cure
SEEN = 0.2  #: a measured error is said to hide the true one below this share of it


def tracking(result: LoopReport, settled: bool = True) -> list[str]:
    """The lag with and without the derivative term, and what a measured plot shows of it.

    `settled`: whether the run was long enough to settle; else it is told what it would come to.
    """
    comparison = result.comparison
    if comparison.waves:
        return _sine(result)
    # A run that was too short for its transient has a lag, but no steady one.
    latency = result.scenario.vision.latency
    rows = _own(result, result.comparison.row).items() if comparison.rows else ()
    own = [row for (_, delay), row in rows if delay == latency]
    short = any(row.simulated is not None and row.analytic is None for row in own)
    if comparison.rows and not (comparison.on_legs and short):
        return _steady(result, settled)
    return _at_every_frame(result)


def cure(result: LoopReport) -> list[str]:
    """What takes the lead away that the law does not see; empty where it sees its error."""
    comparison, latency = result.comparison, result.scenario.vision.latency
    if not latency or not _hidden(result):
        return []
    if comparison.waves:
        aligned = comparison.wave(feedforward=True, delay=latency, placement="aligned")
        if aligned.simulated is None:
            return []
        size = _size(abs(aligned.simulated))
        return [f"Delaying the reference by the same time (aligned) leaves ±{size}."]
    if not comparison.rows:
        return []
    own = _own(result, comparison.row)[True, latency]
    if not _leads(own) or own.agrees is False or own.analytic is None:
        return []
    leg = " on each leg" if comparison.on_legs else ""
    nulling = digits(result.stability.nulling_feedforward, 3)
    return [
        f"Delaying the reference by the same time (aligned) removes the lead{leg}; so does "
        f"k_ff = {nulling}."
    ]


def agreement(comparison: Comparison) -> list[str]:
    """How well the ways agree, each kind of comparison in a sentence."""
    if not (comparison.rows or comparison.waves or comparison.histories):
        return [comparison.note]
    out = [_agreement(comparison)] if comparison.rows else []
    out += [_sines_agree(comparison)] if comparison.waves else []
    out += [_frames_agree(comparison)] if comparison.histories else []
    return out


# Steady lags -----------------------------------------------------------------------------------
def _steady(result: LoopReport, settled: bool) -> list[str]:
    """Of a constant twist, or at the end of each leg of a triangle."""
    latency, rows = result.scenario.vision.latency, _own(result, result.comparison.row)
    leg = " on each leg" if result.comparison.on_legs else ""
    settles_at = "settles" if settled else "would settle"
    ideal, own = (rows[False, 0.0], rows[True, 0.0]), (rows[False, latency], rows[True, latency])
    known, settles = (all(_lag(row) is not None for row in pair) for pair in (ideal, own))
    if not known and not settles:
        return []
    if not latency:
        return [
            f"Without the derivative term the camera {settles_at} {_position(ideal[0])} its "
            f"reference{leg}, with it {_short(ideal[1])}."
        ]
    if not settles:
        return [
            f"Without latency the camera would settle {_position(ideal[0])} its reference{leg} "
            f"without the derivative term, {_short(ideal[1])} with it. "
            f"{_late(result.scenario)} it does not settle."
        ]
    out = [
        f"{_late(result.scenario)} and without the derivative term, the camera {settles_at} "
        f"{_position(own[0])} its reference{leg}; with the derivative term it {settles_at} "
        f"{_position(own[1])} it."
    ]
    if known:
        out[0] += (
            f" Without the latency it would be {_short(ideal[0])} without the term and "
            f"{_short(ideal[1])} with it."
        )
    if _leads(own[1]) and (hidden := _hidden(result)):
        out.append(hidden)
    return out


def _leads(row: SteadyLag) -> bool:
    return abs(_lag(row) or 0.0) > UNSEEN


def _own(result: LoopReport, pick: Callable[..., Case]) -> dict[tuple[bool, float], Case]:
    """The cases of the scenario's own latency and placement and of none, by k_ff and latency."""
    placement = result.scenario.law.placement
    return {
        (on, delay): pick(
            feedforward=on, delay=delay, placement=placement if delay else "measurement"
        )
        for on in (False, True)
        for delay in (0.0, result.scenario.vision.latency)
    }


def _late(scenario: Scenario) -> str:
    """What is late, as a sentence begins."""
    ms = f"{1e3 * scenario.vision.latency:g} ms"
    return {
        "measurement": f"With an image {ms} old",
        "aligned": f"With an image {ms} old, compared with a reference as old,",
        "actuator": f"With {ms} of latency in the actuator",
    }[scenario.law.placement]


def _hidden(result: LoopReport) -> str:
    """That the law does not see its error, where that is so; else empty."""
    run = result.with_feedforward
    if not run.status.complete or result.scenario.law.placement != "measurement":
        return ""
    changes = bool(result.comparison.histories)
    true, seen = (_size_in_image(run, e, changes) for e in ("error", "measured_error"))
    if not seen < SEEN * true:
        return ""
    mean = " (median)" if changes else ""
    return (
        f"No measured plot shows this: with the derivative term the law sees an error of "
        f"{seen:.1f} px while the true one is {true:.1f} px{mean}, because it compares an old "
        "image with a new reference."
    )


def _size_in_image(run: Run, which: str, changes: bool) -> float:
    """E over all points, px: of the last frame, or the median over the later half of a run."""
    e = np.linalg.norm(getattr(run, which), axis=1)
    # A median, which the few frames after a turn do not change.
    return float(np.median(e[len(e) // 2 :])) if changes else float(e[-1])


# Sines -----------------------------------------------------------------------------------------
def _sine(result: LoopReport) -> list[str]:
    latency, comparison = result.scenario.vision.latency, result.comparison
    waves = _own(result, comparison.wave)
    if any(waves[on, 0.0].simulated is None for on in (False, True)):
        return []
    ideal = [_swing(waves[on, 0.0]) for on in (False, True)]
    if not latency:
        return [f"The error is a sine: {ideal[0]} without the derivative term, {ideal[1]} with it."]
    if any(waves[on, latency].simulated is None for on in (False, True)):
        return [
            f"Without latency the error would be a sine, {ideal[0]} without the derivative term "
            f"and {ideal[1]} with it. {_late(result.scenario)} the camera does not settle."
        ]
    own = [_swing(waves[on, latency]) for on in (False, True)]
    out = [
        f"{_late(result.scenario)} the error is a sine: {own[0]} without the derivative term, "
        f"{own[1]} with it. Without the latency it would be {ideal[0]} without the term and "
        f"{ideal[1]} with it."
    ]
    return [*out, hidden] if (hidden := _hidden(result)) else out


def _swing(wave: Wave) -> str:
    """Amplitude, and whether the camera is behind or ahead where the reference moves fastest."""
    value = wave.simulated or 0j
    if abs(value) < EXACT:
        return "nothing"
    # A lead of constant time is along the velocity, a quarter of a cycle before the sine itself.
    side = {-1: " behind", 0: "", 1: " ahead"}[round(value.imag / abs(value))]
    return f"±{_size(abs(value))}{side}"


# Any motion ------------------------------------------------------------------------------------
def _at_every_frame(result: LoopReport) -> list[str]:
    own = result.comparison.own_histories
    sizes = [
        f"{_size(history.largest)} ({_size(history.root_mean_square)} root mean square)"
        for history in own
        if not history.note
    ]
    if len(sizes) < 2:
        return []
    subject = f"{_late(result.scenario)} the" if result.scenario.vision.latency else "The"
    return [
        f"The lag changes along this motion. {subject} largest is {sizes[0]} without the "
        f"derivative term, {sizes[1]} with it."
    ]


# Agreement -------------------------------------------------------------------------------------
def _agreement(comparison: Comparison) -> str:
    rows = comparison.rows
    compared = [row for row in rows if row.agrees is not None]
    if not compared:
        return "No case has a steady lag to compare."
    size = _close(comparison.largest_disagreement or 0.0)
    four = "Closed form, Padé model, exact delay and six-degree-of-freedom simulation"
    bad = sum(not row.agrees for row in compared)
    if not bad:
        return f"{four} agree in {len(compared)} of {len(rows)} cases, to {size}."
    text = f"{four} disagree in {bad} of {len(compared)} cases"
    if any(row.contradicted for row in rows):
        return text + ": a simulation ran away where the loop should be stable. See the table."
    text += f", by up to {size}; the lags of these cases are the simulation's"
    if not comparison.exact_motion:
        text += (
            ". This motion turns or changes depth, for which the loop of figure 1 is only the "
            "first order"
        )
    return text + ". See the table."


def _sines_agree(comparison: Comparison) -> str:
    compared = [wave for wave in comparison.waves if wave.agrees is not None]
    if not compared:
        return "No case has a steady sine to compare."
    bad = sum(not wave.agrees for wave in compared)
    pairs = (
        "Closed form and exact delay, and the loop as sampled and the six-degree-of-freedom "
        "simulation,"
    )
    if bad:
        return f"{pairs} disagree in {bad} of {len(compared)} cases. See the table."
    within = _close(comparison.largest_disagreement or 0.0)
    return f"{pairs} agree in {len(compared)} of {len(comparison.waves)} cases, to {within}."


def _frames_agree(comparison: Comparison) -> str:
    every = comparison.histories
    bad = sum(not history.agrees for history in every)
    both = len(every) + len(comparison.missing)
    rest = f" that are stable as sampled; {both - len(every)} are not" if comparison.missing else ""
    where = f"in the {len(every)} of {both} cases that are stable as sampled, " if rest else ""
    loop = "figure 1 with its velocity held over a frame"
    if bad:
        return f"Frame by frame the simulation leaves {loop} in {bad} of {len(every)} cases{rest}."
    within = _close(max(history.disagreement for history in every))
    first = "" if comparison.exact_motion else ", its first order,"
    return f"At every frame the simulation is {where}where {loop}{first} has it, to {within}."


# Numbers ---------------------------------------------------------------------------------------
def _close(difference: float) -> str:
    """A small difference, m, in the unit that suits it."""
    if difference >= 1e-4:
        return f"{_digits(1e3 * difference, 2)} mm"
    return f"{_digits(1e6 * difference, 2)} µm" if difference >= 1e-9 else "less than a nanometre"


def _lag(row: SteadyLag) -> float | None:
    """The steady lag where the simulation has one, m: the closed form's, unless they disagree."""
    if row.simulated is None:
        return None
    return row.simulated if row.agrees is False else row.analytic


def _position(row: SteadyLag) -> str:
    value = _lag(row) or 0.0
    if abs(value) < EXACT:
        return "exactly on"
    return f"{_size(value)} behind" if value < 0 else f"{_size(value)} ahead of"


def _short(row: SteadyLag) -> str:
    value = _lag(row) or 0.0
    if abs(value) < EXACT:
        return "exactly on it"
    return f"{_size(value)} {'behind' if value < 0 else 'ahead'}"


def _size(value: float) -> str:
    """A length in tenths of a millimetre, in µm where that says too little."""
    if abs(value) >= 0.9995e-3:
        return f"{abs(1e3 * value):.1f} mm"
    return f"{_digits(abs(1e6 * value), 3)} µm"


def _digits(value: float, n: int) -> str:
    """A number to n significant digits, never with an exponent."""
    return f"{Decimal(f'{value:.{n}g}'):f}"
