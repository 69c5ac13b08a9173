"""What a delay system does between samples when all its inputs are held, in closed form.

    x[k+1] and y[k]  =  Σ_d taps[d] · [x[k−d]; u[k−d]]

Every delayed signal is first written out as delayed states and delayed inputs, which ends because
no loop of delays is left. A state at a time between samples is then the state at the sample
before, moved on by matrix exponentials over the pieces on which all delayed inputs are constant.
Nothing is approximated, and no state is copied: a copy of an unstable state that is driven by the
same input would be a hidden unstable mode. Delays and pieces are fractions, so that a delay of
three periods is three periods and not 2.9999999999999996.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from itertools import pairwise

import numpy as np
from scipy.linalg import expm

from vsctrl import timing
from vsctrl.arrays import Array
from vsctrl.checks import quoted
from vsctrl.diagram.numerics.graphs import closure, reached
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.errors import InputError

Taps = dict[int, Array]  #: samples ago → matrix
Table = dict[Fraction, Array]  #: seconds ago → matrix


def sample(system: DelaySystem, period: Fraction, hold: str) -> Taps:
    """The taps of the system whose inputs are held over each period (s); `hold` is for messages.

    Rows are [x; y], columns [x; u]. Errors: `InputError` for delays in a loop of their own.
    """
    table = written_out(system, hold)
    n, width = len(system.A), system.inputs + len(system.A)
    flow = _Flow(table, n, period)
    taps: Taps = {}
    for i in range(n):
        _add(taps, flow.moved(i, period), i, n + system.outputs)
    for theta, matrix in table.items():
        for i, row in enumerate(matrix[n:], start=n):
            samples_ago, _ = ago(theta, period)
            held = np.zeros(width)
            held[n:] = row[n:]  # an input is the same anywhere in its period
            _add(taps, {samples_ago: held}, i, n + system.outputs)
            for k in np.flatnonzero(row[:n]):
                _add(taps, flow.at(int(k), theta), i, n + system.outputs, row[k])
    return {d: taps[d] for d in sorted(taps) if d == 0 or taps[d].any()}


def ago(theta: Fraction, period: Fraction) -> tuple[int, Fraction]:
    """(d, g) of θ = d·period − g, 0 ≤ g < period: what is delayed by θ is g after the sample k − d.

    Decimals of 1/30 s and 2/30 s are not quite one and two periods; `timing` calls them so.
    """
    n, fraction = timing.split(theta / period)
    return (n + 1, (1 - fraction) * period) if fraction else (n, Fraction(0))


def written_out(system: DelaySystem, hold: str) -> Table:
    """[x'; y] = Σ_θ table[θ] · [x(t−θ); u(t−θ)]: the delay channels put into each other."""
    n, r, p = len(system.A), system.inputs, system.outputs
    direct = np.hstack([system.C[p:], system.D[p:, :r]])
    done: dict[int, Table] = {}

    def channel(j: int, above: tuple[int, ...]) -> Table:
        if j in above:
            raise _uncut([system.delays[i] for i in above[above.index(j) :]], hold)
        if j not in done:
            tau = system.delays[j]
            out = {tau: direct[j].copy()}
            for i in np.flatnonzero(system.D[p + j, r:]):
                for theta, row in channel(int(i), (*above, j)).items():
                    out[theta + tau] = out.get(theta + tau, 0.0) + system.D[p + j, r + i] * row
            done[j] = out
        return done[j]

    x, y = np.hstack([system.A, system.B[:, :r]]), np.hstack([system.C[:p], system.D[:p, :r]])
    table = {Fraction(0): np.vstack([x, y])}
    for j in range(len(system.delays)):
        into = np.concatenate([system.B[:, r + j], system.D[:p, r + j]])
        for theta, row in channel(j, ()).items():
            table[theta] = table.get(theta, 0.0) + np.outer(into, row)
    _check_cut(table, n, hold)
    return {theta: table[theta] for theta in sorted(table)}


def _check_cut(table: Table, n: int, hold: str) -> None:
    """Refuse a state that acts on itself through a delay: its twin in z would be infinite."""
    inner = {theta: matrix[:n, :n] != 0 for theta, matrix in table.items()}
    back = closure(np.any(list(inner.values()), axis=0)).T
    loops = [theta for theta, edges in inner.items() if theta and (edges & back).any()]
    if loops:
        raise _uncut(loops, hold)


def _uncut(delays: list[Fraction], hold: str) -> InputError:
    shown = ", ".join(f"{float(tau):g} s" for tau in dict.fromkeys(delays))
    return InputError(
        f"sampled: the hold at {quoted(hold)} does not cut the loop with the delay of {shown}, "
        "so what "
        "goes round in it has no finite twin in z; hold a signal of that loop, or name one of its "
        "blocks in digital."
    )


def _add(taps: Taps, new: Taps, row: int, rows: int, factor: float = 1.0) -> None:
    for d, values in new.items():
        if d not in taps:
            taps[d] = np.zeros((rows, len(values)))
        taps[d][row] += factor * values


class _Flow:
    """The states between samples: x' = Σ_θ table[θ][:n] · [x(t−θ); u(t−θ)], u held."""

    def __init__(self, table: Table, n: int, period: Fraction) -> None:
        self.table, self.n, self.period = table, n, period
        self._width = int(table[Fraction(0)].shape[1])
        self.moved = cache(self._moved)

    def at(self, state: int, theta: Fraction) -> Taps:
        """x_state(kT − θ) over the samples [x; u][k−d]: θ = d T − g, so g after sample k−d."""
        samples_ago, after = ago(theta, self.period)
        if after == 0:
            return {samples_ago: np.eye(self._width)[state]}
        return {d + samples_ago: row for d, row in self.moved(state, after).items()}

    def _moved(self, state: int, after: Fraction) -> Taps:
        """x_state(kT + after), 0 < after ≤ T, over the samples [x; u][k−d]."""
        nodes = self._upstream(state)
        A, B, lags = self._equations(nodes)
        size, r = len(nodes), self._width - self.n
        Z: Taps = {}
        for row, (i, theta) in enumerate(nodes):
            _add(Z, self.at(i, theta), row, size)
        # An input delayed by θ = d T − g changes T − g after each sample, from k−d to k−d+1.
        split = [ago(theta, self.period) for theta in lags]
        samples_ago, change = [d for d, _ in split], [self.period - g for _, g in split]
        cuts = sorted({c for c in change if c < after} | {Fraction(0), after})
        for start, end in pairwise(cuts):
            both = np.zeros((size + B.shape[1], size + B.shape[1]))
            both[:size] = np.hstack([A, B]) * float(end - start)
            moved = np.asarray(expm(both)[:size], float)
            Z = {d: moved[:, :size] @ matrix for d, matrix in Z.items()}
            for j, (d, c) in enumerate(zip(samples_ago, change, strict=True)):
                tap = d if start < c else d - 1
                Z.setdefault(tap, np.zeros((size, self._width)))
                Z[tap][:, self.n :] += moved[:, size + j * r : size + (j + 1) * r]
        return {d: matrix[0] for d, matrix in Z.items() if matrix[0].any()}

    def _upstream(self, state: int) -> list[tuple[int, Fraction]]:
        """All (state, delay) that the present state follows from, itself first."""

        def sources(node: tuple[int, Fraction]) -> list[tuple[int, Fraction]]:
            i, theta = node
            rows = {theta + delay: matrix[i, : self.n] for delay, matrix in self.table.items()}
            return [(int(k), total) for total, row in rows.items() for k in np.flatnonzero(row)]

        return reached([(state, Fraction(0))], sources)

    def _equations(self, nodes: list[tuple[int, Fraction]]) -> tuple[Array, Array, list[Fraction]]:
        """Z' = A Z + Σ_θ B_θ u(t−θ) for the nodes, B side by side in the order of the θ."""
        place = {node: row for row, node in enumerate(nodes)}
        r = self._width - self.n
        A = np.zeros((len(nodes), len(nodes)))
        inputs: Table = {}
        for (i, theta), row in place.items():
            for delay, matrix in self.table.items():
                for k in np.flatnonzero(matrix[i, : self.n]):
                    A[row, place[int(k), theta + delay]] += matrix[i, k]
                if matrix[i, self.n :].any():
                    inputs.setdefault(theta + delay, np.zeros((len(nodes), r)))
                    inputs[theta + delay][row] += matrix[i, self.n :]
        lags = sorted(inputs)
        return A, np.hstack([np.zeros((len(nodes), 0)), *(inputs[th] for th in lags)]), lags
