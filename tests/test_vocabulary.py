"""Words of other tools lead to the names here, wherever a key, a field or a keyword is typed."""

import numpy as np
import pytest

import vsctrl as vs
from vsctrl.errors import InputError, nearest
from vsctrl.servo.scenario.description import TABLE_OF

# What is typed, and what it is to lead to; numbers in the unit of the field.
FIELDS = {
    "gain": (3.0, "'lam'"), "lambda": (3.0, "'lam'"), "λ": (3.0, "'lam'"), "K_p": (3.0, "'lam'"),
    "fps": (25, "period = 0.04"), "rate": (50, "period = 0.02"),
    "frame_rate": (1000, "period = 0.001"),
    "Hz": (25.0, "period = 0.04"), "dt": (0.04, "'period'"), "sample time": (0.04, "'period'"),
    "delay": (0.08, "'latency'"), "tau": (0.08, "'latency'"), "latency_ms": (80, "latency = 0.08"),
    "dead time": (0.1, "'dead_time'"), "Dead-Time": (0.1, "'dead_time'"),
    "focal": (700, "'Fx' and 'Fy'"), "f": (700, "'Fx' and 'Fy'"), "time": (9, "'duration'"),
    "feedforward": (False, "k_ff = 0"), "feed_forward": (True, "k_ff = 1"), "ff": (0.8, "'k_ff'"),
    "velocity": ((0.04, 0, 0), "'V'"), "omega": ((0, 0, 1), "'Omega'"),
    "noise": (0.3, "'noise_px'"),
    "rpy": ((0, 0, 0), "'euler_xyz_deg'"), "resolution": ((640, 480), "'size_px'"),
    "kalman": ("velocity", "'predictor'"), "max_speed": (0.2, "'speed_limit'"),
    "jacobian": ("mean", "'interaction'"), "leds": ([], "'points'"), "dropout": (0.1, "'missed'"),
}  # fmt: skip


@pytest.mark.parametrize("word", FIELDS)
def test_a_field_by_another_word(word):
    value, meant = FIELDS[word]
    with pytest.raises(InputError) as caught:
        vs.paper.sliding().with_(**{word: value})
    assert f"(did you mean {meant}?)" in str(caught.value)


# A line of a file that is replaced, and everything that is then said.
LINES = {
    "lam = 2.5": ("gain = 2.5", "law.gain: unknown key with value 2.5 (did you mean 'lam'?)."),
    "period = 0.04": (
        "fps = 25", "vision.fps: unknown key with value 25 (did you mean period = 0.04?)."
    ),
    "latency = 0.08": (
        '"dead time" = 0.08', "vision.dead time: unknown key with value 0.08 (did you mean "
        "'latency'?)."
    ),
    "duration = 9.0": (
        "time = 9.0", "motion.time: unknown key with value 9 (did you mean 'duration'?)."
    ),
    "V = [0.04, 0.0, 0.0]": (
        "speed = 0.04", 'motion.speed: unknown key with value 0.04; a motion of kind "screw" has '
        'no such key, only kind "rotation" or "oscillation" (did you mean \'V\'?).'
    ),
    'depth = "true"': (
        "depth = 0.8", "law.depth: 0.8 is a number where a word belongs, true, constant or "
        "estimated; how far the target is follows from start.position, a depth that the law has "
        "wrong is law.depth_ratio (in L: true, constant (that at the start) or estimated from "
        "motion)."
    ),
    "k_ff = 1.0": (
        "k_ff = 1.0\ndelay = 0.08",
        "law.delay: unknown key with value 0.08 (did you mean 'latency' in [vision]?).",
    ),
    'name = "sliding"': (
        "fps = 25", "fps: unknown key with value 25 (did you mean period = 0.04 in [vision]?)."
    ),
}  # fmt: skip


@pytest.mark.parametrize("line", LINES)
def test_a_key_of_a_file_by_another_word_is_one_slip(line):
    text, (new, said) = vs.paper.sliding().to_toml(), LINES[line]
    assert text.count(line) == 1
    with pytest.raises(InputError) as caught:
        vs.Scenario.from_toml(text.replace(line, new))
    assert str(caught.value) == said


CALLS = {
    "at": (lambda: vs.figure1.at(gain=1, tau=1), "'lam'"),
    "at, latency": (lambda: vs.figure1.at(latency=1), "'tau'"),
    "gain_limit": (lambda: vs.loop.gain_limit(latency=0.08), "'tau'"),
    "gain_limit, fps": (lambda: vs.loop.gain_limit(tau=0.08, fps=25), "period = 0.04"),
    "gain_for": (lambda: vs.loop.gain_for(latency=0.08, damping=0.7), "'tau'"),
    "gain_for, zeta": (lambda: vs.loop.gain_for(tau=0.08, zeta=0.7), "'damping'"),
    "per_sample": (lambda: vs.per_sample(0.1, fps=25), "period = 0.04"),
    "tracking_error": (lambda: vs.loop.tracking_error(vs.Ramp(1), delay=0.08), "'tau'"),
    "matrix_gain_limit": (lambda: vs.loop.matrix_gain_limit(np.eye(6), latency=0.1), "'tau'"),
    "sliding": (lambda: vs.paper.sliding(gain=3), "'lam'"),
    "sliding, delay": (lambda: vs.paper.sliding(delay=0.1), "'latency'"),
}


@pytest.mark.parametrize("name", CALLS)
def test_a_keyword_by_another_word(name):
    call, meant = CALLS[name]
    with pytest.raises(InputError) as caught:
        call()
    assert f"(did you mean {meant}?)" in str(caught.value)


def test_a_keyword_that_means_nothing_lists_all_that_there_are():
    with pytest.raises(InputError, match=r"gain_limit: .* 'qqq'; it takes tau, period, kappa\."):
        vs.loop.gain_limit(qqq=1)


def test_a_word_means_only_what_is_there():
    """Whoever has a parameter of that name meant it, and a diagram without a gain has none."""
    assert nearest("gain", ["gain"]) == " (did you mean 'gain'?)"
    assert nearest("gain", ["K", "T_I"]) == " (did you mean 'K'?)"
    assert nearest("fps", ["alpha", "beta"]) == ""
    assert (
        nearest("fps", ["period"], 0)
        == nearest("fps", ["period"], -5)
        == (" (did you mean 'period'?)")
    )


def test_no_word_of_another_tool_is_a_field_that_means_something_else():
    """A field of a scenario is itself, whatever else its name may stand for elsewhere."""
    for name in TABLE_OF:
        assert nearest(name, TABLE_OF) == f" (did you mean {name!r}?)"


def test_a_loop_without_a_signal_t_is_asked_which_one_is_held():
    diagram = vs.Diagram(
        [vs.Sum("e = r - y"), vs.Block("PI", 2, "e -> u"), vs.Block("process", 0.5, "u -> y")],
        inputs=["r"],
    )
    with pytest.raises(InputError, match=r"'e' or 'u': sampled\(0\.5, hold='e'\)") as caught:
        diagram.at().sampled(0.5)
    assert "no signal is called 'T'" in str(caught.value)
