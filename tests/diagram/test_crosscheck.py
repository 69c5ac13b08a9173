"""check() passes where all is well, and says where not when one face is bent."""

import numpy as np
import pytest
import sympy as sp
from delay_oracle import WORKING, figure1

from vsctrl.diagram import Block, Diagram, Sum, crosscheck, pade, roots, system
from vsctrl.diagram.delay import DelaySystem
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
    right = roots.rightmost
    monkeypatch.setattr(system.roots, "rightmost", lambda *given: right(*given) * (1 + 1e-4))


def bent_pade(monkeypatch):
    right = pade.pade_delay
    monkeypatch.setattr(pade, "pade_delay", lambda late, order: right(1.01 * late, order))


def bent_response(monkeypatch):
    right = crosscheck.response.solve
    stretched = lambda given, signal, end: right(given, type(signal)(1 + 1e-6), end)  # noqa: E731
    monkeypatch.setattr(crosscheck.response, "solve", stretched)


@pytest.mark.parametrize(
    ("bend", "face"),
    [
        (bent_transfer, "state space"),
        (bent_roots, "poles"),
        (bent_pade, "Padé"),
        (bent_response, "step response"),
    ],
)
def test_a_bent_face_is_named(monkeypatch, bend, face):
    given = figure1().at(WORKING)
    bend(monkeypatch)
    table = given.check()
    assert not table.passed
    assert {line.faces.split(" against")[0] for line in table.lines if not line.passed} <= {
        face,
        "poles",
        "state space",
        "step response",
        "Padé 8",
    }
    assert any(line.faces.startswith(face) for line in table.lines if not line.passed)


def test_an_improper_channel_is_said_to_be_left_out():
    diagram = Diagram([Block("d", s, "u -> y")])
    table = diagram.at().check()
    assert table.passed
    assert any("improper" in line.note for line in table.lines)
