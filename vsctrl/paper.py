"""The experiments of the paper as scenarios, with what the paper leaves open decided and named.

So far the slide of section 4.1. The paper gives no camera, no unit of λ and no place for the
latency; each choice is an argument here or a comment. What follows from them is computed elsewhere.
"""

from vsctrl.errors import InputError
from vsctrl.servo.scenario import Placement, Scenario
from vsctrl.servo.target import CUBE_LEDS

PRINTED_START = (-0.174, 0.044, -0.077)
"""Start position of section 4.1 as printed, m. It puts all LEDs (z = −0.125 m) behind the camera:
``sliding().with_(position=PRINTED_START)`` is refused, with the sentence that says why."""

START = (-0.174, 0.044, -0.77)
"""Start position used instead, m: the printed one with its decimal point moved, range 0.645 m."""

# λ = 0.1 has no unit in the paper. Per 40 ms sample it is 2.5 s⁻¹ (16 mm of lag without
# feed-forward, a transient of 1.2 s); per second it would lag by 400 mm on a slide of 360 mm.
LAM = 0.1 / 0.040


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
    """
    term = "with" if feedforward else "without"
    return Scenario(
        name="sliding",
        description=f"Sliding along the cube side, {term} the derivative term (section 4.1)",
        # No intrinsics are given: a CCD of the time behind an 8 mm lens.
        camera={"Fx": 700.0, "Fy": 700.0},
        target={"points": CUBE_LEDS.points},
        start={"position": START, "euler_xyz_deg": (2.0, 4.2, -0.2)},
        motion={"V": (0.04, 0.0, 0.0), "Omega": (0.0, 0.0, 0.0), "duration": 9.0},
        law={"lam": lam, "k_ff": 1.0 if feedforward else 0.0, "placement": placement},
        vision={"period": 0.040, "latency": latency},
    )


PRESETS = {"sliding": sliding}


def preset(name: str) -> Scenario:
    """The experiment of the paper with this name. Raises InputError that lists the known ones."""
    if name not in PRESETS:
        raise InputError(f"scenario: there is no experiment {name!r}; choose {', '.join(PRESETS)}.")
    return PRESETS[name]()
