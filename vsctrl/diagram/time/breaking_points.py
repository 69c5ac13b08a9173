"""Where a delayed response is not smooth: the times that jumps reach, and how strong they are.

A jump of the input is carried by every sum of delays, each time one derivative weaker where the
system is retarded. The times are kept as rationals, so that equal ones are one.
"""

from __future__ import annotations

import heapq
import math
from fractions import Fraction

import numpy as np

from vsctrl.arrays import Array
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.signals.signal import Signal

DEGREE = 20  #: of the polynomials that a kink would disturb
NEGLIGIBLE = 1e-17  #: effect of a kink, relative to the largest jump so far, that may be dropped


class BreakingPoints:
    """The times at which delayed signals jump in some derivative, in order, as rationals.

    Jumps of x follow from Jx⁽ᵏ⁺¹⁾ = A Jx⁽ᵏ⁾ + B₁ Ju⁽ᵏ⁾ + B₂ Jw⁽ᵏ⁾, those of z from its output
    equation, and those of w from z one delay earlier. Equal times are merged before they are
    passed on, and a jump is passed on only if a piece as long as `longest` would feel it.
    """

    def __init__(self, system: DelaySystem, signal: Signal, longest: float) -> None:
        self.system = system
        self.orders = DEGREE + 4
        k = np.arange(self.orders)
        # A kink of order k disturbs the best polynomial of degree N on h by about J (h/2N)ᵏ/k.
        # Time counts in h/2N, in which no high derivative of a fast system overflows.
        unit = longest / (2 * DEGREE)
        self.weight = 1 / np.maximum(k, 1)
        self.rows = np.vstack([system.C[system.outputs :], system.A * unit])
        self.columns = np.vstack([system.D[system.outputs :], system.B * unit])
        self.spread = self._spreading()
        # What jumps is numbered as the columns of B are: 0 is the input, 1 + j is w_j.
        starts = sorted(signal.onsets(self.orders).items())
        self.heap = [(start, count, 0, row * unit**k) for count, (start, row) in enumerate(starts)]
        self.last = float(starts[-1][0]) if starts else 0.0  #: start of the signal's last change
        self.count = len(starts)
        self.largest = 0.0

    def _spreading(self) -> Array:
        """The matrix from the jumps of [u; w] in every derivative to those of z: Hₖ₋ᵢ at (k, i).

        H₀ = D and Hₖ = C Aᵏ⁻¹ B, with the rows of z, are the system's Markov parameters.
        """
        m, width = len(self.system.delays), self.system.B.shape[1]
        spread = np.zeros((self.orders, m, self.orders, width))
        x = np.zeros((len(self.system.A), width))
        forced = self.columns
        for k in range(self.orders):
            both = self.rows @ x + forced
            for i in range(self.orders - k):
                spread[k + i, :, i] = both[:m]
            x, forced = both[m:], np.zeros_like(forced)
        return spread.reshape(self.orders * m, self.orders * width)

    def next_after(self, t: float) -> float:
        """The first kink after t (s), infinity where none is left; kinks up to t are used up."""
        while self.heap and float(self.heap[0][0]) <= t * (1 + 1e-14):
            time = self.heap[0][0]
            drive = np.zeros((self.orders, self.system.B.shape[1]))
            while self.heap and self.heap[0][0] <= time * (1 + Fraction(1, 10**13)):
                _, _, j, row = heapq.heappop(self.heap)
                drive[:, j] += row
            self._spread(time, drive)
        return float(self.heap[0][0]) if self.heap else math.inf

    def _spread(self, time: Fraction, drive: Array) -> None:
        z = (self.spread @ drive.ravel()).reshape(self.orders, -1)
        felt = self.weight @ np.abs(z)
        self.largest = max(self.largest, float(felt.max(initial=0.0)))
        for j, tau in enumerate(self.system.delays):
            if felt[j] > NEGLIGIBLE * self.largest:
                heapq.heappush(self.heap, (time + tau, self.count, 1 + j, z[:, j]))
                self.count += 1
