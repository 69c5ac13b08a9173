"""What the experiments have in common: rest, transients, and the modes that theory predicts.

All start at the scenario's start pose, before its target, with its law and its vision; only the
motion, the offset and the length of the run are theirs. Noise is left out: it would hide what is
measured.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vsctrl import loop
from vsctrl.errors import InputError
from vsctrl.loop.limits import sampled_characteristic
from vsctrl.servo import Run, Scenario, simulate
from vsctrl.servo.pose import inverse
from vsctrl.symbols import T_s, d, kappa, lam, z_plane

Array = NDArray[np.float64]

MOST_FRAMES = 4000  #: the longest wait for a transient to end
ENDED = 1e-10  #: what is left of a transient that is over


def latency(scenario: Scenario) -> int:
    """The latency in video periods, d, once it is clear that the experiments can be made.

    Errors: `InputError` where it is no whole number, or where the law cannot tell all motions apart
    even at the start.
    """
    frames = scenario.latency_frames
    status = run(scenario, 1, kind="hold").status
    if not status.ok:
        raise InputError(f"{scenario.name}: no experiment can be made here. {status.sentence}")
    return frames


def nearest_depth(scenario: Scenario) -> float:
    """Depth of the nearest point of the target at the start, m: the length that counts as one."""
    oTc = scenario.reference.pose(0.0)
    points = np.array(scenario.target.points)
    cTo = inverse(oTc)
    return float((points @ cTo[2, :3] + cTo[2, 3]).min())


def scales(scenario: Scenario) -> Array:
    """What one unit of each entry of a twist counts for, (6,): translations in nearest depths."""
    return np.array([nearest_depth(scenario)] * 3 + [1.0] * 3)


def run(scenario: Scenario, frames: int, **changes: Any) -> Run:
    """A run of the frames 0 … `frames` without noise, with some fields changed."""
    changes = {"offset": (0.0,) * 6, "noise_px": 0.0} | changes
    return simulate(scenario.with_(duration=frames * scenario.vision.period, **changes))


def released(scenario: Scenario, offset: Array, frames: int, **changes: Any) -> Run:
    """A run with the reference at rest and the camera let go beside it, `offset` (6,) in m, rad."""
    there = tuple(float(entry) for entry in offset)
    return run(scenario, frames, kind="hold", offset=there, **changes)


def characteristic(scenario: Scenario, ratio: float, gain: float | None = None) -> Array:
    """Coefficients of z^{d+1} − z^d + κλTₛ, highest power first, κ = `ratio`, λ in s⁻¹."""
    known = {
        d: scenario.latency_frames,
        kappa: ratio,
        lam: scenario.law.lam if gain is None else gain,
        T_s: scenario.vision.period,
    }
    found = sampled_characteristic().subs(known).as_poly(z_plane).all_coeffs()
    return np.array([float(c) for c in found])


def dominant(polynomial: Array) -> complex:
    """The root of largest modulus, of a pair the one above the real axis."""
    roots = np.roots(polynomial)
    largest = roots[np.argmax(np.abs(roots))]
    return complex(largest.real, abs(largest.imag))


def ratios(scenario: Scenario) -> tuple[float, ...]:
    """κ in all six directions: depth errors act on translations, rotations are answered with 1."""
    return tuple(dict.fromkeys((scenario.law.depth_ratio, 1.0)))


def settling(scenario: Scenario, what: str) -> tuple[int, float]:
    """Frames until the transient is over, and the share that is left of it then.

    Errors: `InputError` where the loop is not stable as sampled, so that nothing settles.
    """
    period, tau = scenario.vision.period, scenario.vision.latency
    late = latency(scenario)
    limit = float(loop.gain_limit(tau, period=period, kappa=max(ratios(scenario))))
    if not scenario.law.lam < limit:
        raise InputError(
            f"law.lam: {scenario.law.lam:g} s⁻¹ is not below the limit of {limit:.4g} s⁻¹ at "
            f"{1e3 * period:g} ms sampling, so there is no steady {what}; lower it."
        )
    modulus = max(abs(dominant(characteristic(scenario, ratio))) for ratio in ratios(scenario))
    needed = math.log(ENDED) / math.log(modulus) if modulus > 1e-3 else 4.0
    frames = min(math.ceil(needed) + 2 * late, MOST_FRAMES)
    return frames, max(modulus**frames, ENDED)
