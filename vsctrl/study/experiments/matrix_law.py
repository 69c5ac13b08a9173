"""The 1/λ law as a matrix, ξ = τT* − (λM)⁻¹(I − k_ff M)T*, measured in the simulator.

The law is the linear part of a curved world: for a slide at constant depth it holds as it stands,
for other motions the lag differs from it by the square of the twist. So each motion is run at full,
half, a quarter and an eighth of its twist, and the lag per twist is extrapolated to none
(Richardson): that has to be the law. The difference at full twist is shown, with the power at which
it falls. M = L̂⁺L is that of wrong depths, of a wrong focal length, which takes a rotation partly
for a translation, and of both.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from vsctrl import loop
from vsctrl.arrays import Array
from vsctrl.keywords import keywords
from vsctrl.servo import Scenario
from vsctrl.servo.scenario import GivenScenario, as_scenario
from vsctrl.study.experiments.experiment import Experiment, Measured
from vsctrl.study.modes import calibration, scales
from vsctrl.study.runs import run, settling

#: Directions of the reference twist (V, Ω), in nearest depths and rad.
MOTIONS = {
    "slide along x": (1.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    "approach along z": (0.0, 0.0, 1.0, 0.0, 0.0, 0.0),
    "turn about y": (0.0, 0.0, 0.0, 0.0, 1.0, 0.0),
    "roll about z": (0.0, 0.0, 0.0, 0.0, 0.0, 1.0),
    "screw, all six": (0.5, -0.4, 0.3, 0.4, 0.5, -0.3),
}
EXACT = "slide along x"
WAY = 0.1  #: of each motion at full twist, in nearest depths and rad
DEPTH_RATIO = 0.8  #: where the scenario's own is 1, which would make M no matrix to speak of
FOCAL_RATIO = 1.1  #: where the scenario's own is 1
SHARES = (1, 2, 4, 8)  #: of the full twist, as divisors, to extrapolate from
ROUNDING = 1e-11  #: of a lag, in nearest depths and rad


@dataclass(frozen=True, kw_only=True)
class LagRow(Measured):
    """A steady lag: its size, positive ahead and negative behind, and the vectors behind it.

    `twist`: the reference's, (V, Ω). `law`, `as_run` and `linear`: (v, ω) of the law, of the run at
    that twist, and of the runs extrapolated to no twist and scaled back, six numbers in m and rad.
    Sizes count a rotation at the nearest depth. The table shows `as_run` first, then the law and
    `linear`, which must agree. `order` is the power of the twist at which `as_run` leaves the law,
    None where it does not; `curvature` by how much, m. `depth_ratio` ρ and `focal_ratio` φ make M.

    >>> vs.study.matrix_law(vs.paper.sliding()).rows[0].motion
    'slide along x'
    """

    motion: str
    depth_ratio: float
    focal_ratio: float
    twist: tuple[float, ...]
    law: tuple[float, ...]
    as_run: tuple[float, ...] | None
    linear: tuple[float, ...] | None
    difference: float  #: of linear and law, m
    curvature: float | None
    order: float | None

    @property
    def disagreement(self) -> float:
        """The size of the difference between the law and the linear part of the lag, m."""
        return self.difference if math.isfinite(self.difference) else math.inf


@dataclass(frozen=True, repr=False)
class MatrixLaw(Experiment):
    """Steady lags in six degrees of freedom, sizes in m: as run, by the law, and its linear part.

    `depth_ratio` is the ρ of M = diag(ρ, ρ, ρ, 1, 1, 1), `focal_ratio` the φ of the rows that
    name it.

    >>> len(vs.study.matrix_law(vs.paper.sliding()).rows)
    50
    """

    rows: tuple[LagRow, ...]
    depth_ratio: float
    focal_ratio: float

    title: ClassVar[str] = (
        "steady lag by the matrix law, mm, + ahead, − behind; rotations count at the nearest depth"
    )
    columns: ClassVar[tuple[str, str, str]] = ("6-DOF as run", "matrix law", "6-DOF, T* → 0")
    scale: ClassVar[float] = 1e3


@keywords
def matrix_law(
    scenario: GivenScenario, depth_ratio: float | None = None, focal_ratio: float | None = None
) -> MatrixLaw:
    """The steady lag of five motions with every placement, with and without feed-forward.

    ξ = τT* − (λM)⁻¹(I − k_ff M)T*, M = diag(ρ, ρ, ρ, 1, 1, 1); `depth_ratio` is ρ, by default the
    scenario's own, or 0.8 where that is 1. With the scenario's placement also for a focal length
    F̂ = φF, with and without the wrong depths; `focal_ratio` is φ, by default the scenario's own, or
    1.1 where that is 1. M is then `loop.focal_error_matrix` if all points have one depth at the
    start, else L̂⁺L there. k_ff is the scenario's, 1 where it has none.
    Errors: `InputError` where the loop is unstable as sampled, the latency is no whole number of
    frames, a ratio is not above 0, or a motion at this start would lose the target.

    >>> vs.study.matrix_law(vs.paper.sliding()).agrees
    True
    """
    scenario = as_scenario(scenario)
    ratio = _other_than_1(depth_ratio, scenario.law.depth_ratio, DEPTH_RATIO)
    phi = _other_than_1(focal_ratio, scenario.calibration.focal_ratio, FOCAL_RATIO)
    own = scenario.law.placement
    every = ("measurement", "aligned", "actuator") if scenario.vision.latency else (own,)
    on = scenario.law.k_ff or 1.0
    rows: list[LagRow] = []
    for rho, focal, placements in ((ratio, 1.0, every), (1.0, phi, (own,)), (ratio, phi, (own,))):
        given = scenario.with_(depth_ratio=rho, focal_ratio=focal)
        rows += [
            _row(given.with_(k_ff=k_ff, placement=placement), motion)
            for k_ff, placement, motion in itertools.product((0.0, on), placements, MOTIONS)
        ]
    return MatrixLaw(scenario, tuple(rows), ratio, phi)


def _other_than_1(ratio: float | None, own: float, else_: float) -> float:
    if ratio is not None:
        return ratio
    return own if own != 1 else else_


def _row(scenario: Scenario, motion: str) -> LagRow:
    law, unit = scenario.law, scales(scenario)
    frames, remaining = settling(scenario, "lag")
    twist = np.array(MOTIONS[motion]) * unit * WAY / (frames * scenario.vision.period)
    M, focal = calibration(scenario), scenario.calibration.focal_ratio
    values = {"lam": law.lam, "k_ff": law.k_ff, "tau": scenario.vision.latency}
    expected = np.asarray(loop.steady_lag(loop.diagram(law.placement), M, twist, **values))
    start = size(twist, unit) * (1 / law.lam + scenario.vision.latency)
    allowed = 10 * remaining * start + ROUNDING * float(unit[0])

    lags = [_lag(scenario, twist / divisor, frames) for divisor in SHARES]
    known = [lag for lag in lags if lag is not None]
    failed = len(known) < len(lags)
    as_run = linear = curvature = order = None
    reason = "exact: rounding and what is left of the transient"
    if not failed:
        as_run = linear = known[0]
        curvature = size(as_run - expected, unit)
        if motion != EXACT:
            linear, last_step = _extrapolated(known)
            allowed += size(last_step, unit)
            rest = size(known[1] - expected / SHARES[1], unit)
            order = math.log2(curvature / rest) if curvature > 10 * allowed and rest else None
            reason = _bend(curvature, order)

    def length(lag: Array) -> float:
        return math.copysign(size(lag, unit), (lag / unit) @ (twist / unit))

    name = f"{motion}, {'with' if law.k_ff else 'without'} k_ff"
    name += f", {law.placement}" if scenario.vision.latency else ""
    if focal != 1:
        name += f", depth ratio {law.depth_ratio:g}" if law.depth_ratio != 1 else ""
        name += f", focal ratio {focal:g}"
    return LagRow(
        case=name,
        predicted=None if as_run is None else length(as_run),
        exact=length(expected),
        simulated=None if linear is None else length(linear),
        allowed=allowed,
        reason=reason,
        note="a run failed" if failed else "",
        motion=motion,
        depth_ratio=law.depth_ratio,
        focal_ratio=focal,
        twist=tuple(twist.tolist()),
        law=tuple(expected.tolist()),
        as_run=None if as_run is None else tuple(as_run.tolist()),
        linear=None if linear is None else tuple(linear.tolist()),
        difference=math.inf if linear is None else size(linear - expected, unit),
        curvature=curvature,
        order=order,
    )


def _bend(curvature: float, order: float | None) -> str:
    if order is None:
        return "linear as run; allowed: rounding, transient and extrapolation"
    return (
        f"as run it bends by {1e3 * curvature:.2g} mm, as twist^{order:.2f}; "
        "allowed: the extrapolation's own estimate"
    )


def _extrapolated(lags: list[Array]) -> tuple[Array, Array]:
    """The part of the lag linear in the twist, at full twist, and the last step towards it.

    `lags` are those at 1, 1/2, 1/4, … of the twist. The lag per twist is a power series in it, and
    each pass removes the lowest power left.
    """
    table = [divisor * lag for divisor, lag in zip(SHARES, lags, strict=True)]
    before = table[-1]
    for power in range(1, len(lags)):
        before = table[-1]
        table = [
            (2**power * finer - coarser) / (2**power - 1)
            for coarser, finer in itertools.pairwise(table)
        ]
    return table[0], table[0] - before


def _lag(scenario: Scenario, twist: Array, frames: int) -> Array | None:
    """The lag at the end of a run with a constant twist, None where the run failed."""
    V, Omega = tuple(twist[:3].tolist()), tuple(twist[3:].tolist())
    result = run(scenario, frames, kind="screw", V=V, Omega=Omega)
    return result.lag[-1] if result.status.complete else None


def size(twist: Array, unit: Array) -> float:
    """Length of a twist in m, rotations at the nearest depth."""
    return float(np.linalg.norm(twist / unit) * unit[0])
