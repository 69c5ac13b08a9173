"""The experiments of the paper as scenarios, with what the paper leaves open decided and named.

The slide and the oscillation of section 4.1, the rotation of section 4.2. The paper gives no
camera, no unit of λ and no place for the latency; each choice is an argument here or a comment.
What follows from them is computed elsewhere.
"""

from collections.abc import Callable
from typing import Any

from vsctrl.checks import quoted, unusable
from vsctrl.errors import InputError
from vsctrl.keywords import keywords
from vsctrl.servo.camera.target import CUBE_LEDS
from vsctrl.servo.motion.trajectory import Waveform
from vsctrl.servo.scenario import Scenario
from vsctrl.servo.timing import Placement

__all__ = [
    "AMPLITUDE",
    "CENTRE",
    "CYCLE",
    "DISTANCE",
    "LAM",
    "LAM_OSCILLATION",
    "PRESETS",
    "PRINTED_START",
    "ROTATION_START",
    "SPEED",
    "START",
    "oscillation",
    "preset",
    "rotation",
    "sliding",
]


def __dir__() -> list[str]:
    return list(__all__)


PRINTED_START = (-0.174, 0.044, -0.077)
"""Start position of section 4.1 as printed, m. It puts all LEDs (z = −0.125 m) behind the camera:
``sliding().with_(position=PRINTED_START)`` is refused, with the sentence that says why."""

START = (-0.174, 0.044, -0.77)
"""Start position used instead, m: the printed one with its decimal point moved, range 0.645 m."""

# λ = 0.1 has no unit in the paper. Per 40 ms sample it is 2.5 s⁻¹ (16 mm of lag without
# feed-forward, a transient of 1.2 s); per second it would lag by 400 mm on a slide of 360 mm.
LAM = 0.1 / 0.040
# λ = 0.2 of figures 7 and 8, read in the same way.
LAM_OSCILLATION = 0.2 / 0.040

CENTRE = (0.0, 0.044, -0.77)
"""Middle of the oscillation, m: "centered in 0" is read as x = 0 of the object, all else as in the
slide, of which it is "the same case"."""
AMPLITUDE, SPEED = 0.15, 0.04
# The period is not printed. At the slide's 4 cm/s a triangle of 0.15 m has this one (s).
CYCLE = 4 * AMPLITUDE / SPEED

ROTATION_START = (-0.154, 0.014, -0.811)
DISTANCE = 0.8
"""Of the rotation's axis from the camera, m, as printed; along the optical axis, as in the paper's
d = (0, 0, d). From that start it is neither the distance of the cube's front edges (0.69 and 0.74
m) nor of its centre (0.83 m), so "around a cube edge" and 0.8 m do not hold together."""


@keywords
def sliding(
    feedforward: bool = True,
    *,
    lam: float = LAM,
    latency: float = 0.08,
    placement: Placement = "measurement",
) -> Scenario:
    """The slide along the cube's side (section 4.1): 4 cm/s along the camera's x axis for 9 s.

    feedforward: with the derivative term of (10) or without; lam: λ in s⁻¹; latency: of the vision
    system, s; placement: where it acts. Other fields: ``sliding().with_(…)``.
    Raises InputError for values that cannot be simulated.

    >>> vs.paper.sliding(feedforward=False).law.k_ff
    0.0
    """
    return Scenario(
        name="sliding",
        description=f"Sliding along the cube side, {_term(feedforward)} (section 4.1)",
        start={"position": START, "euler_xyz_deg": (2.0, 4.2, -0.2)},
        motion={"V": (SPEED, 0.0, 0.0), "Omega": (0.0, 0.0, 0.0), "duration": 9.0},
        **_platform(feedforward, lam, latency, placement),
    )


@keywords
def oscillation(
    waveform: Waveform = "triangle",
    feedforward: bool = True,
    *,
    lam: float = LAM_OSCILLATION,
    latency: float = 0.08,
    placement: Placement = "measurement",
) -> Scenario:
    """The oscillation of figures 7 and 8: 0.15 m to either side along the camera's x axis, 30 s.

    waveform: "triangle", at 4 cm/s; or "sine", with the same period of 15 s and so up to 6.3 cm/s.
    The paper names neither; its constant "static error" fits the triangle. Its start "at random
    position" is left to ``oscillation().with_(offset=…)``. Other arguments and errors as
    ``sliding``.

    >>> vs.paper.oscillation("sine").law.lam
    5.0
    """
    motion: dict[str, Any] = {"kind": "oscillation", "waveform": waveform, "amplitude": AMPLITUDE}
    triangle = isinstance(waveform, str) and waveform == "triangle"
    motion |= {"speed": SPEED} if triangle else {"cycle": CYCLE}
    return Scenario(
        name="oscillation",
        description=f"Oscillation along the cube side, {_term(feedforward)} (figures 7 and 8)",
        start={"position": CENTRE, "euler_xyz_deg": (2.0, 4.2, -0.2)},
        # Two periods: the transient, and a whole one without it.
        motion={**motion, "direction": (1.0, 0.0, 0.0, 0.0, 0.0, 0.0), "duration": 2 * CYCLE},
        **_platform(feedforward, lam, latency, placement),
    )


@keywords
def rotation(
    feedforward: bool = True,
    *,
    distance: float = DISTANCE,
    axis: tuple[float, float, float] = (0.0, 1.0, 0.0),
    speed: float = 0.04,
    lam: float = LAM,
    latency: float = 0.08,
    placement: Placement = "measurement",
) -> Scenario:
    """The rotation of section 4.2: 0.04 rad/s about an axis 0.8 m in front of the camera, for 10 s.

    distance: from the camera to the axis along the optical axis, m; axis: its direction in the
    camera frame, parallel to y in the paper; speed: rad/s. Other arguments and errors as
    ``sliding``.

    >>> print(vs.paper.rotation().reference.twist(0.0))
    [-0.032  0.     0.     0.     0.04   0.   ]
    """
    return Scenario(
        name="rotation",
        description=f"Rotation about an axis of the cube, {_term(feedforward)} (section 4.2)",
        start={"position": ROTATION_START, "euler_xyz_deg": (-0.9, -3.8, 0.0)},
        # No duration is printed. In 10 s the camera turns by 23° and then sees the LEDs' face at
        # 19°, at depths from 0.72 to 0.80 m and within 345 px of the image's centre: an image 768
        # pixels wide shows them all the time. λ is not printed either: that of the slide.
        motion={
            "kind": "rotation",
            "axis": axis,
            "arm": (0.0, 0.0, distance),
            "speed": speed,
            "duration": 10.0,
        },
        **_platform(feedforward, lam, latency, placement),
    )


def _platform(
    feedforward: bool, lam: float, latency: float, placement: Placement
) -> dict[str, Any]:
    """What all experiments share: camera, target, law and vision system."""
    return {
        # No intrinsics are given: a CCD of the time behind an 8 mm lens.
        "camera": {"Fx": 700.0, "Fy": 700.0},
        "target": {"points": CUBE_LEDS.points},
        "law": {"lam": lam, "k_ff": 1.0 if feedforward else 0.0, "placement": placement},
        "vision": {"period": 0.040, "latency": latency},
    }


def _term(feedforward: bool) -> str:
    """What the descriptions say of it; every preset asks."""
    if not isinstance(feedforward, bool | int):
        raise unusable("feedforward", feedforward, "True or False")
    return f"{'with' if feedforward else 'without'} the derivative term"


PRESETS: dict[str, Callable[[], Scenario]] = {
    "sliding": sliding,
    "oscillation": oscillation,
    "rotation": rotation,
}


@keywords
def preset(name: str) -> Scenario:
    """The experiment of the paper with this name. Raises InputError that lists the known ones.

    >>> vs.paper.preset("sliding") == vs.paper.sliding()
    True
    """
    if name not in PRESETS:
        known = ", ".join(PRESETS)
        raise InputError(f"preset: there is no experiment {quoted(name)}; choose {known}.")
    return PRESETS[name]()
