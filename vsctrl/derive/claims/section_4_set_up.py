"""Section 4, the set-up of all experiments: the cube with its LEDs, the latency and the gain."""

from sympy import Gt, ImmutableMatrix, Lt, Rational

from vsctrl.derive.claims.claim import Evidence, claim
from vsctrl.derive.claims.figure_1 import SLIDE, lag
from vsctrl.symbols import k_ff, kappa, lam, tau, v

EDGE = Rational(1, 4)  #: of the cube
LEDS = [
    ImmutableMatrix([a * Rational(125, 1000), b * Rational(75, 1000), -Rational(125, 1000)])
    for a in (-1, 1)
    for b in (-1, 1)
]


@claim(
    "LEDs",
    "4",
    "edge 25 cm, LEDs at x = ±12.5 cm, y = ±7.5 cm, z = −12.5 cm, two on each edge",
    status="holds",
)
def leds() -> Evidence:
    """With the origin in the centre of the cube, |x| = |z| = 12.5 cm is an edge parallel to y, and
    |y| is less than half an edge."""
    half = EDGE / 2
    on_edge = [abs(a) - half for led in LEDS for a in (led[0], led[2])]
    return Evidence(printed=[*on_edge, *(Lt(abs(led[1]), half) for led in LEDS)])


@claim(
    "latency",
    "4",
    "the vision system introduces a dataflow latency of 80 ms",
    status="ambiguous",
    correction="where it acts is a parameter, `placement`: measurement, aligned or actuator",
)
def placement() -> Evidence:
    """The final value on a ramp with the derivative term, for each place where the 80 ms can enter
    the loop of figure 1."""
    places = ("measurement", "aligned", "actuator")
    steady = {place: lag(place).subs(k_ff, 1) for place in places}
    stated = -v * (1 - kappa) / (kappa * lam)
    return Evidence(
        readings={place: error.subs(kappa, 1) for place, error in steady.items()},
        corrected=[steady["aligned"] - stated, steady["actuator"] - stated],
        at=SLIDE,
    )


@claim(
    "λ",
    "4.1",
    "λ = 0.1, and λ = 0.2 for the oscillation",
    r"\lambda = 0.1",
    status="ambiguous",
    correction="no unit is given. Per 40 ms sample, 2.5 s⁻¹ and 5 s⁻¹, is far more plausible:"
    " `per_sample(0.1, period=0.04)`; λ is in s⁻¹ everywhere else",
)
def unit_of_lambda() -> Evidence:
    """The lag v/λ without the derivative term at 4 cm/s, in m. Per second it would be longer than
    the edge of the cube, 0.25 m, along which the camera slides."""
    behind = -lag().subs({tau: 0, kappa: 1, k_ff: 0})
    printed, period = Rational(1, 10), Rational(4, 100)
    speed = SLIDE[v]
    readings = {
        "per second": behind.subs({v: speed, lam: printed}),
        "per sample": behind.subs({v: speed, lam: printed / period}),
    }
    plausible = [Gt(readings["per second"], EDGE), Lt(readings["per sample"], EDGE)]
    return Evidence(readings=readings, corrected=plausible)
