"""The modes that theory predicts: M = L̂⁺L, its eigen-directions, and the roots of the sampled loop.

A wrong depth or focal length makes M other than the identity; along each of its eigen-directions
the loop is that of figure 1, with κ the eigenvalue.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vsctrl import loop, timing
from vsctrl.arrays import Array
from vsctrl.loop import fractional_delay
from vsctrl.loop.limits import sampled_characteristic
from vsctrl.servo import Scenario
from vsctrl.servo.camera.camera import Camera
from vsctrl.servo.pose import inverse
from vsctrl.symbols import T_s, d, kappa, lam, z_plane

ALIKE = 1e-9  #: relative, below which two eigenvalues or two depths are one


class EigenDirection(NamedTuple):
    """Directions in which figure 1 has one κ: name, κ, and one of them, (6,) in m and rad."""

    name: str
    eigenvalue: complex
    direction: Array


def nearest_depth(scenario: Scenario) -> float:
    """Depth of the nearest point of the target at the start, m: the length that counts as one."""
    oTc = scenario.reference.pose(0.0)
    points = np.array(scenario.target.points)
    cTo = inverse(oTc)
    return float((points @ cTo[2, :3] + cTo[2, 3]).min())


def scales(scenario: Scenario) -> Array:
    """What one unit of each entry of a twist counts for, (6,): translations in nearest depths."""
    return np.array([nearest_depth(scenario)] * 3 + [1.0] * 3)


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


def eigen_directions(scenario: Scenario) -> tuple[EigenDirection, ...]:
    """The directions that M = L̂⁺L leaves as they are, and by how much each is answered.

    With wrong depths alone they are the translations, κ = ρ, and the rotations, κ = 1. A pair of
    complex eigenvalues is named by the one above the real axis, with the real part of its vector.
    """
    unit, ratio = scales(scenario), scenario.law.depth_ratio
    if scenario.calibration.focal_ratio == 1:
        if ratio == 1:
            return (EigenDirection("", 1.0, unit),)
        axes = np.repeat([[1.0, 0.0], [0.0, 1.0]], 3, axis=0).T * unit
        return (
            EigenDirection("translation", ratio, axes[0]),
            EigenDirection("rotation", 1.0, axes[1]),
        )
    values, vectors = np.linalg.eig(calibration(scenario) * unit / unit[:, None])
    directions: list[EigenDirection] = []
    for value, vector in zip(values, vectors.T, strict=True):
        mu = complex(value) if abs(value.imag) > ALIKE * abs(value) else float(value.real)
        if mu.imag < 0 or any(abs(mu - each.eigenvalue) < ALIKE * abs(mu) for each in directions):
            continue
        directions.append(EigenDirection(f"κ = {mu:.4g}", mu, np.real(vector) * unit))
    return tuple(sorted(directions, key=lambda each: (each.eigenvalue.real, each.eigenvalue.imag)))


def eigenvalues(scenario: Scenario) -> tuple[complex, ...]:
    """κ in all six directions: the eigenvalues of M = L̂⁺L, each once."""
    return tuple(each.eigenvalue for each in eigen_directions(scenario))


def critical_eigenvalue(scenario: Scenario) -> complex:
    """The κ of the direction that is unstable first, as sampled."""
    tau, period = scenario.vision.latency, scenario.vision.period
    return min(eigenvalues(scenario), key=lambda mu: loop.gain_limit(tau, period=period, kappa=mu))


def gain_limit(scenario: Scenario, *, sampled: bool = True) -> float:
    """λ (s⁻¹) from which on the loop is unstable in some direction, held over a frame or not."""
    period = scenario.vision.period if sampled else None
    tau = scenario.vision.latency
    return min(float(loop.gain_limit(tau, period=period, kappa=mu)) for mu in eigenvalues(scenario))


# Modes ------------------------------------------------------------------------------------------
def characteristic(scenario: Scenario, mu: complex) -> NDArray[np.inexact[Any]]:
    """Coefficients of z^{d+1} − z^d + κλTₛ, highest power first, κ = `mu`.

    Of `loop.fractional_delay` where the latency is no whole number of periods.
    """
    gain = scenario.law.lam
    period, latency = scenario.vision.period, scenario.vision.latency
    samples = timing.whole_periods(latency, period)
    if samples is None:
        without, unit = (fractional_delay.characteristic(latency / period, g) for g in (0.0, 1.0))
        return without + mu * gain * period * (unit - without)
    known = {d: samples, kappa: mu, lam: gain, T_s: period}
    coefficients = sampled_characteristic().subs(known).as_poly(z_plane).all_coeffs()
    polynomial = np.array([complex(c) for c in coefficients])
    return polynomial if polynomial.imag.any() else polynomial.real


def dominant(polynomial: NDArray[np.inexact[Any]]) -> complex:
    """The root of largest modulus, of a pair the one above the real axis."""
    roots = np.roots(polynomial)
    largest = roots[np.argmax(np.abs(roots))]
    return complex(largest.real, abs(largest.imag))
