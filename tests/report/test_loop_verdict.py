"""What is said first of a loop is true, by formulas and scans that ask no diagram."""

import math
import re

import numpy as np
import pytest
from effort import share
from oracles.random_loops import averaging, slow_and_fast

import vsctrl as vs
from vsctrl.diagram import Applied, Loop
from vsctrl.report.loop_verdict import loop_verdict, own_limits
from vsctrl.report.wording import digits, time
from vsctrl.study.examination.gain_ranges import known
from vsctrl.symbols import s

STEP = (Applied("r"),)


def unity(transfer, sum_="e = r - y", **fields):
    """A loop of one block under unit feedback, from the text of its transfer function."""
    sampling = (
        f'[sampling]\nperiod = {fields.pop("period")}\nhold = "u"' if "period" in fields else ""
    )
    return Loop.from_toml(f"""
        inputs = ["r"]
        outputs = ["y"]
        time_unit = "{fields.pop("unit", "s")}"
        [[block]]
        sum = "{sum_}"
        [[block]]
        name = "law"
        wiring = "e -> u"
        gain = 1
        [[block]]
        name = "plant"
        wiring = "u -> y"
        transfer = "{transfer}"
        [[apply]]
        input = "r"
        size = {fields.pop("size", 1)}
        {sampling}
    """)


def said(loop):
    margins = known(lambda: loop.open.margins())
    found = loop_verdict(loop, margins, own_limits(loop, margins))
    return found.kind, " ".join(found.sentences)


def test_an_integrator_with_dead_time_has_its_closed_form_limits():
    """K e^{−s}/s: stable up to K = π/2, and bears π/(2K) − 1 s more; Ms of K = 0.5057 is 1.6."""
    kind, words = said(unity("0.5057*exp(-s)/s"))
    assert kind == "good" and f"raised {math.pi / 2 / 0.5057:.3g}-fold" in words
    assert f"bears {math.pi / 2 / 0.5057 - 1:.3g} s more" in words and "Ms = 1.6." in words
    kind, words = said(unity("2*exp(-s)/s"))
    assert kind == "bad" and f"less than {math.pi / 4:.3g} times its gain" in words


def test_a_loop_that_a_computer_closes_is_judged_as_sampled():
    """κλTₛ up to 2 sin(π/(2(2d + 1))): at 40 ms and d = 2 that is 15.451, not 19.635 s⁻¹."""
    kind, words = said(vs.load("vsctrl/examples/figure1.toml"))
    limit = 2 * math.sin(math.pi / 10) / 0.04 / 2.5
    assert kind == "good" and f"as sampled, its gain may be raised {limit:.3g}-fold" in words
    bears = max(d for d in range(99) if 2 * math.sin(math.pi / (2 * (2 * d + 1))) > 0.1) - 2
    assert f"{bears} further periods" in words
    assert f"In continuous time its gain could be raised {math.pi / 2 / 0.2:.3g}-fold." in words


def test_the_answers_of_a_loop_that_a_computer_closes_are_those_at_its_samples():
    """y⁺ = y + K (r − y[k − 1]) at 1 s, of K e^{−s}/s, K = 0.5, by recursion."""
    y = [0.0, 0.0]
    for _ in range(100):
        y.append(y[-1] + 0.5 * (1 - y[-2]))
    y = np.array(y[1:])
    _, words = said(unity("0.5*exp(-s)/s", period=1, size=2))
    # The output of the plant is one period late itself.
    settled = np.flatnonzero(np.abs(y - 1) > 0.02)[-1] + 2
    rise = (y >= 0.9).argmax() - (y >= 0.1).argmax()
    over = digits(100 * (y.max() - 1), 3)
    assert (
        f"As sampled, after a step of 2 in r, y rises in {rise} s, overshoots by {over} %" in words
    )
    assert f"and settles at 2, within 2 % after {settled} s." in words


@pytest.mark.parametrize(
    ("loop", "word"),
    [
        (unity("0.5057*exp(-s)/s"), "stable"),
        (unity("exp(-s)/s"), "stable, little margin"),
        (unity("2*exp(-s)/s"), "unstable"),
        (unity("(s + 2)/(2*s + 1)*0.9"), "stable"),
        (unity("2*(s + 1)/(s + 1/2)"), "stable, bears no delay"),
        (unity("1.2*exp(-s/100)*(s + 1)/(s + 3)", period=4), "stable, as sampled only"),
    ],
)
def test_a_table_calls_a_loop_by_what_is_to_say_against_it(loop, word):
    margins = known(lambda: loop.open.margins())
    assert loop_verdict(loop, margins, own_limits(loop, margins)).word == word


def test_a_loop_that_only_the_hold_makes_unstable():
    kind, words = said(unity("1.3*exp(-s)/s", period=1))  # d = 1: up to K = 1
    assert kind == "bad" and "unstable as sampled every 1 s, though" in words
    assert f"less than {1 / 1.3:.3g} times" in words


def test_an_unstable_plant_is_not_told_to_lower_its_gain():
    """g/(s − 1) needs g > 1; at 1.1 e^{−0.1s} more gain is what lowers Ms."""
    kind, words = said(unity("0.5/(s-1)"))
    assert kind == "bad" and "more than 2 times its gain" in words and "Lower" not in words
    kind, words = said(unity("1.1*exp(-0.1*s)/(s-1)"))
    assert kind == "warning" and "raise the gain" in words and "lower the gain" not in words
    assert f"lowered to {1 / 1.1:.3g} times" in words


def test_a_conditionally_stable_loop_is_told_both_ends():
    """s³ + g(s + 1)² is stable for g > 1/2, by Routh."""
    assert "more than 1.67 times its gain" in said(unity("0.3*(s+1)**2/s**3"))[1]
    assert "lowered to 0.05 times" in said(unity("10*(s+1)**2/s**3"))[1]
    # 2 e^{−0.9s}/(s − 1) is stable between 1/2 and √(1 + ω²)/2 where tan 0.9ω = ω.
    w = min((abs(math.tan(0.9 * w) - w), w) for w in np.linspace(0.3, 1.4, 100001))[1]
    _, words = said(unity("2*exp(-0.9*s)/(s-1)"))
    assert f"0.5 to {math.hypot(1, w) / 2:.3g} times its gain" in words


def test_roots_on_the_axis_are_said_to_be_there():
    kind, words = said(unity("1/s**2"))
    assert kind == "bad" and "2 characteristic roots are on the imaginary axis" in words
    assert "No gain at y" in words


def test_positive_feedback_is_named_where_the_sign_is_the_fault():
    kind, words = said(unity("1/(s*(s+1))", "e = r + y"))
    assert kind == "bad" and "With the opposite sign at y it is stable" in words
    kind, words = said(unity("1.5/(s+1)", "e = r + y"))
    assert kind == "bad" and "less than 0.667 times" in words and "pair" not in words


def test_a_chain_of_roots_that_tends_to_the_axis_is_not_called_stable():
    """(s + 0.5) e^{−s}/(s + 1) → e^{−s}: as good as unstable, and any delay makes it so."""
    kind, words = said(unity("(s+0.5)*exp(-s)/(s+1)"))
    assert kind == "bad" and "not stable" in words and "inf" not in words


def test_a_loop_without_any_delay_to_spare_is_not_green():
    kind, words = said(unity("3"))
    assert kind == "warning" and "no further delay at all" in words and "0.75 at once" in words


@pytest.mark.parametrize(
    "transfer, size, words",
    [
        (
            "2/(s+1)",
            3,
            f"rises in {math.log(9) / 3:.3g} s and settles at 2, within 2 % after 1.3 s",
        ),
        ("2/(s+1)", -3, "falls in 0.732 s and settles at −2"),
        ("2e-8/(s+1)", 1, "settles at 2·10⁻⁸"),
        ("4/(s*(s+2))", 1, f"overshoots by {100 * math.exp(-math.pi / math.sqrt(3)):.3g} % and"),
        ("s/(s+1)", 1, "is off by up to 0.5 (at once) and back within 2 % of that after 7.82 s"),
    ],
)
def test_step_responses_of_first_and_second_order(transfer, size, words):
    _, found = said(unity(transfer, size=size))
    assert words in found and f"a step of {digits(size, 4)} in r" in found
    assert "Infinity" not in found


def test_a_loop_without_feedback():
    alone = vs.Diagram([vs.Block("P", 2 / (s + 1), "r -> y")], inputs=["r"], outputs=["y"])
    kind, words = said(Loop(alone, applied=STEP))
    assert kind == "good" and "No loop runs through any signal" in words


def test_times_are_told_in_a_unit_that_suits_them():
    assert time(7.85e-5, "s") == "78.5 µs" and time(36300, "s") == "10.1 h"
    assert time(0.04, "s") == "0.04 s" and time(300, "min") == "5 min"
    assert time(0, "h") == "0 h" and digits(-0.0, 3) == "0" and digits(1e9, 2) == "1·10⁹"


def scan(made):
    """L on jω closely enough to follow it, and the roots of 1 + L right of the axis by Nyquist.

    L falls, and but at 0 its poles are left of the axis: from a small s > 0 round 0 and up the axis
    1 + L turns by −π for each root.
    """
    top = 1e6
    while abs(made.L(1j * top)) < 1e-3 and top > 1e-6:
        top /= 2
    if top * made.delay > 2e4 or abs(made.L(1j * top)) > 0.01:
        return None
    w = np.geomspace(1e-8, top, 100_000)
    w = np.union1d(w, np.linspace(1e-8, top, int(50 * top * made.delay) + 2))
    L = made.L(1j * w)
    round_zero = 1e-8 * np.exp(1j * np.linspace(0, math.pi / 2, 1000))
    turn = np.unwrap(np.angle(1 + np.concatenate([made.L(round_zero), L])))
    return w, L, round(-(turn[-1] - turn[0]) / math.pi)


def sensitivity(made, w, factor):
    """Ms with a factor in the gain: on the grid, and where that is highest ever closer."""
    for _ in range(6):
        size = np.abs(1 + factor * made.L(1j * w))
        k = int(size.argmin())
        w = np.linspace(w[max(k - 1, 0)], w[min(k + 1, len(w) - 1)], 1000)
    return float(1 / size.min())


@pytest.mark.parametrize("seed", range(share(120)))
def test_a_verdict_is_that_of_a_scan_of_the_open_loop(seed):
    rng = np.random.default_rng(seed)
    made = (slow_and_fast, averaging)[seed % 2](rng)
    found = scan(made)
    if found is None:
        return
    w, L, roots = found
    kind, words = said(Loop(made.system().diagram, opened="y", applied=STEP))
    crossing = (L.imag[:-1] * L.imag[1:] < 0) & (np.diff(w) < 0.1 * w[1:])
    (x, y), (x1, y1) = ((at.real[crossing], at.imag[crossing]) for at in (L[:-1], L[1:]))
    met = x - y * (x1 - x) / (y1 - y)
    factors = -1 / met[met < 0]
    assert not re.search(r"nan|inf\b|None|e-\d|e\+\d", words)
    if roots:
        assert kind == "bad" and f"unstable: {roots} characteristic root" in words
        if below := re.search(r"stable with less than (\S+) times", words):
            assert abs(np.log(factors / float(below[1]))).min() < 6e-3
        return
    peak = sensitivity(made, w, 1.0)
    shown = float(re.search(r"Ms = (\d+(?:\.\d+)?)", words)[1])
    assert "This loop is stable." in words and shown == pytest.approx(max(1.0, peak), rel=6e-3)
    if abs(peak / 2 - 1) > 1e-3:
        assert kind == ("warning" if peak > 2 else "good")
    if (higher := factors[(factors > 1.001) & (factors < 50)]).size:
        up = float(re.search(r"raised (\S+)-fold", words)[1])
        assert up == pytest.approx(higher.min(), rel=6e-3)
    # Ms falls where the sentence says so.
    for word, factor in (("lower", 0.9), ("raise", 1.1)):
        if f": {word} the gain" in words:
            assert sensitivity(made, w, factor) < peak
