"""One video frame of the loop as a linear map: the twin of a scenario, frame by frame.

What is between two frames is solved exactly: the command arrives late by any fraction of a period,
axes of first order follow it, and the image was taken at any time in a frame. Nothing here knows
the diagrams and their sampled twin, nor the simulator; that all three agree is evidence.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vsctrl import timing
from vsctrl.caching import Caching
from vsctrl.errors import LimitError
from vsctrl.loop.scenario_loop.elements import Elements
from vsctrl.loop.scenario_loop.kalman import SteadyFilter, steady_filter

Values = NDArray[Any]  #: one number per direction, (m,), real or complex

MOST_STATES = 2000  #: of a loop, from which on its eigenvalues take minutes


@dataclass(frozen=True)
class State:
    """What the loop remembers at a frame; every entry is (m,), of m directions.

    `q`: camera, `rate`: of lagging axes; `commands`: the latest first; `taken`: where the camera
    was when the images of the frames before were taken, the latest first; `path`: q at the frames
    before; `total`: of the integral; `filtered`: states of a Kalman filter.
    """

    q: Values
    rate: Values
    commands: tuple[Values, ...]
    taken: tuple[Values, ...]
    path: tuple[Values, ...]
    total: Values
    filtered: tuple[Values, ...]

    def flat(self) -> Values:
        """All of it, (n, m)."""
        return np.array(
            [self.q, self.rate, *self.commands, *self.taken, *self.path, self.total, *self.filtered]
        )


@dataclass(frozen=True, eq=False)
class FrameMap(Caching):
    """The loop of `elements`, frame by frame; `kappa` is that of a direction, or M, (m, m).

    Commands are twists T (m,), and q is where they lead, q′ = T. The law sees M q late, compares it
    with M q*, and commands T = −λ (…) + k_ff M q*′.
    """

    elements: Elements
    kappa: complex | Values

    def image(self, q: Values) -> Values:
        """What L̂⁺ makes of where the camera is: M q."""
        return np.asarray(self.kappa @ q if isinstance(self.kappa, np.ndarray) else self.kappa * q)

    @cached_property
    def _command(self) -> tuple[int, float]:
        """Whole periods and the share of one by which a command arrives late."""
        return timing.split(self.elements.command_age / self.elements.period)

    @cached_property
    def _taken(self) -> tuple[int, float]:
        return timing.split(self.elements.image_age / self.elements.period)

    @cached_property
    def _believed(self) -> tuple[int, float]:
        return timing.split((self.elements.tau_hat or 0.0) / self.elements.period)

    @cached_property
    def _filter(self) -> SteadyFilter | None:
        e = self.elements
        return steady_filter(e.filter, e.period, e.tau_hat or 0.0) if e.filter else None

    def at_rest(self, q: Values) -> State:
        """The state of a camera that has been at q (m,) for ever, nothing commanded so far."""
        e, nothing = self.elements, np.zeros_like(q)
        commands = self._command[0] + 2
        if e.smith:
            commands = max(commands, math.ceil(sum(self._believed)))
        path = self._believed[0] + 2 if self._filter is not None else 0
        states = 0 if self._filter is None else len(self._filter.gain)
        filtered = (nothing,) * states
        if states:  # the first image tells where one is
            filtered = (self.image(q) - q, *filtered[1:])
        taken = self._taken[0] + 1
        if commands + taken + path > MOST_STATES:
            raise LimitError(
                f"loop.of: the loop remembers more than {MOST_STATES} frames; give a longer "
                "period or shorter latencies."
            )
        return State(
            q, nothing, (nothing,) * commands, (q,) * taken, (q,) * path, nothing, filtered
        )

    def step(
        self,
        state: State,
        reference: Values | complex = 0.0,
        rate: Values | complex = 0.0,
        target: Values | complex = 0.0,
    ) -> State:
        """The state a period later.

        `reference`: q* that the law compares with, `rate`: q*′ of its feed-forward, `target`: how
        far the target had moved when the image was taken, each (m,).
        """
        return self._moved(self._commanded(state, reference, rate, target))

    def _commanded(self, state: State, reference: Any, rate: Any, target: Any) -> State:
        """The law, at a frame."""
        e, filtered = self.elements, state.filtered
        whole, share = self._taken
        # Taken at this very frame, or within the frame that ended `whole` frames ago.
        where = state.q if not (whole or share) else state.taken[whole if share else whole - 1]
        seen = self.image(where - target)
        drift: Any = 0.0
        path = (state.q, *state.path[:-1]) if state.path else ()
        if e.smith:
            seen = seen + self._ahead(state.commands)
        elif self._filter is not None:
            n, part = self._believed
            then = (1 - part) * path[n] + part * path[min(n + 1, len(path) - 1)]
            x = self._filter.transition @ np.array(filtered)
            x = x + np.outer(self._filter.gain, (seen - then) - x[0])
            now = self._filter.ahead @ x
            filtered, seen, drift = tuple(x), now[0] + state.q, now[1]
        zero = np.zeros_like(state.q)
        error = seen - self.image(zero + reference)
        total = state.total if e.T_i is None else state.total + e.period * error
        integral = 0.0 if e.T_i is None else total / e.T_i
        T = -e.lam * (error + integral) + e.k_ff * self.image(zero + rate) - drift
        commands = (T, *state.commands[:-1])
        return replace(state, commands=commands, path=path, total=total, filtered=filtered)

    def _ahead(self, commands: tuple[Values, ...]) -> Values:
        """What the commands of the last τ̂ seconds will have done: Σ shares · T."""
        full, share = self._believed
        shares = [1.0] * full + [share] * (share > 0)
        weights = self.elements.period * np.array(shares)
        return (
            np.asarray(weights @ np.array(commands[: len(shares)])) if shares else 0 * commands[0]
        )

    def _moved(self, state: State) -> State:
        """The camera, from a frame to the next: two commands at most arrive in it."""
        period = self.elements.period
        whole, share = self._command
        before, now = state.commands[whole + 1], state.commands[whole]
        spans = [(share * period, before), ((1 - share) * period, now)]
        _, part = self._taken
        q, rate = state.q, state.rate
        taken = self._within(q, rate, spans, (1 - part) * period) if part else state.q
        for span, wanted in spans:
            q, rate = self._axes(q, rate, wanted, span)
        return replace(state, q=q, rate=rate, taken=(taken, *state.taken[:-1]))

    def _within(
        self, q: Values, rate: Values, spans: list[tuple[float, Values]], time: float
    ) -> Values:
        """q at a time (s) within a frame."""
        for span, wanted in spans:
            step = min(span, time)
            q, rate = self._axes(q, rate, wanted, step)
            time -= step
        return q

    def _axes(self, q: Values, rate: Values, wanted: Values, span: float) -> tuple[Values, Values]:
        """q and its rate after `span` (s) of a wanted twist: q″ = (wanted − q′)/T."""
        T = self.elements.time_constant
        if not T:
            return q + span * wanted, wanted
        gone = -math.expm1(-span / T)
        moved = span * wanted + T * gone * (rate - wanted)
        return q + moved, rate + gone * (wanted - rate)

    @cached_property
    def matrix(self) -> Values:
        """The map of a frame without reference, (n, n), of one direction."""
        zero = self.at_rest(np.zeros(1))
        n = len(zero.flat())
        out = self.step(_unflat(zero, np.eye(n, dtype=complex))).flat()
        if self.elements.T_i is None:  # a sum that nobody looks at
            row = 2 + len(zero.commands) + len(zero.taken) + len(zero.path)
            out[row] = 0.0
        return out

    @cached_property
    def eigenvalues(self) -> Values:
        """Of `matrix`, the largest first."""
        found = np.linalg.eigvals(self.matrix)
        return np.asarray(found[np.argsort(-np.abs(found))])

    @property
    def spectral_radius(self) -> float:
        """The largest modulus of an eigenvalue: below 1 is stable as sampled."""
        return float(np.abs(self.eigenvalues[0]))

    def steady(self, rate: complex, drift: complex) -> complex:
        """The steady q − q* − target on a ramp of this rate, before a target of this drift.

        One direction; the state of a stable loop is X_a + k X_b at frame k.
        """
        e, zero = self.elements, self.at_rest(np.zeros(1, dtype=complex))
        ages = e.reference_age - e.preview, e.image_age

        def asked(k: float) -> Values:
            t = k * e.period
            forced = self.step(zero, rate * (t - ages[0]), rate, drift * (t - ages[1]))
            return forced.flat()[:, 0]

        A, start = self.matrix - np.eye(len(self.matrix)), asked(0.0)
        slope = np.linalg.solve(A, start - asked(1.0))
        offset = np.linalg.solve(A, slope - start)
        return complex(offset[0])


def _unflat(like: State, values: Values) -> State:
    """A state of the entries of `values`, (n, m), in the order of `State.flat`."""
    rows = list(values)

    def take(n: int) -> tuple[Values, ...]:
        out = tuple(rows[:n])
        del rows[:n]
        return out

    [q], [rate] = take(1), take(1)
    commands, taken, path = take(len(like.commands)), take(len(like.taken)), take(len(like.path))
    [total] = take(1)
    return State(q, rate, commands, taken, path, total, take(len(like.filtered)))
