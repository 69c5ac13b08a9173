"""Every remedy for dead time side by side: what it leaves of the error, and what gain it allows.

The error on a ramp is known in closed form from each remedy's own diagram, by the exact response of
that diagram, and in six degrees of freedom, where the camera follows a sideways slide: there the
one-dimensional loop is exact, so that all three must agree to rounding. The error that the law
itself sees is shown beside it, since some remedies satisfy the law and not the user. The gain limit
is that of continuous time, that with the twist held over a frame, and as found by letting the
camera go beside its reference.
"""

from __future__ import annotations

import math

import numpy as np

from vsctrl import checks as check
from vsctrl import loop, timing
from vsctrl.diagram import Ramp
from vsctrl.errors import InputError
from vsctrl.keywords import keywords
from vsctrl.servo import Scenario
from vsctrl.servo.camera.camera import Camera
from vsctrl.servo.scenario import GivenScenario, as_scenario
from vsctrl.study import modes, runs
from vsctrl.study.compensation.compensators import Remedy, remedies
from vsctrl.study.compensation.results import Remedies, SteadyError, Treated
from vsctrl.study.experiments import stability_limit
from vsctrl.study.experiments.experiment import Measured

MOST_WRONG = 100  #: video periods
WAY = 0.3  #: longest slide, in nearest depths; a longer one is made slower and its error scaled
ROUNDING = 1e-11  #: of the nearest depth
EXPONENT = 24.0  #: e⁻²⁴ is what is left of a transient that is over
EXACT = "exact for a slide: rounding and what is left of the transient"

# The search for a limit in six degrees of freedom.
SEARCHED = 1e-5  #: relative, to which it goes on
FRAMES = 120  #: of one run, times the frames that the loop remembers, and …
LONGER = 3  #: … times as many where M has complex eigenvalues: two modes are then nearly alike
ALLOWED, ALLOWED_ALIKE = 1e-4, 1e-3  #: of a limit
FOUND = {
    ALLOWED: "1e−4 of it: the fit to a run of few hundred frames",
    ALLOWED_ALIKE: "1e−3 of it: complex κ and conjugate, two modes nearly as slow, blur the fit",
}
ALTERNATES = 1e-6  #: how near a root is to z = −1 that alternates from frame to frame
ALTERNATING = "sampled it alternates from frame to frame, which continuous time does not know"


@keywords
def compare_remedies(
    scenario: GivenScenario,
    mismatch: float | None = None,
    *,
    T_i: float | None = None,
    limits: bool = True,
) -> Remedies:
    """What every remedy for dead time makes of a scenario's latency, by theory and simulation.

    None, alignment, the nulling feed-forward k_ff = (1 − κλτ)/κ, preview by the best h, a late
    actuator fed forward early, PI with `T_i` (s; by default 4/(κλ), but at least 4τ), and a Smith
    predictor. Preview and predictor also with a believed latency τ̂ that is wrong by one video
    period to either side, and by `mismatch` (s). κ = ρ/φ of the scenario's depth and focal ratio.

    The steady errors are those of a sideways slide at the scenario's speed, from its start before
    its target. With `limits` the gain limits are searched for in six degrees of freedom too.
    Everything else that the scenario has, its own remedies included, is left out and named.
    Errors: `InputError` where there is no latency or no translation, for a mismatch or T_i that
    is no number above 0 or a mismatch of over 100 video periods, where the law cannot tell all
    motions apart at the start, and where no remedy is stable.

    >>> vs.study.compare_remedies(vs.paper.sliding()).agrees
    True
    """
    scenario = as_scenario(scenario)
    wrong = _mismatch(scenario, mismatch)
    if T_i is not None:
        loop.pi_gain_limit(scenario.vision.latency, T_i)  # refuses what is no time
    base = _base(scenario)
    runs.possible(base)
    sizes = dict.fromkeys((base.vision.period, wrong))
    rows: list[Treated] = []
    notes = _left_out(scenario)
    for remedy in remedies(base, [side * size for size in sizes for side in (-1, 1)], T_i):
        if isinstance(remedy, str):
            notes.append(remedy[0].upper() + remedy[1:])
        else:
            rows.append(_treated(base, remedy, limits))
    if all(row.error is None for row in rows):
        raise InputError(
            f"law.lam: {base.law.lam:g} s⁻¹ is stable with no remedy at "
            f"{1e3 * base.vision.period:g} ms sampling, so there is nothing to compare; lower it "
            f"below {max(row.limit.exact.real for row in rows):.4g} s⁻¹."
        )
    return Remedies(scenario, base.speed, tuple(rows), (*notes, *_explained(base, rows)))


def _mismatch(scenario: Scenario, mismatch: float | None) -> float:
    """How wrong τ̂ is, s: as given, or one video period."""
    period = scenario.vision.period
    wrong = period if mismatch is None else check.positive("mismatch", mismatch)
    if wrong > MOST_WRONG * period:
        raise InputError(
            f"mismatch = {wrong:g} s is not usable, as it is more than {MOST_WRONG} video periods; "
            f"give how wrong the believed latency is in s, such as {period:g}."
        )
    return wrong


def _base(scenario: Scenario) -> Scenario:
    """The ideal scenario with its latency in the measurement."""
    if not scenario.vision.latency:
        raise InputError(
            "vision.latency: 0 s needs no remedy; give the latency in s, such as latency=0.08."
        )
    if not scenario.speed:
        field = "motion.V" if scenario.motion.kind == "screw" else "motion"
        raise InputError(
            f"{field}: the reference does not translate, so no remedy has an error in metres to "
            f"remedy; give {field} a velocity."
        )
    return scenario.ideal.with_(placement="measurement")


def _left_out(scenario: Scenario) -> list[str]:
    """What the scenario has and the comparison does without, in a sentence."""
    given, kept = (
        side.model_dump(exclude={"name", "description", "sure", "motion"})
        for side in (scenario, scenario.ideal.with_(placement="measurement"))
    )
    names = [
        f"{table}.{key}"
        for table in given
        for key in given[table]
        if given[table][key] != kept[table][key]
    ]
    if not names:
        return []
    return [f"Left out of the scenario, so that remedies stand alone: {', '.join(names)}."]


# One remedy -------------------------------------------------------------------------------------
def _treated(scenario: Scenario, remedy: Remedy, limits: bool) -> Treated:
    mus = modes.eigenvalues(scenario)
    modulus = max(remedy.limits.sampled(mu).modulus(scenario.law.lam) for mu in mus)
    limit = _limit(scenario, remedy, limits)
    # A predictor's own integrator is hidden: in the computer it is a sum without a pole.
    poles = [p for p in remedy.system.poles(6) if remedy.kind != "Smith" or abs(p) > 1e-9]
    rate = -max(p.real for p in poles) if poles else math.inf
    if modulus >= 1 or rate <= 0:
        how = "as sampled" if modulus >= 1 else "in continuous time"
        note = f"Unstable {how} at λ = {scenario.law.lam:g} s⁻¹, so without a steady error"
        return Treated(remedy=remedy, error=None, seen=None, limit=limit, note=note)
    error, seen = _steady(scenario, remedy, modulus, rate)
    return Treated(remedy=remedy, error=error, seen=seen, limit=limit)


def _steady(
    scenario: Scenario, remedy: Remedy, modulus: float, rate: float
) -> tuple[SteadyError, SteadyError]:
    """The steady errors of a sideways slide at the scenario's speed."""
    speed, period, depth = scenario.speed, scenario.vision.period, modes.nearest_depth(scenario)
    frames, remaining = runs.ended(modulus, timing.first_frame(scenario.vision.latency, period))
    most = runs.MOST_FRAMES * period
    t_end = min(EXPONENT / rate, most) + sum(remedy.values.get(n, 0.0) for n in ("tau", "tau_hat"))
    remaining = max(remaining, math.exp(-rate * t_end))
    start = speed * (1 / (remedy.values["ell"] * scenario.law.lam) + scenario.vision.latency)
    allowed = 100 * remaining * start + ROUNDING * max(depth, speed * t_end)
    exact = _exact(remedy, speed, t_end)
    simulated, failure = _simulated(scenario, remedy, frames)
    first, second = (
        SteadyError(
            case=remedy.name,
            predicted=remedy.steady(speed, seen=seen),
            exact=exact[seen],
            simulated=None if simulated is None else simulated[seen],
            allowed=allowed,
            reason=EXACT,
            note=failure,
        )
        for seen in (False, True)
    )
    return first, second


def _exact(remedy: Remedy, speed: float, t: float) -> tuple[float, float]:
    """The true error and the one that the law sees at the time t, by the exact-delay engine."""
    system, ramp = remedy.system, Ramp(speed)

    def at(signal: str) -> float:
        return float(system["S_ref", signal].response(ramp, [t]).y.ravel()[-1])

    goal = at("S_star") if "S_star" in remedy.diagram.signals else speed * t
    return at("S") - goal, -at("e")


def _simulated(
    scenario: Scenario, remedy: Remedy, frames: int
) -> tuple[tuple[float, float] | None, str]:
    """The same two in six degrees of freedom, or why there are none."""
    longest = WAY * modes.nearest_depth(scenario) / (frames * scenario.vision.period)
    speed = min(scenario.speed, longest)
    run = runs.run(
        scenario, frames, kind="screw", V=(speed, 0.0, 0.0), Omega=(0.0,) * 3, **remedy.fields
    )
    if not run.status.complete:
        return None, f"the run ended: {run.status.kind}"
    camera = Camera(scenario.camera.Fx, scenario.camera.Fy)
    L = camera.interaction(run.features[-1], run.depths[-1])
    seen = np.linalg.lstsq(L, run.measured_error[-1], rcond=None)[0][0]
    scale = scenario.speed / speed  # the error of a slide is linear in its speed
    return (float(run.lag[-1, 0] * scale), float(seen * scale)), ""


def _limit(scenario: Scenario, remedy: Remedy, search: bool) -> Measured:
    mus = modes.eigenvalues(scenario)
    smooth = [remedy.limits.continuous(mu) for mu in mus]
    known = [limit for limit in smooth if limit is not None]
    loops = [remedy.limits.sampled(mu) for mu in mus]
    sampled = min(loop.limit for loop in loops)
    roots = np.concatenate([np.roots(loop.at(sampled)) for loop in loops])
    # What is odd about the loop at its limit, if it is, continuous time has nothing of.
    note = ALTERNATING if (np.abs(roots + 1) < ALTERNATES).any() else ""
    simulated = _search(scenario, remedy) if search else None
    tolerance = ALLOWED_ALIKE if any(mu.imag for mu in mus) else ALLOWED
    if search and simulated is None:
        note = "no change between growth and decay"
    return Measured(
        case=remedy.name,
        predicted=min(known) if len(known) == len(smooth) else None,
        exact=sampled,
        simulated=simulated,
        allowed=tolerance * sampled if search else math.inf,
        reason=FOUND[tolerance] if search else "not searched for",
        note=note,
    )


def _search(scenario: Scenario, remedy: Remedy) -> float | None:
    """The gain (s⁻¹) at which a small offset neither grows nor decays with a remedy."""
    period = scenario.vision.period
    longest = max(remedy.values.get(name, 0.0) for name in ("tau", "tau_hat"))
    memory = timing.first_frame(longest, period) + 1
    fields = {name: value for name, value in remedy.fields.items() if name != "k_ff"}
    frames = FRAMES * (LONGER if any(mu.imag for mu in modes.eigenvalues(scenario)) else 1)
    options = {**fields, "memory": memory, "frames": frames}

    def expected(mu: complex) -> float:
        return remedy.limits.sampled(mu).limit

    return stability_limit.simulated_limit(scenario, expected, SEARCHED, **options)


# Words ------------------------------------------------------------------------------------------
def _explained(scenario: Scenario, rows: list[Treated]) -> list[str]:
    """Why the continuous limits are not the sampled ones, in sentences."""
    tau, period = scenario.vision.latency, scenario.vision.period
    plain = next(row.limit for row in rows if row.remedy.kind == "none")
    worst = max(modes.eigenvalues(scenario), key=abs)
    half = float(loop.gain_limit(tau + period / 2, kappa=worst))
    text = [
        f"Slides longer than {WAY:g} of the nearest depth are run more slowly and their errors "
        "scaled, as the error of a slide is linear in its speed.",
        f"Steady errors do not depend on sampling. Gain limits do: the twist is held over "
        f"{1e3 * period:g} ms, which acts like half a period more of latency in the robot. With "
        f"that, the continuous limit without a remedy is {half:.2f} s⁻¹, the sampled one "
        f"{plain.exact.real:.2f}.",
    ]
    smiths = [row.limit for row in rows if row.remedy.kind == "Smith"]
    if any(row.predicted is None or math.isinf(row.predicted.real) for row in smiths):
        text.append(
            "A Smith predictor takes the latency out of the loop, but not the hold: with κ = 1 and "
            f"the right τ̂ its sampled limit is that without latency, {2 / period:.4g} s⁻¹."
        )
    return text
