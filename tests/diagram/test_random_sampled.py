"""Random loops run by a computer, against Gauss collocation of what is between the samples.

The oracle cuts the loop itself, integrates the answer of every box to one held pulse with every
delay on its mesh (`Network.response`), and closes the loop by adding up pulses sample by sample.
No matrix exponential, no shift register and no z is in it.
"""

from dataclasses import replace

import effort
import numpy as np
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from oracles.delay import Box, Network
from test_random_diagrams import networks

from vsctrl.diagram.sampled.poles import poles as poles_of

FEW = settings(
    max_examples=effort.share(20),
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
SAMPLES = 30
cases = st.tuples(networks(), st.sampled_from([1, 2, 3, 7]), st.integers(0, 4))


def pulses(network, drive, q):
    """Right limits at t = kT of every y_i, (SAMPLES, N), when `drive` carries 1 for one period."""
    period = q * network.delta
    given = replace(network, drive=drive)
    _, y = given.response(lambda t: (t < period) * 1.0, SAMPLES * period)
    # The Gauss nodes of a step lie inside of it; its polynomial is read at its beginning.
    x, _ = np.polynomial.legendre.leggauss(network.nodes)
    to_left = np.linalg.solve(
        np.polynomial.legendre.legvander(x, network.nodes - 1).T,
        np.polynomial.legendre.legvander(np.array([-1.0]), network.nodes - 1)[0],
    )
    steps = y.reshape(-1, network.nodes, len(network.boxes))
    return np.einsum("k,ski->si", to_left, steps[::q])


def brute_force(network, q, hold, samples):
    """y_i(kT), (len(samples), N), with y_hold sampled and held, and r held."""
    opened = network.wiring.copy()
    opened[:, hold] = 0.0
    cut = replace(network, wiring=opened)
    from_r, from_hold = (
        pulses(cut, drive, q) for drive in (network.drive, network.wiring[:, hold])
    )
    y, held = np.zeros((len(samples), len(network.boxes))), np.zeros(len(samples))
    for k in range(len(samples)):
        y[k] = samples[k::-1] @ from_r[: k + 1] + held[k::-1] @ from_hold[: k + 1]
        # The loop has a strictly proper box, but y_hold may reach the other boxes at once.
        held[k] = y[k, hold] / (1 - from_hold[0, hold])
        y[k] += held[k] * from_hold[0]
    return y


def twin(case):
    network, q, hold = case
    hold %= len(network.boxes)
    system = network.diagram().at()
    return system.sampled(q / 10, hold=f"y{hold}"), (network, q, hold)


@FEW
@given(cases)
def test_samples_are_those_of_collocation_between_them(case):
    sampled, wired = twin(case)
    samples = np.random.default_rng(0).standard_normal(SAMPLES)
    y = brute_force(*wired, samples)
    scale = max(1.0, np.abs(y).max())
    for i in range(y.shape[1]):
        found = sampled["r", f"y{i}"].response(samples).outputs
        assert np.abs(found - y[:, i]).max() < 1e-11 * scale


@FEW
@given(cases)
def test_values_in_z_are_the_sums_of_the_pulse(case):
    """Σ y[k] z^{−k} on |z| = R, where what follows the last sample is below 1e-12."""
    sampled, wired = twin(case)
    y = brute_force(*wired, np.eye(SAMPLES)[0])
    growth = max(1.0, np.abs(sampled.poles(1)).max(initial=0.0))
    R = growth * 1e13 ** (1 / SAMPLES)
    z = R * np.exp(1j * np.array([0.0, 0.4, 1.9, np.pi]))
    expected = (z[:, None] ** -np.arange(SAMPLES)) @ y
    for i in range(y.shape[1]):
        channel = sampled["r", f"y{i}"]
        scale = 1 + np.abs(expected[:, i])
        assert (np.abs(channel(z) - expected[:, i]) < 1e-10 * scale).all()
        assert (np.abs(channel.state_space()(z) - channel(z)) < 1e-10 * scale).all()


@FEW
@given(cases)
def test_the_poles_annihilate_the_pulse_response(case):
    """Π (1 − p q) y[k] = 0 once all that is late has arrived: no pole is missing or wrong."""
    sampled, wired = twin(case)
    y = brute_force(*wired, np.eye(SAMPLES)[0])
    for i in range(y.shape[1]):
        channel = sampled["r", f"y{i}"]
        poles = channel.poles()
        filtered, size = y[:, i], np.abs(y[:, i])
        for pole in poles:
            filtered = filtered - pole * np.concatenate([[0.0], filtered[:-1]])
            size = size + np.abs(pole) * np.concatenate([[0.0], size[:-1]])
        rest = slice(channel.difference_equation.order + 1, None)
        assert (np.abs(filtered[rest]) <= 1e-10 * np.maximum(size[rest], 1.0)).all()


#: A step of the iteration for its poles lands on one of them, where it must stay.
ON_A_POLE = Network(
    boxes=(
        Box(num=(0.3, -0.1), den=(1.0, 2.9), steps=5),
        Box(num=(-0.3,), den=(1.0, 2.1), steps=8),
        Box(num=(-1.8,), den=(1.0, 1.3), steps=1),
        Box(num=(-1.1, -1.7), den=(1.0, 1.9, 2.3), steps=1),
    ),
    wiring=np.roll(np.eye(4), 1, axis=0),
    drive=np.eye(4)[0],
    delta=0.1,
    nodes=12,
)


@FEW
@example((ON_A_POLE, 2, 3))
@given(cases)
def test_the_opened_loop_closes_to_the_same_poles(case):
    """1 + L(p) = 0 at each pole that the loop moves, and `stable` says where they are."""
    sampled, _ = twin(case)
    L = sampled.open()
    poles, open_poles = poles_of(L.closed), L.poles()
    for pole in poles[np.abs(poles) > 0.3]:
        if np.abs(open_poles - pole).min(initial=1.0) < 1e-4:
            continue  # a zero of one box cancels it, so that L is blind to it
        # Where L is steep a rounding of the pole is more of a rounding of L.
        near = pole * (1 + 1e-7 * np.exp(2j * np.pi * np.arange(8) / 8))
        assert abs(1 + L(pole)) <= 1e-3 * np.abs(1 + L(near)).max() + 1e-9
    # Boxes are stable, so that what is outside of the circle is the loop's.
    outside = int((np.abs(poles) >= 1).sum())
    assert outside == int((np.abs(sampled.poles()) >= 1).sum())
