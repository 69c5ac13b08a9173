"""The directions in which a loop of six degrees of freedom falls apart: M and its eigenvalues."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vsctrl.arrays import Array

if TYPE_CHECKING:
    from vsctrl.servo import Scenario

ALIKE = 1e-6  #: relative, below which two κ are one: those of a defective M are that far apart
NOTHING = 1e-6  #: share of an eigenvector that is rounding
AXES = ("Vx", "Vy", "Vz", "Ωx", "Ωy", "Ωz")


@dataclass(frozen=True, eq=False)
class Direction:
    """A direction, or several with one κ: `vectors` (n, 6) in depths and rad span it."""

    name: str
    kappa: complex
    vectors: Array


def directions(scenario: Scenario, M: Array) -> tuple[Direction, ...]:
    """Of M, (6, 6) in m and rad: each κ once, in rising order; of a pair the one above the axis."""
    from vsctrl.servo.diagnosis.linearised import lengths

    unit = lengths(scenario)
    kappas, V = np.linalg.eig(M * unit / unit[:, None])
    groups: list[tuple[complex, list[Array]]] = []
    for kappa, vector in sorted(
        zip(kappas, V.T, strict=True), key=lambda pair: (pair[0].real, pair[0].imag)
    ):
        value = complex(kappa) if abs(kappa.imag) > ALIKE * abs(kappa) else complex(kappa.real)
        if value.imag < 0:
            continue
        for known, vectors in groups:
            if abs(value - known) <= ALIKE * abs(known):
                vectors.append(vector)
                break
        else:
            groups.append((value, [vector]))
    if len(groups) == 1 and not groups[0][0].imag:
        return (Direction("every direction", groups[0][0], np.eye(6)),)
    return tuple(Direction(_name(k, np.array(v)), k, np.array(v)) for k, v in groups)


def _name(kappa: complex, vectors: Array) -> str:
    """By the axes that it moves along, where these are few, or else by κ."""
    used = np.abs(vectors).max(axis=0) > NOTHING
    if used[:3].any() and not used[3:].any():
        return "translation" if used.sum() == 3 else "translation " + _axes(used)
    if used[3:].any() and not used[:3].any():
        return "rotation" if used.sum() == 3 else "rotation " + _axes(used)
    return f"κ = {kappa.real:.4g}" if not kappa.imag else f"κ = {kappa:.4g}"


def _axes(used: Array) -> str:
    return "along " + ", ".join(n for n, u in zip(AXES, used, strict=True) if u)
