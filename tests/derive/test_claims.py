"""The ledger: every claim is proved anew, and fails when what it rests on is broken."""

import dataclasses
import re

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation
from sympy import Function, Gt, Matrix, Symbol, cos, lambdify, sin, symbols

import vsctrl as vs
from vsctrl import derive
from vsctrl.derive import claims
from vsctrl.derive.claims import (
    as_text,
    equations_1_to_5,
    equations_11_to_14,
    equations_15_to_17,
    figure_1,
    section_4_1_slide,
)
from vsctrl.derive.claims import section_4_2_rotation as turning
from vsctrl.derive.claims.claim import Evidence
from vsctrl.derive.claims.decision import decide
from vsctrl.derive.kinematics import interaction, motion
from vsctrl.symbols import lam, omega, r_x, r_y, r_z, t, tau, v, x, y, z

LEDGER = derive.ledger()
BY_NAME = {claim.equation: claim for claim in LEDGER}
# Places that are known to be wrong, open or ambiguous, with what must be found there.
KNOWN = {
    "(17) V": "erratum",
    "(4) C": "ambiguous",
    "(10)": "erratum",
    "(8)": "conditional",
    "(14)": "conditional",
    "§4.1 X*": "ambiguous",
    "§4.2 X*": "ambiguous",
    "§4.1 by (14)": "erratum",
    "§4.2 by (14)": "erratum",
    "§4.1 E": "erratum",
    "§4.2 matrices": "erratum",
    "§4.1 ds*/dt": "ambiguous",
    "§4.2 ds*/dt": "ambiguous",
    "§4.1 start": "erratum",
    "§4.2 distance": "ambiguous",
    "§4.1 angles": "ambiguous",
    "λ": "ambiguous",
    "fig. 8 static": "conditional",
    "latency": "ambiguous",
    "fig. 1 S = S*": "conditional",
    "fig. 1 1/λ": "conditional",
    "fig. 5 convergence": "conditional",
}
# What the paper prints there: numbers that a statement must quote.
QUOTED = {
    "§4.1 start": ("−0.174", "0.044", "−0.077"),
    "§4.2 distance": ("0.8 m", "−0.154", "0.014", "−0.811"),
    "§4.1 angles": ("2°", "4.2°", "−0.2°"),
    "latency": ("80 ms",),
    "λ": ("0.1", "0.2"),
    "LEDs": ("25 cm", "12.5 cm", "7.5 cm"),
}


@pytest.fixture
def rederived():
    """Shared derivations are forgotten before and after a test that breaks something."""

    def forget():
        for module in (
            figure_1,
            equations_11_to_14,
            section_4_1_slide,
            equations_1_to_5,
            equations_15_to_17,
            turning,
        ):
            for value in vars(module).values():
                if hasattr(value, "cache_clear"):
                    value.cache_clear()

    forget()
    yield
    forget()


def cross_matrix(a):
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


# The proofs --------------------------------------------------------------------------------------
@pytest.mark.parametrize("claim", LEDGER, ids=lambda claim: claim.equation)
def test_the_proof_finds_the_status(claim):
    proof = claim.prove()
    assert proof.found == claim.status
    assert proof and proof.holds
    assert (proof.residual == "0") == (claim.status == "holds")
    assert proof.explanation == claim.explanation != ""


@pytest.mark.parametrize("status", ["holds", "erratum", "conditional", "ambiguous"])
def test_a_wrong_label_is_not_confirmed(status):
    for equation in ("(6)", "(9)", "(11) ω r̃", "(4) C"):
        claim = dataclasses.replace(BY_NAME[equation], status=status)
        assert claim.proof() == (BY_NAME[equation].status == status)


def test_every_numbered_equation_is_there_once_and_in_order():
    numbered = [c.equation for c in LEDGER if re.fullmatch(r"\(\d+\)", c.equation)]
    assert numbered[:14] == [f"({n})" for n in range(1, 15)]
    assert sorted(numbered, key=len) == [f"({n})" for n in range(1, 18)]
    assert len(BY_NAME) == len(LEDGER)


def test_known_errata_have_the_status_that_theory_gives_them():
    assert {name: BY_NAME[name].status for name in KNOWN} == KNOWN


@pytest.mark.parametrize("equation", QUOTED)
def test_statements_quote_the_printed_numbers(equation):
    for number in QUOTED[equation]:
        assert number in BY_NAME[equation].statement


def test_what_does_not_hold_as_printed_says_what_does():
    for claim in LEDGER:
        assert bool(claim.correction) == (claim.status != "holds"), claim.equation


# Sabotage ----------------------------------------------------------------------------------------
def broken(*equations):
    """Which of these claims no longer have a proof; a derivation that cannot be made is none."""
    return {equation for equation in equations if not BY_NAME[equation].proof()}


def test_a_rotation_the_other_way_is_found_out(rederived, monkeypatch):
    true = motion.rotation
    monkeypatch.setattr(motion, "rotation", lambda r, theta: true(r, -theta))
    assert broken("(12)", "(13)", "(17)") == {"(12)", "(13)", "(17)"}


def test_a_motion_with_the_opposite_velocity_is_found_out(rederived, monkeypatch):
    true = motion.point_motion
    monkeypatch.setattr(motion, "point_motion", lambda p, V, *rest: true(p, -Matrix(V), *rest))
    named = ("(11)", "(12) constant", "(16)", "§4.1 x, y, z", "§4.1 by (14)")
    assert broken(*named) == set(named)


def test_an_axis_on_the_other_side_is_found_out(rederived, monkeypatch):
    true = motion.rotation_about
    monkeypatch.setattr(motion, "rotation_about", lambda p, d, *rest: true(p, -Matrix(d), *rest))
    named = ("(17)", "§4.2 matrices", "§4.2 one matrix", "§4.2 x, y, z")
    assert broken(*named) == set(named)


def test_a_cross_product_the_wrong_way_round_is_found_out(rederived, monkeypatch):
    true = motion.skew
    monkeypatch.setattr(motion, "skew", lambda r: -true(r))
    named = ("(11) kinematics", "(11)", "§4.2 r̃, r̃²")
    assert broken(*named) == set(named)


def test_an_interaction_matrix_of_the_wrong_sign_is_found_out(monkeypatch):
    true = interaction.interaction_matrix
    monkeypatch.setattr(interaction, "interaction_matrix", lambda feature: -true(feature))
    assert broken("(3)") == {"(3)"}


def test_a_loop_without_its_latency_is_found_out(rederived, monkeypatch):
    monkeypatch.setattr(figure_1, "_DELAY", Symbol("s") ** 0)
    named = ("fig. 1 S = S*", "fig. 1 1/λ", "latency", "fig. 5 amplitude")
    assert broken(*named) == set(named)


def test_a_correction_that_is_wrong_proves_nothing():
    assert Evidence(printed=x, corrected=y).found()[0] is None
    assert Evidence(printed=x, under=x - y).found()[0] is None
    assert Evidence(printed=x).found()[0] is None
    assert Evidence(printed=x - x, corrected=0 * y).found()[0] == "holds"
    assert Evidence(printed=x, corrected=y - y).found()[0] == "erratum"
    assert Evidence(printed=x, under=y - y).found()[0] == "conditional"
    assert Evidence(readings={"one": x, "other": y}).found()[0] == "ambiguous"
    assert Evidence(readings={"one": x, "other": x}).found()[0] == "holds"


# What counts as zero -----------------------------------------------------------------------------
def test_zero_is_decided_modulo_the_unit_axis_and_the_circle():
    square = r_x**2 + r_y**2 + r_z**2
    assert decide(square - 1).zero and decide((square - 1) / (1 + x**2)).zero
    assert decide(sin(omega * t) ** 2 + cos(omega * t) ** 2 - square).zero
    assert decide(sin(2 * t) - 2 * sin(t) * cos(t)).zero
    assert decide(square - 2).zero is False
    assert decide(sin(t) ** 2 - cos(t) ** 2).zero is False


def test_matrices_of_any_size_do_not_commute():
    A, B = symbols("A B", commutative=False)
    assert decide((A + B) ** 2 - A**2 - B**2 - A * B - B * A).zero
    assert decide(A * A**-1 - 1).zero
    # A 1×1 matrix refutes this one; no number refutes the commutator, which is therefore open.
    assert decide(A * B - A).zero is False
    assert decide(A * B - B * A).zero is None


def test_what_is_neither_proved_nor_refuted_stays_open():
    unknown = Function("f")(x)
    assert decide(unknown).zero is None
    assert decide([x - x, unknown]).zero is None
    assert decide(Gt(x, y)).zero is False
    assert decide(Gt(z, 0)).zero
    assert decide([unknown, y]).zero is False


def test_a_counterexample_names_its_place():
    assert decide(lam * v - 2, {lam: 2, v: 3}).shown == "λ·v − 2 is 4.000 ≠ 0 at λ = 2, v = 3"
    assert decide(1 / x - 1 / x.subs(x, 0)).shown == "0/0"


# The printed forms against numbers ---------------------------------------------------------------
@pytest.mark.parametrize("seed", range(10))
def test_the_printed_14_and_17_are_exponentials_of_the_screw(seed):
    """expm of the 4×4 generator of p' = −V − ω r × p, exact to rounding."""
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    p, V, d = rng.normal(size=(3, 3))
    speed, elapsed = rng.uniform(0.1, 2), rng.uniform(0.1, 3)
    names = [
        *equations_11_to_14.p,
        *equations_11_to_14.V,
        *equations_11_to_14.d,
        r_x,
        r_y,
        r_z,
        omega,
        t,
    ]

    def printed(path):
        values = (*p, *V, *d, *axis, speed, elapsed)
        return np.array(lambdify(names, list(path))(*values), dtype=float)

    def moved(velocity):
        generator = np.zeros((4, 4))
        generator[:3, :3], generator[:3, 3] = -speed * cross_matrix(axis), -velocity
        return (expm(generator * elapsed) @ [*p, 1])[:3]

    along = printed(equations_11_to_14.printed_motion(equations_11_to_14.V))
    np.testing.assert_allclose(along, moved(V), atol=1e-12)
    about = printed(equations_15_to_17.printed_turn(equations_11_to_14.d))
    np.testing.assert_allclose(about, moved(-speed * np.cross(axis, d)), atol=1e-12)
    # The printed V = ω r̃ d is not the velocity of this motion, by far more than rounding.
    assert np.abs(about - moved(speed * np.cross(axis, d))).max() > 1e-3


def lag_by_steps(lam, tau, k, *, slope=0.04, end=8.0, n=200):
    """S − S* of S' = λ(S* − S(t − τ)) + k S*' on a ramp from rest, trapezoidal steps of τ/n.

    In the steady state S is linear in t, which these steps follow exactly.
    """
    h = tau / n
    S = np.zeros(n + 1 + int(end / h))

    def speed(i):
        return lam * (slope * (i - n) * h - S[i - n]) + k * slope

    for i in range(n, len(S) - 1):
        S[i + 1] = S[i] + h * (speed(i) + speed(i + 1)) / 2
    return S[-1] - slope * (len(S) - 1 - n) * h


@pytest.mark.parametrize(("k", "expected"), [(1, 0.0032), (0, -0.0128)])
def test_the_lag_with_latency_is_what_steps_in_time_give(k, expected):
    found = figure_1.lag().subs({figure_1.k_ff: k, lam: 2.5, tau: 0.08, figure_1.kappa: 1, v: 0.04})
    assert float(found) == pytest.approx(expected, abs=1e-15)
    # After 8 s the transient, e^{−3.3 t}, is 1e-12 of the lag.
    assert lag_by_steps(2.5, 0.08, k) == pytest.approx(expected, abs=1e-11)


@pytest.mark.parametrize(
    ("start", "threshold", "with_term", "without"),
    [(-32, 24, np.log(4 / 3) / 2.5, np.log(2) / 2.5), (32, 8, np.log(4) / 2.5, np.log(2) / 2.5)],
)
def test_which_law_is_faster_to_a_threshold_depends_on_the_start(
    start, threshold, with_term, without
):
    """E' = −λE − (1 − k)v at v/λ = 16 mm by Euler steps of 10 µs, whose error is of that order."""
    step, gain, speed = 1e-5, 2.5, 40.0
    for k, expected in ((1, with_term), (0, without)):
        error, steps = float(start), 0
        while abs(error) > threshold:
            error += step * (-gain * error - (1 - k) * speed)
            steps += 1
        assert steps * step == pytest.approx(expected, abs=5e-5)
    correction = BY_NAME["fig. 5 convergence"].correction
    assert "E₀ ≤ 0" in correction and "may be slower" in correction


def test_one_slip_that_the_paper_repeats_is_not_counted_as_two():
    assert "One slip with §4.2 by (14)" in BY_NAME["§4.1 by (14)"].correction
    assert "One slip with §4.1 by (14)" in BY_NAME["§4.2 by (14)"].correction


def test_the_printed_start_has_the_leds_behind_the_camera():
    leds = [[a, b, -0.125] for a in (-0.125, 0.125) for b in (-0.075, 0.075)]
    for order in ("XYZ", "ZYX", "xyz", "zyx"):
        R = Rotation.from_euler(order, (2, 4.2, -0.2), degrees=True).as_matrix()
        for height, seen in ((-0.077, False), (-0.77, True)):
            depth = ((np.array(leds) - [-0.174, 0.044, height]) @ R)[:, 2]
            assert np.all((depth > 0) == seen)


def test_the_derivatives_of_section_4_are_those_of_a_camera_that_moves():
    """Central differences, error h² ~ 1e-8, of an image made with expm; numbers of section 4.2."""
    speed, arm, focal, start = 0.04, 0.8, 700.0, np.array([0.1, -0.05, 0.7])

    def image(when):
        p = start - [0, 0, arm]
        p = expm(-speed * when * cross_matrix((0, 1, 0))) @ p + [0, 0, arm]
        return p, focal * p[:2] / p[2]

    h, now = 1e-3, 2.0
    slope = (image(now + h)[1] - image(now - h)[1]) / (2 * h)
    (a, b, c), _ = image(now)
    stated = [
        -focal * speed * (a**2 + c**2 - arm * c) / c**2,
        -focal * speed * b * a / c**2,
    ]
    np.testing.assert_allclose(slope, stated, atol=1e-7)
    by_claim = turning.turn().s_dot.subs(
        dict(
            zip(
                (*section_4_1_slide.p_0, turning.d_z, omega, t),
                (*start, arm, speed, now),
                strict=True,
            )
        )
    )
    by_claim = by_claim.subs({turning.F_x: focal, turning.F_y: focal})
    np.testing.assert_allclose(np.array(by_claim, dtype=float).ravel(), stated, rtol=1e-12)


# How it shows itself -----------------------------------------------------------------------------
def test_the_ledger_is_a_tuple_of_frozen_claims():
    assert vs.derive.ledger() is LEDGER and isinstance(LEDGER, tuple)
    assert all(isinstance(claim, derive.Claim) for claim in LEDGER)
    with pytest.raises(dataclasses.FrozenInstanceError):
        LEDGER[0].status = "erratum"


def test_as_text_is_a_table_that_fits_a_terminal():
    text = as_text(LEDGER)
    lines = text.splitlines()
    assert max(map(len, lines)) <= 100
    starts = [line for line in lines if not line.startswith(" ")]
    assert [line.split("  ")[0] for line in starts] == [claim.equation for claim in LEDGER]
    flat = " ".join(text.split())
    for claim in LEDGER:
        assert " ".join(claim.statement.split()[:3]) in flat
    assert "→ V = −ω r̃ d" in flat
    assert as_text([]) == ""
    assert as_text([BY_NAME["(6) e'"]]) == "(6) e'  holds  e' = ∂e/∂r · ∂r/∂t + ∂e/∂t"


def test_a_claim_shows_its_formula_in_a_notebook_and_itself_in_a_line():
    assert r"\lambda" in BY_NAME["(6)"]._repr_latex_()
    assert BY_NAME["§4.1 start"]._repr_latex_() is None
    assert str(BY_NAME["(17) V"]).startswith("(17) V erratum: V = ω r̃ d → V = −ω r̃ d")


def test_nothing_is_derived_before_it_is_asked_for(monkeypatch):
    """Reading the ledger, unlike proving it, calls no derivation."""
    monkeypatch.setattr(motion, "point_motion", None)
    claims.ledger.cache_clear()
    assert len(claims.ledger()) == len(LEDGER)
    claims.ledger.cache_clear()
