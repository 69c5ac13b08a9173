"""Values that are possible and yet look like a slip of the unit, asked back as questions.

A loop knows no absolute scale: a microscope works on micrometres, a telescope with a focal length
of 10⁶ px, a plotter of glaciers once an hour. So nothing is judged by its size alone, but by what
it is beside the others: a time beside 1/λ, a length beside the depth, an angle beside a turn. What
is a thousandfold off any use while a thousandth of it would be plausible, is asked as a question
that refuses the scenario; what is merely unusual is a doubt, which is said and stops nothing.
``sure = true`` in the scenario answers all of them: it was meant so. Of one slip, such as a target
in mm, only the first consequence is asked about.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from vsctrl.arrays import Array
from vsctrl.servo.camera.camera import Camera
from vsctrl.servo.motion.trajectory import Trajectory
from vsctrl.servo.pose import exp, from_euler_xyz
from vsctrl.servo.scenario.description import TABLE_OF, Description

# A time of so many seconds and of so many 1/λ is one in ms: a loop of such a period could never be
# stable, and none waits so long for its image. (λτ above π/2 alone is an unstable loop, no slip.)
LONG, CONSTANTS, WAITING = 3.0, 30.0, 150.0
# Directions of points from the optical axis, as tangents: of no lens that is a pinhole, and of an
# unusual one.
BESIDE, WIDE = 30.0, 10.0
# Size of the target's image in px: one point to every sensor, and hardly more than one.
ONE_POINT, SMALL = 0.5, 5.0
# A focal length in px that is one in m, and one of hardly any sensor; 1 is that of normalised
# coordinates.
IN_METRES, SHORT = 0.1, 50.0
# A turn per frame, rad, that no law follows; the lag of a moving target in depths.
PER_FRAME, OUTRUN = 0.5, 10.0
ENDLESS = 500.0  #: a duration in s beyond which it, and not the velocity, may be in thousandths
SAMPLES = 33  #: of the reference, where its image is looked at
CERTAIN = " (if it is meant so, set sure = true)"  #: at the end of a question that refuses


class Question(NamedTuple):
    """A key and the question about its value; refuses: whether it must be answered first."""

    field: str
    sentence: str
    refuses: bool


def questions(scenario: Description, reference: Trajectory) -> Iterator[Question]:
    """All that looks like a slip in a scenario with this reference, at most one of each kind."""
    yield from _times(scenario, reference.duration)
    yield from _angles(scenario)
    others = [*_focal_lengths(scenario), *_rates(scenario, reference)]
    yield from others or _lengths(scenario, reference)


def _times(scenario: Description, span: float) -> Iterator[Question]:
    """Milliseconds where seconds belong; span: of the run, s."""
    lam = scenario.law.lam
    for name in (
        "period", "latency", "jitter", "preview", "preview_ff", "tau_hat", "dead_time",
        "time_constant",
    ):  # fmt: skip
        table = TABLE_OF[name]
        value = getattr(getattr(scenario, table), name)
        if value is not None and value > LONG and value * lam > CONSTANTS:
            ms = value / 1000
            yield Question(
                f"{table}.{name}",
                f"{value:g} s is {value * lam:.3g} times 1/λ = {1 / lam:.3g} s: did you mean "
                f"{value:g} ms, {name} = {ms:.12g}?",
                # A predictor may believe in whatever latency one likes.
                name == "period" or (value * lam > WAITING and name != "tau_hat"),
            )
        elif name == "latency" and value > span >= scenario.vision.period and value * lam > 1:
            yield Question(
                "vision.latency",
                f"{value:g} s is longer than the run of {span:g} s, which so never sees an image "
                f"of its own: did you mean {value:g} ms, latency = {value / 1000:.12g}, or a "
                "longer motion.duration?",
                False,
            )


def _angles(scenario: Description) -> Iterator[Question]:
    """Degrees where radians belong, and radians where degrees do."""
    for name in ("offset", "hand_eye", "reference_hand_eye"):
        table = TABLE_OF[name]
        twist = np.array(getattr(getattr(scenario, table), name))
        angle = float(np.linalg.norm(twist[3:]))
        if angle <= math.pi * (1 + 1e-9):
            continue
        turned = ", ".join(f"{c:.6g}" for c in [*twist[:3], *np.radians(twist[3:])])
        much = "whole turns" if angle > 2 * math.pi else "more than half a turn"
        yield Question(
            f"{table}.{name}",
            f"a rotation by {angle:.4g} rad is {much}: did you mean degrees, {name} = [{turned}]?",
            angle > 2 * math.pi,
        )
    angles = scenario.start.euler_xyz_deg
    if any(map(_in_radians, angles)):
        listed = ", ".join(f"{math.degrees(c):.4g}" for c in angles)
        yield Question(
            "start.euler_xyz_deg",
            f"{angles} are degrees, and one of them is a right angle in rad: did you mean "
            f"euler_xyz_deg = [{listed}]?",
            _looks_away(scenario),
        )


def _in_radians(angle: float) -> bool:
    """Whether a number is π/2 or a multiple of it, cut to two digits after the point or more."""
    quarters = round(abs(angle) / (math.pi / 2))
    exact = quarters * math.pi / 2
    return 0 < quarters <= 4 and any(abs(angle) == round(exact, n) for n in range(2, 17))


def _looks_away(scenario: Description) -> bool:
    """Whether a point is behind the camera with the angles in degrees, and none in radians."""
    start, points = scenario.start, np.array(scenario.target.points)
    here, there = (
        Camera(1.0, 1.0).points(from_euler_xyz(start.position, angles), points)[:, 2].min()
        for angles in (start.euler_xyz_deg, np.degrees(start.euler_xyz_deg))
    )
    return bool(here <= 0 < there)


def _focal_lengths(scenario: Description) -> Iterator[Question]:
    """Millimetres or metres where pixels belong."""
    camera = scenario.camera
    short = min(camera.Fx, camera.Fy)
    if short >= SHORT or _normalised(scenario):
        return
    if camera.size_px is not None and short > min(camera.size_px) / 20:
        return  # a sensor of few pixels
    name = "Fx" if camera.Fx == short else "Fy"
    unit, mm = ("m", 1000 * short) if short < IN_METRES else ("mm", short)
    pitch = 0.01
    yield Question(
        f"camera.{name}",
        f"{short:g} px is hardly a focal length: did you mean {short:g} {unit}? In pixels it is "
        f"that over the pitch of the pixels; {mm:g} mm on pixels of {1000 * pitch:g} µm are "
        f"{name} = {mm / pitch:.6g}",
        short < IN_METRES,
    )


def _normalised(scenario: Description) -> bool:
    """Whether the image is in units of the focal length, which have no pixels."""
    return scenario.camera.Fx == scenario.camera.Fy == 1


def _rates(scenario: Description, reference: Trajectory) -> Iterator[Question]:
    """Degrees per second where radians belong, and an oscillation whose speed is in mm/s."""
    period, motion = scenario.vision.period, scenario.motion
    if motion.kind == "oscillation":
        cycle = getattr(reference, "period", math.inf)
        if motion.speed is not None and cycle < 2 * period:
            yield Question(
                "motion.speed",
                f"{motion.speed:g} m/s over {motion.amplitude:g} m are a cycle of {cycle:.3g} s, "
                f"and the video period is {period:g} s: did you mean mm/s, speed = "
                f"{motion.speed / 1000:.6g}?",
                cycle < period,
            )
        return
    if motion.kind == "screw":
        name, rates = "Omega", np.array(motion.Omega)
    elif motion.kind == "rotation":
        name, rates = "speed", np.array([motion.speed])
    else:
        return
    rate = float(np.linalg.norm(rates))
    if rate * period <= PER_FRAME or reference.duration < period:
        return
    shown = ", ".join(f"{c:.6g}" for c in np.radians(rates))
    yield Question(
        f"motion.{name}",
        f"{rate:g} rad/s turn the camera by {math.degrees(rate * period):.3g}° in every frame: did "
        f"you mean {rate:g}°/s, {name} = {f'[{shown}]' if len(rates) > 1 else shown}?",
        bool((_seen(scenario, reference)[:, 2] <= 0).any()),
    )


def _lengths(scenario: Description, reference: Trajectory) -> Iterator[Question]:
    """Millimetres where metres belong: the first of the keys that is so beside the others."""
    points, position = np.array(scenario.target.points), scenario.start.position
    centred = Camera(1.0, 1.0).points(reference.oTc0, points)
    size, depth = float(np.ptp(points, axis=0).max()), float(np.abs(centred).max(axis=1).mean())
    if not (size and depth):
        return
    if _target_in_mm(scenario, reference.oTc0, centred):
        rows = ", ".join(_listed(p / 1000) for p in points[:8])
        yield Question(
            "target.points",
            f"they are {size:g} m apart, seen from {np.linalg.norm(position):.3g} m: did you mean "
            f"mm, points = [{rows}{', …' if len(points) > 8 else ''}]?",
            True,
        )
        return
    image = max(scenario.camera.Fx, scenario.camera.Fy) * size / depth
    if image < SMALL and not _normalised(scenario):
        in_mm = image < ONE_POINT and 1000 * image > SMALL
        nearer = _listed(np.array(position) / 1000)
        asked = f"did you mean mm, position = {nearer}?" if in_mm else "is a length in mm?"
        yield Question(
            "start.position",
            f"from {depth:.4g} m the target of {size:g} m is {image:.2g} px large in the image: "
            f"{asked}",
            in_mm,
        )
        return
    yield from _offset(scenario, reference.oTc0, depth)
    yield from _way(scenario, reference, depth)
    yield from _drift(scenario, depth)


def _listed(values: Array) -> str:
    return f"[{', '.join(f'{c:.6g}' for c in values)}]"


def _in_mm(twist: tuple[float, ...]) -> str:
    """A twist with a thousandth of its lengths."""
    return _listed(np.array(twist) / ([1000] * 3 + [1] * 3))


def _target_in_mm(scenario: Description, oTc0: Array, centred: Array) -> bool:
    """Whether no lens would show points so far apart, and one shows a thousandth of them well."""
    points, position = np.array(scenario.target.points), scenario.start.position
    if not 0 < BESIDE * np.linalg.norm(position) < np.ptp(points, axis=0).max():
        return False
    smaller = Camera(1.0, 1.0).points(oTc0, points / 1000)
    return _tangent(centred) > BESIDE and _tangent(smaller) < 1


def _tangent(p: Array) -> float:
    """Greatest tangent of the directions of points (..., 3) from the optical axis, inf behind."""
    if not p[..., 2].min() > 0:
        return math.inf
    return float((np.linalg.norm(p[..., :2], axis=-1) / p[..., 2]).max())


def _offset(scenario: Description, oTc0: Array, depth: float) -> Iterator[Question]:
    offset = scenario.start.offset
    away = float(np.linalg.norm(offset[:3])) / depth
    if away > WIDE:
        centre = np.array(scenario.target.points).mean(axis=0, keepdims=True)
        seen = Camera(1.0, 1.0).points(oTc0 @ exp(np.array(offset)), centre)
        yield Question(
            "start.offset",
            f"it is {away:.3g} times as far as the target: did you mean mm, offset = "
            f"{_in_mm(offset)}?",
            BESIDE < away < 1000 and _tangent(seen) > BESIDE,
        )


def _way(scenario: Description, reference: Trajectory, depth: float) -> Iterator[Question]:
    """A reference that leads so far aside or past that no lens would show the target."""
    seen, motion = _seen(scenario, reference), scenario.motion
    moved = np.linalg.norm(reference.pose(_samples(reference))[:, :3, 3] - reference.oTc0[:3, 3],
                           axis=1)  # fmt: skip
    aside = np.where(seen[:, 2] > 0, np.linalg.norm(seen[:, :2], axis=1) / seen[:, 2], 0.0)
    beside = float(np.minimum(np.where(seen[:, 2] > 0, aside, np.inf), moved / depth).max())
    if beside <= WIDE:
        return
    field, asked = "motion", "is a length in mm?"
    if motion.kind == "screw" and any(motion.V):
        field = "motion.V"
        asked = f"did you mean mm/s, V = {_listed(np.array(motion.V) / 1000)}?"
        if motion.duration > ENDLESS:
            asked = f"did you mean ms, duration = {motion.duration / 1000:.6g}?"
    elif motion.kind == "oscillation":
        field = "motion.amplitude"
        asked = f"did you mean mm, amplitude = {motion.amplitude / 1000:.6g}?"
    yield Question(
        field,
        f"it leads the camera {beside:.3g} times as far away as the target was: {asked}",
        BESIDE < beside < 1000 * WIDE and field != "motion",
    )


def _samples(reference: Trajectory) -> Array:
    return np.linspace(0.0, reference.duration, SAMPLES)


def _seen(scenario: Description, reference: Trajectory) -> Array:
    """Middle of the target in the camera frame along the reference, (SAMPLES, 3) in m."""
    centre = np.array(scenario.target.points).mean(axis=0, keepdims=True)
    return Camera(1.0, 1.0).points(reference.pose(_samples(reference)), centre)[:, 0]


def _drift(scenario: Description, depth: float) -> Iterator[Question]:
    drift, law = scenario.target.drift, scenario.law
    step = float(np.linalg.norm(drift[:3])) * max(scenario.vision.period, 1 / law.lam) / depth
    if step > OUTRUN:
        yield Question(
            "target.drift",
            f"it moves by {step:.3g} times its distance in the {1 / law.lam:.3g} s that the law "
            f"needs to follow: did you mean mm/s, drift = {_in_mm(drift)}?",
            False,
        )


def asked(scenario: Description) -> tuple[Question, ...]:
    """The questions about a scenario whose motion is possible; none to one that is sure."""
    if scenario.sure:
        return ()
    with np.errstate(all="ignore"):
        return tuple(questions(scenario, scenario.reference))
