"""What the experiments have in common: rest, transients, and the modes that theory predicts.

All start at the scenario's start pose, before its target, with its law (10) and its timing; only
the motion, the offset and the length of the run are theirs. Noise, limits, distortion and whatever
else a scenario may have besides is left out (`Scenario.ideal`): it would hide what is measured.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vsctrl import loop, timing
from vsctrl.errors import InputError
from vsctrl.loop import fraction
from vsctrl.loop.limits import sampled_characteristic
from vsctrl.servo import Run, Scenario, simulate
from vsctrl.servo.plant.camera import Camera
from vsctrl.servo.pose import inverse
from vsctrl.symbols import T_s, d, kappa, lam, z_plane

Array = NDArray[np.float64]

MOST_FRAMES = 4000  #: the longest wait for a transient to end
ENDED = 1e-10  #: what is left of a transient that is over
ALIKE = 1e-9  #: relative, below which two eigenvalues or two depths are one


class Kind(NamedTuple):
    """Directions in which figure 1 has one κ: their name, κ, and one of them, (6,) in m and rad."""

    name: str
    ratio: complex
    direction: Array


def latency(scenario: Scenario) -> int:
    """The latency in video periods, d, once it is clear that the experiments can be made.

    Errors: `InputError` where it is no whole number, or where the law cannot tell all motions apart
    even at the start.
    """
    frames = scenario.latency_frames
    possible(scenario)
    return frames


def possible(scenario: Scenario) -> None:
    """Errors: `InputError` where the law cannot tell all motions apart even at the start."""
    status = run(scenario, 1, kind="hold").status
    if not status.ok:
        raise InputError(f"{scenario.name}: no experiment can be made here. {status.sentence}")


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
    """A run of the frames 0 … `frames` of the ideal experiment, with some fields changed."""
    ideal = scenario.ideal
    return simulate(ideal.with_(duration=frames * scenario.vision.period, **changes))


def released(scenario: Scenario, offset: Array, frames: int, **changes: Any) -> Run:
    """A run with the reference at rest and the camera let go beside it, `offset` (6,) in m, rad."""
    there = tuple(float(entry) for entry in offset)
    return run(scenario, frames, kind="hold", offset=there, **changes)


# What the law believes --------------------------------------------------------------------------
def calibration(scenario: Scenario) -> Array:
    """M = L̂⁺L of the scenario's wrong depths and focal length, (6, 6).

    In closed form for wrong depths, and for a wrong focal length if all points have one depth; else
    by L̂ and L at the start.
    """
    ratio, phi = scenario.law.depth_ratio, scenario.calibration.focal_ratio
    depths_wrong = np.asarray(loop.depth_error_matrix(ratio), dtype=np.float64)
    if phi == 1:
        return depths_wrong
    camera = Camera(scenario.camera.Fx, scenario.camera.Fy)
    points = np.array(scenario.target.points)
    image, depths = camera.view(scenario.reference.pose(0.0), points)
    if np.ptp(depths) < ALIKE * depths.min():
        focal_wrong = loop.focal_error_matrix(phi, float(depths[0]))
        return np.asarray(depths_wrong @ focal_wrong, dtype=np.float64)
    believed = Camera(phi * camera.Fx, phi * camera.Fy)
    L, L_hat = camera.interaction(image, depths), believed.interaction(image, ratio * depths)
    return np.asarray(np.linalg.lstsq(L_hat, L, rcond=None)[0])


def sideways_ratio(scenario: Scenario) -> float:
    """κ of a motion sideways at constant depth, exactly: M answers it with ρ/φ and nothing else."""
    return scenario.law.depth_ratio / scenario.calibration.focal_ratio


def kinds(scenario: Scenario) -> tuple[Kind, ...]:
    """The directions that M = L̂⁺L leaves as they are, and by how much each is answered.

    With wrong depths alone they are the translations, κ = ρ, and the rotations, κ = 1. A pair of
    complex eigenvalues is named by the one above the real axis, with the real part of its vector.
    """
    unit, ratio = scales(scenario), scenario.law.depth_ratio
    if scenario.calibration.focal_ratio == 1:
        if ratio == 1:
            return (Kind("", 1.0, unit),)
        axes = np.repeat([[1.0, 0.0], [0.0, 1.0]], 3, axis=0).T * unit
        return (Kind("translation", ratio, axes[0]), Kind("rotation", 1.0, axes[1]))
    values, vectors = np.linalg.eig(calibration(scenario) * unit / unit[:, None])
    found: list[Kind] = []
    for value, vector in zip(values, vectors.T, strict=True):
        mu = complex(value) if abs(value.imag) > ALIKE * abs(value) else float(value.real)
        if mu.imag < 0 or any(abs(mu - kind.ratio) < ALIKE * abs(mu) for kind in found):
            continue
        found.append(Kind(f"κ = {mu:.4g}", mu, np.real(vector) * unit))
    return tuple(sorted(found, key=lambda kind: (kind.ratio.real, kind.ratio.imag)))


def ratios(scenario: Scenario) -> tuple[complex, ...]:
    """κ in all six directions: the eigenvalues of M, each once."""
    return tuple(kind.ratio for kind in kinds(scenario))


def critical_ratio(scenario: Scenario) -> complex:
    """The κ of the direction that is unstable first, as sampled."""
    late, period = scenario.vision.latency, scenario.vision.period
    return min(ratios(scenario), key=lambda mu: loop.gain_limit(late, period=period, kappa=mu))


def gain_limit(scenario: Scenario, *, sampled: bool = True) -> float:
    """λ (s⁻¹) from which on the loop is unstable in some direction, held over a frame or not."""
    period = scenario.vision.period if sampled else None
    late = scenario.vision.latency
    return min(float(loop.gain_limit(late, period=period, kappa=mu)) for mu in ratios(scenario))


# Modes ------------------------------------------------------------------------------------------
def characteristic(
    scenario: Scenario, ratio: complex, gain: float | None = None
) -> NDArray[np.inexact[Any]]:
    """Coefficients of z^{d+1} − z^d + κλTₛ, highest power first, κ = `ratio`, λ in s⁻¹.

    Of `loop.fraction` where the latency is no whole number of periods.
    """
    gain = scenario.law.lam if gain is None else gain
    period, late = scenario.vision.period, scenario.vision.latency
    samples = timing.whole_periods(late, period)
    if samples is None:
        none, one = (fraction.characteristic(late / period, share) for share in (0.0, 1.0))
        return none + ratio * gain * period * (one - none)
    known = {d: samples, kappa: ratio, lam: gain, T_s: period}
    found = sampled_characteristic().subs(known).as_poly(z_plane).all_coeffs()
    polynomial = np.array([complex(c) for c in found])
    return polynomial if polynomial.imag.any() else polynomial.real


def dominant(polynomial: NDArray[np.inexact[Any]]) -> complex:
    """The root of largest modulus, of a pair the one above the real axis."""
    roots = np.roots(polynomial)
    largest = roots[np.argmax(np.abs(roots))]
    return complex(largest.real, abs(largest.imag))


def settling(scenario: Scenario, what: str) -> tuple[int, float]:
    """Frames until the transient is over, and the share that is left of it then.

    Errors: `InputError` where the loop is not stable as sampled, so that nothing settles.
    """
    possible(scenario)
    late = timing.first_frame(scenario.vision.latency, scenario.vision.period)
    limit = gain_limit(scenario)
    if not scenario.law.lam < limit:
        raise InputError(
            f"law.lam: {scenario.law.lam:g} s⁻¹ is not below the limit of {limit:.4g} s⁻¹ at "
            f"{1e3 * scenario.vision.period:g} ms sampling, so there is no steady {what}; lower it."
        )
    return ended(max(abs(dominant(characteristic(scenario, mu))) for mu in ratios(scenario)), late)


def ended(modulus: float, late: int) -> tuple[int, float]:
    """Frames until a mode of this modulus is over, and the share that is left of it then."""
    needed = math.log(ENDED) / math.log(modulus) if modulus > 1e-3 else 4.0
    frames = min(math.ceil(needed) + 2 * late, MOST_FRAMES)
    return frames, max(modulus**frames, ENDED)
