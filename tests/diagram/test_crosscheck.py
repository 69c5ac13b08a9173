"""check() passes where all is well, and says where not when one face is bent."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from oracles.delay import WORKING, figure1

from vsctrl.diagram import Block, Diagram, Sum
from vsctrl.diagram.consistency import crosscheck, margin_scan
from vsctrl.diagram.frequency import loop_margins, numeric_channel
from vsctrl.diagram.frequency.hidden_roots import ClosedLoop
from vsctrl.diagram.pade import approximant
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.roots import rightmost
from vsctrl.diagram.sampled import channel, zero_order_hold
from vsctrl.diagram.symbolic.order_at_zero import Leading
from vsctrl.symbols import s, tau

SMITH = Diagram(
    [
        Sum("e = r - y - q"),
        Block("C", 2 + 3 / s + s / (1 + s / 10), "e -> u"),
        Block("P", sp.exp(-s * tau) / (s + 1) ** 3, "u -> y"),
        Block("model", (1 - sp.exp(-tau * s)) / (s + 1) ** 3, "u -> q"),
    ],
    outputs=["y"],
)
NEUTRAL = Diagram(
    [
        Sum("e = r - w"),
        Block("half", sp.Rational(1, 2), "e -> y"),
        Block("late", sp.exp(-s / 10), "y -> w"),
    ],
    outputs=["y"],
)


@pytest.mark.parametrize(
    "given",
    [
        figure1().at(WORKING),
        figure1().at(WORKING | {"lam": 25.0}),  # growing
        figure1().at(WORKING | {"tau": 0.0}),
        figure1().at(WORKING | {"lam": 1 / (np.e * 0.08)}),  # double root
        SMITH.at(tau=0.5),
        NEUTRAL.at(),
    ],
    ids=["figure 1", "unstable", "no delay", "double root", "smith", "neutral"],
)
def test_sound_systems_pass(given):
    table = given.check()
    assert table.passed, str(table)
    assert len(table.lines) >= 4
    assert "FAIL" not in str(table)
    assert table._repr_html_().count("<tr>") == len(table.lines) + 1


def bent_transfer(monkeypatch):
    right = DelaySystem.transfer
    monkeypatch.setattr(DelaySystem, "transfer", lambda self, at: right(self, at) * (1 + 1e-6))


def bent_roots(monkeypatch):
    right = rightmost.poles
    monkeypatch.setattr(crosscheck.rightmost, "poles", lambda *given: right(*given) * (1 + 1e-4))


def bent_pade(monkeypatch):
    right = approximant.pade_delay
    monkeypatch.setattr(approximant, "pade_delay", lambda late, order: right(1.01 * late, order))


def bent_response(monkeypatch):
    right = crosscheck.collocation.solve
    stretched = lambda given, signal, end: right(given, type(signal)(1 + 1e-6), end)  # noqa: E731
    monkeypatch.setattr(crosscheck.collocation, "solve", stretched)


def bent_twin(monkeypatch):
    """A delay that the twin takes for one of 2 % more."""
    right = zero_order_hold.ago
    monkeypatch.setattr(zero_order_hold, "ago", lambda theta, T: right(theta * Fraction(51, 50), T))


def bent_gain_of_the_twin(monkeypatch):
    right = channel.SampledChannel.__call__
    monkeypatch.setattr(
        channel.SampledChannel, "__call__", lambda self, z: right(self, z) * (1 + 1e-3)
    )


def bent_margins(monkeypatch):
    """A search that ends above the crossing, as one that follows poles only may."""
    right = margin_scan.loop_margins
    blind = {"gain_crossings": (), "phase": math.inf, "delay": math.inf}
    monkeypatch.setattr(margin_scan, "loop_margins", lambda loop: replace(right(loop), **blind))


def bent_peak(monkeypatch):
    right = margin_scan.loop_margins
    monkeypatch.setattr(
        margin_scan, "loop_margins", lambda loop: replace(right(loop), peak_sensitivity=1.0)
    )


@pytest.mark.parametrize(
    ("bend", "face"),
    [
        (bent_margins, "margins"),
        (bent_peak, "margins"),
        (bent_transfer, "state space"),
        (bent_roots, "poles"),
        (bent_pade, "Padé"),
        (bent_response, "step response"),
        (bent_twin, "sampled"),
        (bent_gain_of_the_twin, "sampled"),
    ],
)
def test_a_bent_face_is_named(monkeypatch, bend, face):
    given = figure1().at(WORKING)
    bend(monkeypatch)
    table = given.check()
    assert not table.passed
    assert {line.faces.split(" against")[0] for line in table.lines if not line.passed} <= {
        face,
        "margins",
        "poles",
        "state space",
        "step response",
        "Padé 8",
        "sampled",
        "sampled, extrapolated to T = 0",
    }
    assert any(line.faces.startswith(face) for line in table.lines if not line.passed)


def test_an_improper_channel_is_said_to_be_left_out():
    diagram = Diagram([Block("d", s, "u -> y")])
    table = diagram.at().check()
    assert table.passed
    assert any("improper" in line.note for line in table.lines)


def test_the_sampled_line_says_which_signal_was_held():
    lines = {line.faces: line for line in figure1().at(WORKING).check().lines}
    near = lines["sampled against continuous, T → 0"]
    assert "'u_fb' held" in near.note and 0 < near.difference < near.allowed
    rest = lines["sampled, extrapolated to T = 0"]
    assert rest.difference < 0.05 * near.difference  # second order against first


def test_a_diagram_without_a_twin_is_said_to_be_left_out():
    """Two inner loops with delays that no one hold can cut."""
    parts = [Block("in", 1, "r -> a")]
    for k in (1, 2):
        parts += [
            Sum(f"v{k} = {'a' if k == 1 else 'y1'} - w{k}"),
            Block(f"plant {k}", 1 / s, f"v{k} -> y{k}"),
            Block(f"late {k}", sp.exp(-k * s / 10), f"y{k} -> w{k}"),
        ]
    table = Diagram(parts, outputs=["y2"]).at().check()
    assert table.passed
    assert any("left out: sampled: the hold at" in line.note for line in table.lines)


def test_delays_without_a_common_period_are_said_to_be_left_out():
    parts = [
        Block("a", sp.exp(-sp.Rational("0.1234567891") * s), "u -> v"),
        Block("b", sp.exp(-s * sp.Rational("0.3")) / (s + 1), "v -> y"),
    ]
    table = Diagram(parts, outputs=["y"]).at().check()
    assert table.passed
    assert any("no common period" in line.note for line in table.lines)


HALVES = sp.exp(-s / 3), sp.exp(-s / 5), sp.exp(-sp.Rational(8, 15) * s)


@pytest.mark.parametrize(
    "parts",
    [
        [Sum("e = r - y"), Block("P", sp.Rational(6, 5) / s**2, "e -> y")],
        [
            Block("P", 1 / (s**2 + 1), "r -> v"),
            Block("Q", 1 / (s**2 + sp.Rational(1, 4)), "v -> y"),
        ],
    ],
    ids=["double integrator", "two oscillators"],
)
def test_poles_on_the_axis_are_no_fault(parts):
    """The twin is compared beside them, where there is something to compare."""
    assert Diagram(parts, ["r"], ["y"]).at().check().passed


@pytest.mark.parametrize(
    "parts",
    [
        [
            Block("P", 1 / (s + 1), "r -> a"),
            Block("model", 1 / (s + 1), "r -> b"),
            Sum("y = a - b"),
        ],
        [  # two delays one after the other, and both at once, in a loop that is unstable
            Sum("e = r - a"),
            Block("first", 9 * HALVES[0] / (s + 1), "e -> a"),
            Block("second", HALVES[1], "a -> b"),
            Block("both", 9 * HALVES[2] / (s + 1), "e -> c"),
            Sum("y = b - c"),
        ],
        [  # a decoupled second input
            Block("P", 1 / (s + 1), "u -> a"),
            Block("Q", sp.exp(-s) / (s + 2), "r -> b"),
            Block("decoupling", -(s + 1) * sp.exp(-s) / (s + 2), "r -> u"),
            Sum("y = a + b"),
        ],
    ],
    ids=["lags", "delays", "decoupled"],
)
def test_a_channel_that_is_zero_is_no_fault(parts):
    """What is left of it is the rounding of what cancels, and has no poles."""
    table = Diagram(parts, ["r"], ["y"]).at().check()
    assert table.passed, table
    assert any("the channel is 0" in line.note for line in table.lines)


def unity(*blocks):
    names = ["e", *(f"x{i}" for i in range(len(blocks) - 1)), "y"]
    parts = [Sum("e = r - y")]
    parts += [Block(f"b{i}", b, f"{names[i]} -> {names[i + 1]}") for i, b in enumerate(blocks)]
    return Diagram(parts, inputs=["r"], outputs=["y"]).at()


def failed(system):
    return [line.faces for line in system.check().lines if not line.passed]


def test_a_wrong_verdict_on_the_loop_is_noticed(monkeypatch):
    """Of a stable lag loop the count is made to say one unstable root, of an unstable one none."""
    for gain, told in ((2, 1), (-2, 0)):
        monkeypatch.setattr(loop_margins, "closed_loop", lambda _, told=told: ClosedLoop(told, ()))
        assert "verdict against poles" in failed(unity(gain / (s + 1)))


def test_a_wrong_value_at_zero_is_noticed(monkeypatch):
    """T(0) of an integral loop is 1; the lowest powers are made to say 1/2."""
    assert not failed(unity(2 / s))
    monkeypatch.setattr(numeric_channel, "leading", lambda *_: Leading(0, 0.5, 0))
    assert "H(0) against symbolic, s → 0" in failed(unity(2 / s))


def test_a_loop_that_crosses_for_ever_is_scanned_as_far_as_its_band():
    assert not failed(unity(1 / (s + 1) + sp.exp(-4 * s)))
