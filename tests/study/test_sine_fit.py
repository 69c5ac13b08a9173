"""The fit of a sine to samples, against closed forms and the normal equations typed here."""

import numpy as np
import pytest

from vsctrl.study.sine_fit import sine_fit


@pytest.mark.parametrize("answer", [0.3 - 0.4j, -2.0 + 0j, 1e-6j])
def test_a_sine_is_found_to_rounding(answer):
    t = np.sort(np.random.default_rng(1).uniform(0.0, 3.0, 25))
    values = np.abs(answer) * np.sin(2.5 * t + np.angle(answer))
    assert sine_fit(t, values, 2.5) == pytest.approx(answer, rel=1e-12)


def test_of_other_samples_it_is_the_nearest_sine():
    t, omega = np.linspace(0.0, 2.0, 40), 4.0
    values = np.random.default_rng(2).normal(size=40)
    s, c = np.sin(omega * t), np.cos(omega * t)
    a, b = np.linalg.inv([[s @ s, s @ c], [s @ c, c @ c]]) @ [s @ values, c @ values]
    assert sine_fit(t, values, omega) == pytest.approx(complex(a, b), rel=1e-12)


def test_over_whole_cycles_a_constant_and_a_harmonic_are_not_seen():
    t = np.arange(60) / 60 * 2 * np.pi / 1.7  # one cycle, its end left out
    values = 0.5 * np.cos(1.7 * t) + 3.0 + np.sin(2 * 1.7 * t)
    assert sine_fit(t, values, 1.7) == pytest.approx(0.5j, abs=1e-13)
