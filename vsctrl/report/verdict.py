"""The report's first lines: what this loop does, in a few sentences and millimetres."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from vsctrl.study import Examination, Row

EXACT = 1e-12  #: a lag (m) that is nothing but rounding


@dataclass(frozen=True)
class Verdict:
    """`kind` colours the page: good, warning (the ways disagree), bad (unstable)."""

    kind: Literal["good", "warning", "bad"]
    sentences: tuple[str, ...]


def verdict(found: Examination) -> Verdict:
    """Read an examination: the lag with and without the derivative term, agreement, headroom."""
    stable = found.stability.is_stable
    agrees = found.comparison.agrees
    sentences = [
        *([] if stable else [_unstable(found)]),
        *_tracking(found),
        _agreement(found),
        *([_headroom(found)] if stable else []),
    ]
    kind: Literal["good", "warning", "bad"] = (
        "bad" if not stable else "good" if agrees else "warning"
    )
    return Verdict(kind, tuple(sentences))


def _unstable(found: Examination) -> str:
    law, period = found.scenario.law, found.scenario.vision.period
    limits = found.stability.limits
    text = (
        f"This loop is unstable: λ = {law.lam:g} s⁻¹ is above {limits.sampled:.2f} s⁻¹, the most "
        f"that {1e3 * found.scenario.vision.latency:g} ms of latency allow when the velocity is "
        f"held over {1e3 * period:g} ms"
    )
    if law.lam < limits.continuous < math.inf:
        text += f" (continuous-time theory would still allow {limits.continuous:.2f} s⁻¹)"
    return text + f". Lower λ: {limits.fastest_sampled:.2f} s⁻¹ is the fastest without oscillation."


def _tracking(found: Examination) -> list[str]:
    latency = found.scenario.vision.latency
    placement = found.scenario.law.placement
    rows = {
        (on, late): found.comparison.row(
            feedforward=on, delay=late, placement=placement if late else "measurement"
        )
        for on in (False, True)
        for late in (0.0, latency)
    }
    ideal, late = (rows[False, 0.0], rows[True, 0.0]), (rows[False, latency], rows[True, latency])
    if any(row.simulated is None for row in ideal):
        return []
    without_latency = (
        f"Without the derivative term the camera {_position(ideal[0])} its reference, "
        f"with it {_short(ideal[1])}"
    )
    if not latency:
        return [without_latency + "."]
    if any(row.simulated is None for row in late):
        return [
            f"{without_latency}, if the image were not late; "
            f"{1e3 * latency:g} ms late the camera does not settle."
        ]
    out = [
        f"With an image {1e3 * latency:g} ms old and without the derivative term, the camera "
        f"{_position(late[0])} its reference; with the derivative term it "
        f"{_position(late[1])} it. Without the latency it would be "
        f"{_short(ideal[0])} and {_short(ideal[1])}."
    ]
    lead = late[1].analytic or 0.0
    run = found.with_feedforward
    if abs(lead) > 1e-5 and run.status.ok and placement == "measurement":
        true, seen = (float(np.linalg.norm(e[-1])) for e in (run.error, run.measured_error))
        if seen < 0.2 * true:
            out.append(
                f"No measured plot shows this: with the derivative term the law sees an error of "
                f"{seen:.1f} px while the true one is {true:.1f} px, because it compares an old "
                "image with a new reference. Delaying the reference by the same time (aligned) "
                f"removes the lead; so does k_ff = {found.stability.nulling_feedforward:.3g}."
            )
    return out


def _agreement(found: Examination) -> str:
    rows = found.comparison.rows
    compared = [row for row in rows if row.agrees is not None]
    if not compared:
        return "No case has a steady lag to compare."
    worst = 1e6 * (found.comparison.largest_disagreement or 0.0)
    size = f"{worst:.2g} µm" if worst >= 1e-3 else "less than a nanometre"
    four = "Closed form, Padé model, exact delay and six-degree-of-freedom simulation"
    if found.comparison.agrees:
        return f"{four} agree in {len(compared)} of {len(rows)} cases, to {size}."
    bad = sum(not row.agrees for row in compared)
    text = f"{four} disagree in {bad} of {len(compared)} cases"
    if any(row.contradicted for row in rows):
        return text + ": a simulation ran away where the loop should be stable. See the table."
    text += f", by up to {size}"
    if not found.comparison.exact_motion:
        text += (
            ". This motion turns or changes depth, for which the loop of figure 1 is only the "
            "first order: small differences are curvature"
        )
    return text + ". See the table."


def _headroom(found: Examination) -> str:
    lam, limits = found.scenario.law.lam, found.stability.limits
    factor = limits.sampled / lam
    text = (
        f"The loop is stable: λ = {lam:g} s⁻¹ may be raised {factor:.2g}-fold, to "
        f"{limits.sampled:.2f} s⁻¹, before it shakes"
    )
    if math.isfinite(limits.continuous) and limits.continuous > 1.01 * limits.sampled:
        share = limits.continuous / limits.sampled - 1
        text += (
            f"; continuous-time theory, {limits.continuous:.2f} s⁻¹, promises {share:.0%} too much"
        )
    return text + "."


def _position(row: Row) -> str:
    value = row.analytic or 0.0
    if abs(value) < EXACT:
        return "is exactly on"
    return f"trails {_size(value)} behind" if value < 0 else f"runs {_size(value)} ahead of"


def _short(row: Row) -> str:
    value = row.analytic or 0.0
    if abs(value) < EXACT:
        return "exactly on it"
    return f"{_size(value)} {'behind' if value < 0 else 'ahead'}"


def _size(value: float) -> str:
    """A length in tenths of a millimetre, in µm where that says too little."""
    return f"{abs(1e3 * value):.1f} mm" if abs(value) >= 1e-3 else f"{abs(1e6 * value):.3g} µm"
