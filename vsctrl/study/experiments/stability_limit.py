"""The stability limit found in six degrees of freedom, against its closed form.

The camera is let go a little beside a reference at rest, and the gain at which its distance neither
grows nor decays is searched for, from a gain on that has nothing to do with theory.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from scipy.optimize import brentq

from vsctrl import loop
from vsctrl.arrays import Array
from vsctrl.checks import quoted
from vsctrl.errors import InputError
from vsctrl.keywords import keywords
from vsctrl.servo import Scenario
from vsctrl.servo.scenario import GivenScenario, as_scenario
from vsctrl.study.experiments.experiment import Experiment, Measured
from vsctrl.study.modes import eigen_directions, eigenvalues, gain_limit, scales
from vsctrl.study.runs import latency, released

OFFSET = 1e-6  #: of the nearest depth, and rad
FRAMES = 200  #: of a run, times d + 1; in its first third other modes die out
LONGER = 8  #: times as many where M has complex eigenvalues: two modes are then nearly alike
NEAR = 1.1  #: of the least limit, up to which another direction's mode takes long to die out
GROWN, DIED = 1e3, 1e-6  #: times the start: decided, and the run is as good as linear so far
WIDTH = 1e-7  #: relative, at which the search for the limit ends
ALLOWED = 1e-5
FIRST = 0.3  #: gain per frame at which the search begins
OCTAVES = 12  #: how often the gain is doubled or halved to bracket the limit
DEPTH_RATIOS = (0.8, 1.25)
REASON = "1e−5 of it: an offset of 1e−6 depths bends the law by as much, the fit adds 1e−7"


@dataclass(frozen=True, repr=False)
class StabilityEdge(Experiment):
    """Gain limits λ_max in s⁻¹: π/(2κτ), 2 sin(π/(2(2d + 1)))/(κTₛ), and as it was found.

    >>> found = vs.study.stability_edge(vs.paper.sliding(), frames=(2,), depth_ratios=())
    >>> found.agrees
    True
    """

    title: ClassVar[str] = "gain limit found by letting the camera go beside its reference, s⁻¹"
    form: ClassVar[str] = ".6f"


@keywords
def stability_edge(
    scenario: GivenScenario,
    frames: tuple[int, ...] = (0, 1, 2, 3),
    depth_ratios: tuple[float, ...] = DEPTH_RATIOS,
) -> StabilityEdge:
    """The gain at which a small offset neither grows nor decays, in the simulator.

    Rows: each latency of `frames` video periods with the scenario's depth ratio ρ, then its own
    latency with each of `depth_ratios`; κ = max(ρ, 1), since rotations are answered with 1, and
    with a wrong focal length the eigenvalue of M = L̂⁺L that is met first.
    Agreement is asked with the sampled limit; the continuous one is shown beside it.
    Errors: `InputError` where a latency is no whole number of frames, or a ratio not above 0.

    >>> found = vs.study.stability_edge(vs.paper.sliding(), frames=(2,), depth_ratios=())
    >>> print(round(found.rows[0].exact, 3))
    15.451
    """
    scenario = as_scenario(scenario)
    own = latency(scenario)
    for d in frames:
        if isinstance(d, bool) or not isinstance(d, int) or d < 0:
            raise InputError(f"frames: {quoted(d)} is no number of video periods; give 0, 1, 2, ….")
    cases = [(d, scenario.law.depth_ratio) for d in frames]
    cases += [(own, ratio) for ratio in depth_ratios]
    period = scenario.vision.period
    scenarios = [scenario.with_(latency=d * period, depth_ratio=ratio) for d, ratio in cases]
    return StabilityEdge(scenario, tuple(_row(case) for case in scenarios))


def _row(scenario: Scenario) -> Measured:
    d, ratio = scenario.latency_frames, scenario.law.depth_ratio
    exact = gain_limit(scenario)
    tau, period = scenario.vision.latency, scenario.vision.period
    frames = FRAMES * (LONGER if any(mu.imag for mu in eigenvalues(scenario)) else 1)

    def expected(mu: complex) -> float:
        return float(loop.gain_limit(tau, period=period, kappa=mu))

    limit = simulated_limit(scenario, expected, WIDTH, frames=frames)
    return Measured(
        case=f"{d} frame{'' if d == 1 else 's'} late, depth ratio {ratio:g}",
        predicted=gain_limit(scenario, sampled=False),
        exact=exact,
        simulated=limit,
        allowed=ALLOWED * exact,
        reason=REASON,
        note="" if limit is not None else "no change between growth and decay at any gain tried",
    )


def simulated_limit(
    scenario: Scenario, expected: Callable[[complex], float], width: float, **options: Any
) -> float | None:
    """The gain (s⁻¹) at which a small offset neither grows nor decays, to `width` of it.

    `expected`: the limit by theory for an eigenvalue of M; `options`: of `growth`. None where there
    is no such gain.
    """
    offsets = offsets_of(scenario, expected)

    def rate(gain: float) -> float:
        return max(growth(scenario, gain, along, **options) for along in offsets)

    return search(rate, FIRST / scenario.vision.period, width=width)


def offsets_of(scenario: Scenario, limit: Callable[[complex], float]) -> tuple[Array, ...]:
    """The offsets, (6,) in depths and rad, to let the camera go at, one after the other.

    All directions at once, or those of which `limit` of their κ is nearly the least one by one:
    modes that are nearly as slow as the slowest would take as long to die out beside it.
    """
    limits = [(limit(each.eigenvalue), each.direction) for each in eigen_directions(scenario)]
    least = min(value for value, _ in limits)
    near = tuple(direction for value, direction in limits if value <= NEAR * least)
    return near if len(near) > 1 else (scales(scenario),)


def search(
    rate: Callable[[float], float], first: float, octaves: int = OCTAVES, width: float = WIDTH
) -> float | None:
    """The gain at which the rate of growth is zero, to `width` of it, from `first` (s⁻¹) on.

    It is bracketed by doubling or halving; None where the rate has one sign at all gains tried.
    """
    gain, grows = first, rate(first) > 0
    for _ in range(octaves):
        other = gain / 2 if grows else 2 * gain
        if (rate(other) > 0) != grows:
            low, high = sorted((gain, other))
            return float(brentq(rate, low, high, rtol=width))
        gain = other
    return None


def growth(
    scenario: Scenario,
    gain: float,
    along: Array,
    memory: int | None = None,
    *,
    frames: int = FRAMES,
    **changes: Any,
) -> float:
    """Rate at which a small offset `along` (6,) grows, per frame (ln), at a gain in s⁻¹.

    Negative is decay. The size of the loop's memory, the lags of the last d + 1 frames together (or
    of `memory` frames), does not swing as the lag itself does. Its logarithm is fitted with a line
    through the later of `frames` times as many frames, under a window that lets no rest of a swing
    through; where it leaves the range in which that makes sense before, the rate so far is taken.
    `changes` are fields of the scenario.
    """
    unit = scales(scenario)
    memory = scenario.latency_frames + 1 if memory is None else memory
    run = released(scenario, OFFSET * along, frames * memory, lam=gain, **changes)
    square = np.convolve(((run.lag / unit) ** 2).sum(axis=1), np.ones(memory), "valid")
    size = 0.5 * np.log(np.maximum(square, 1e-300) / square[0])
    out = np.flatnonzero((size > math.log(GROWN)) | (size < math.log(DIED)))
    if out.size:
        return float(size[out[0]] / out[0])
    if not run.status.complete:
        return math.log(GROWN) / len(size)
    later = size[len(size) // 3 :]
    k = np.linspace(-1, 1, len(later))
    weight = np.cos(np.pi * k / 2) ** 2
    slope = (weight * k) @ later / ((weight * k) @ k)
    return float(slope * 2 / (len(later) - 1))
