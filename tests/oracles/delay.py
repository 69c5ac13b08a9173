"""Second opinions on delay systems that share no code with `vsctrl.diagram`.

* figure 1 in closed form, summed with mpmath;
* `Network`: blocks with lags wired by a matrix, solved in time by Gauss collocation on a mesh that
  holds every delay (so no history is interpolated and every kink is a mesh point), in frequency
  by a linear solve in mpmath.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import mpmath as mp
import numpy as np
import sympy as sp
from scipy.linalg import lu_factor, lu_solve
from scipy.signal import tf2ss

from vsctrl.diagram import Block, Diagram, Sum
from vsctrl.symbols import ell, ell_hat, k_ff, lam, s, tau

WORKING = {"lam": 2.5, "tau": 0.08, "ell": 1.0, "ell_hat": 1.0, "k_ff": 1.0}


# Figure 1 --------------------------------------------------------------------------------------
def figure1(placement: str = "measurement", error: bool = False) -> Diagram:
    """The loop of figure 1 with its delay in the measurement, aligned, or in the actuator."""
    delay = sp.exp(-tau * s)
    parts = [
        Block("gain", lam, "e -> u_fb"),
        Block("feed-forward", k_ff * s, "S_ref -> u_ff"),
        Sum("u = u_fb + u_ff"),
        Block("inverse model", 1 / ell_hat, "u -> T"),
    ]
    if placement == "actuator":
        parts += [
            Sum("e = S_ref - S"),
            Block("actuator", delay, "T -> T_late"),
            Block("robot, camera", ell / s, "T_late -> S"),
        ]
    else:
        aligned = placement == "aligned"
        parts += [
            Sum("e = S_late - S_meas" if aligned else "e = S_ref - S_meas"),
            Block("robot, camera", ell / s, "T -> S"),
            Block("vision", delay, "S -> S_meas"),
        ]
        parts += [Block("alignment", delay, "S_ref -> S_late")] if aligned else []
    parts += [Sum("E = S - S_ref")] if error else []
    return Diagram(parts, inputs=["S_ref"], outputs=["S", *(["E"] if error else [])])


def figure1_response(
    kind: str, t: float, rate: float, late: float, feed: float = 0.0, omega: float = 1.0
) -> float:
    """S(t) of S' = rate (r(t) − S(t − late)) + feed r'(t), from rest.

    1/(s + K e^{−τs}) = Σ (−K)^k e^{−kτs}/s^{k+1}, so S is a finite sum of iterated integrals
    of the reference. Its terms are at most (K t)^k/k!, so e^{Kt} in size (1e82 at K t = 188,
    of which 120 digits leave 38), and negligible once k > 3 K t and they have become small.
    """
    with mp.workdps(120):
        K, T, q, w = (mp.mpf(repr(float(x))) for x in (rate, late, feed, omega))
        total, k = mp.mpf(0), 0
        while (left := mp.mpf(repr(float(t))) - k * T) >= 0:
            term = K * _integral(kind, left, k + 1, w) + q * _integral(kind, left, k, w)
            total += (-K) ** k * term
            k += 1
            if k > 3 * K * t + 20 and abs(term * K**k) < mp.mpf("1e-40"):
                break
        return float(total)


def _integral(kind: str, t: mp.mpf, n: int, omega: mp.mpf) -> mp.mpf:
    """The n-fold integral of a step, ramp, parabola or sine from 0 to t."""
    if kind != "sine":
        n += {"step": 0, "ramp": 1, "parabola": 2}[kind]
        return t**n / mp.factorial(n)
    term = omega * t ** (n + 1) / mp.factorial(n + 1)
    total, j = term, n + 1
    while abs(term) > mp.eps * abs(total):
        term *= -((omega * t) ** 2) / ((j + 1) * (j + 2))
        total, j = total + term, j + 2
    return total


def figure1_poles(x: float, late: float, n: int) -> np.ndarray:
    """The n rightmost W_k(−x)/τ, conjugates together, to 30 digits."""
    with mp.workdps(30):
        ks = range(-n - 2, n + 2)
        all_ = [complex(mp.lambertw(-mp.mpf(x), k) / mp.mpf(late)) for k in ks]
    return np.array(sorted(all_, key=lambda p: (-round(p.real * late, 9), abs(p.imag)))[:n])


# Any diagram -----------------------------------------------------------------------------------
@dataclass(frozen=True)
class Box:
    """y = e^{−steps·δ s} · num(s)/den(s) · u, coefficients from the highest power down."""

    num: tuple[float, ...]
    den: tuple[float, ...] = (1.0,)
    steps: int = 0


@dataclass(frozen=True)
class Network:
    """Boxes with u = wiring @ y + drive · r, every delay a whole number of `delta` seconds."""

    boxes: tuple[Box, ...]
    wiring: np.ndarray  #: (N, N), u_i takes y_j
    drive: np.ndarray  #: (N,)
    delta: float = 0.1
    nodes: int = field(default=12)

    @cached_property
    def _blocks(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        parts = []
        for b in self.boxes:
            if len(b.den) == 1:
                empty = np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0))
                parts.append((*empty, np.array([[b.num[0] / b.den[0]]])))
            else:
                num = np.array([0.0] * (len(b.den) - len(b.num)) + list(b.num))
                parts.append(_companion(num / b.den[0], np.array(b.den) / b.den[0]))
        sizes = [len(p[0]) for p in parts]
        n, N = sum(sizes), len(parts)
        A, B, C, D = np.zeros((n, n)), np.zeros((n, N)), np.zeros((N, n)), np.zeros((N, N))
        at = 0
        for i, (a, b, c, d) in enumerate(parts):
            cut = slice(at, at + sizes[i])
            A[cut, cut], B[cut, [i]], C[[i], cut], D[i, i] = a, b, c, d[0, 0]
            at += sizes[i]
        return A, B, C, D

    def response(self, signal, horizon: float, substeps: int = 1) -> tuple[np.ndarray, np.ndarray]:
        """(t, y) at the Gauss nodes of every step; y (len(t), N), each box's delayed output.

        At the nodes of a neutral loop the order is that of the interpolation, nodes + 1 = 13: at
        h·rate ≤ 0.5 a step errs by about (1/4)¹³/13! ~ 1e-18 of the solution.
        """
        A, B, C, D = self._blocks
        n, N, k = len(A), len(self.boxes), self.nodes
        h = self.delta / substeps
        node, S, weight = _gauss(k)
        lag = np.array([b.steps * substeps for b in self.boxes])
        now = np.diag((lag == 0).astype(float))
        W = np.asarray(self.wiring, float)
        # X = x₀ + h S (A X + B U), U = W (now Z + Y_past) + G r, Z = C X + D U; unknowns X, Z.
        eye = np.eye(k)
        top = [np.eye(n * k) - h * np.kron(A, S), -h * np.kron(B @ W @ now, S)]
        low = [-np.kron(C, eye), np.eye(N * k) - np.kron(D @ W @ now, eye)]
        lu = lu_factor(np.block([top, low]))
        x, count = np.zeros(n), round(horizon / h)
        Z = np.zeros((count, N, k))
        Y, T = np.zeros((count, N, k)), np.zeros((count, k))
        for step in range(count):
            T[step] = h * (step + node)
            past = np.zeros((N, k))
            for i in np.flatnonzero(lag):
                if step >= lag[i]:
                    past[i] = Z[step - lag[i], i]
            U = W @ past + np.outer(self.drive, signal(T[step]))
            right = np.concatenate([(x[:, None] + h * (B @ U) @ S.T).ravel(), (D @ U).ravel()])
            both = lu_solve(lu, right)
            X, Z[step] = both[: n * k].reshape(n, k), both[n * k :].reshape(N, k)
            Y[step] = now @ Z[step] + past
            x = x + h * (A @ X + B @ (W @ Y[step] + np.outer(self.drive, signal(T[step])))) @ weight
        return T.ravel(), Y.transpose(0, 2, 1).reshape(-1, N)

    def gain(self, i: int, p) -> mp.mpc:
        """Box i at complex p, in mpmath."""
        b = self.boxes[i]
        late = mp.mpf(repr(self.delta)) * b.steps
        num, den = ([mp.mpf(repr(float(c))) for c in side] for side in (b.num, b.den))
        return mp.exp(-p * late) * mp.polyval(num, p) / mp.polyval(den, p)

    def outputs(self, p) -> mp.matrix:
        """All y(p)/r(p) with mpmath."""
        P = [self.gain(i, p) for i in range(len(self.boxes))]
        right = mp.matrix([P[i] * float(g) for i, g in enumerate(self.drive)])
        return mp.lu_solve(self._matrix(P), right)

    def _matrix(self, P: list) -> mp.matrix:
        N = len(P)
        return mp.matrix(
            [[(i == j) - P[i] * float(self.wiring[i, j]) for j in range(N)] for i in range(N)]
        )

    def determinant(self, p, cut: int | None = None) -> mp.mpc:
        """det(I − P W); with `cut`, that of the diagram whose use of box `cut` is cut."""
        P = [self.gain(i, p) for i in range(len(self.boxes))]
        M = self._matrix(P)
        if cut is not None:
            for i in range(len(P)):
                M[i, cut] = mp.mpf(i == cut)
        return _determinant(M.tolist())

    def characteristic(self, p) -> mp.mpc:
        """det(diag den − diag(num e^{−pτ}) W), an entire function: its zeros are the poles."""
        rows = []
        for i, b in enumerate(self.boxes):
            num, den = ([mp.mpf(repr(float(c))) for c in side] for side in (b.num, b.den))
            above = mp.polyval(num, p) * mp.exp(-p * mp.mpf(repr(self.delta)) * b.steps)
            below = mp.polyval(den, p)
            row = [-above * float(w) for w in self.wiring[i]]
            row[i] += below
            rows.append(row)
        return _determinant(rows)

    def determinant_on_axis(self, omega: np.ndarray) -> np.ndarray:
        """det(I − P W) at jω in plain doubles, for winding counts."""
        p = 1j * omega
        P = np.array(
            [
                np.exp(-p * self.delta * b.steps) * np.polyval(b.num, p) / np.polyval(b.den, p)
                for b in self.boxes
            ]
        ).T
        return np.linalg.det(np.eye(len(self.boxes)) - P[:, :, None] * self.wiring)

    def diagram(self) -> Diagram:
        """The same network as a vsctrl diagram: box i drives yi, sum i makes ui."""
        parts: list = []
        for i, b in enumerate(self.boxes):
            num, den = ([sp.Rational(repr(float(c))) for c in side] for side in (b.num, b.den))
            expr = sp.Poly(num, s).as_expr() / sp.Poly(den, s).as_expr()
            late = sp.Rational(repr(self.delta)) * b.steps
            parts.append(Block(f"box {i}", expr * sp.exp(-late * s), f"u{i} -> y{i}"))
            terms = {"r": self.drive[i]} | {f"y{j}": w for j, w in enumerate(self.wiring[i])}
            text = " ".join(f"{'+' if w > 0 else '-'} {n}" for n, w in terms.items() if w)
            parts.append(Sum(f"u{i} = {text}"))
        return Diagram(parts, inputs=["r"], outputs=[f"y{i}" for i in range(len(self.boxes))])


def _determinant(rows: list[list]) -> mp.mpc:
    """By expansion: at most 5 by 5 here, and mpmath's own stumbles over a zero column."""
    if not rows:
        return mp.mpf(1)
    total, sign = mp.mpc(0), 1
    for j, entry in enumerate(rows[0]):
        if entry:
            total += sign * entry * _determinant([row[:j] + row[j + 1 :] for row in rows[1:]])
        sign = -sign
    return total


def _companion(num: np.ndarray, den: np.ndarray) -> tuple[np.ndarray, ...]:
    a, b, c, d = tf2ss(np.trim_zeros(num, "f") if num.any() else [0.0], den)
    return a, b, c, d


def _gauss(k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gauss nodes on [0, 1], the matrix of ∫₀^{c_i} ℓ_j, and the weights."""
    x, w = np.polynomial.legendre.leggauss(k)
    values = np.linalg.inv(np.polynomial.legendre.legvander(x, k - 1))
    anti = np.polynomial.legendre.legint(np.eye(k), lbnd=-1, axis=0)
    S = np.polynomial.legendre.legvander(x, k) @ anti @ values / 2
    return (x + 1) / 2, S, w / 2
