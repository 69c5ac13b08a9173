"""Figure 1 with 80 ms of delay: the exact engine beside python-control's Padé 6, same run.

``python analysis/benchmarks/delay.py [OUT]`` prints one line a task: median time of each, their
ratio, and the error of each against a closed form or a bare formula. Times are of this machine and
only their ratios mean anything.
"""

import statistics
import sys
from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import Any

import control
import numpy as np
from scipy.special import lambertw

import vsctrl as vs

LAM, TAU, ORDER = 2.5, 0.08, 6
OMEGA = np.geomspace(0.01, 100.0, 100_000)
T = np.linspace(0.0, 10.0, 10_001)


def main(out: Path | None = None) -> list[tuple[str, float, float, float, float]]:
    """Run every task; returns (task, ours in s, theirs in s, our error, their error)."""
    loop = vs.figure1.at(lam=LAM, tau=TAU, ell=1, ell_hat=1, k_ff=0)
    H, L = loop["S_ref", "S"], loop.open("S_meas")
    num, den = control.pade(TAU, ORDER)
    opened = control.tf([LAM], [1, 0]) * control.tf(num, den)
    fraction = control.feedback(control.tf([LAM], [1, 0]), control.tf(num, den))
    closed = control.ss(fraction)
    rows = [
        _row("10⁵ frequencies", lambda: H(1j * OMEGA), lambda: fraction(1j * OMEGA), _frequency),
        _row(
            "step, 10 s at 1 ms",
            lambda: H.response(vs.Step(), T).y.ravel(),
            lambda: control.step_response(closed, T).y.ravel(),
            _step,
        ),
        _row(
            "gain and phase margin",
            lambda: (lambda m: (m.gain, m.phase))(L.margins()),
            lambda: (lambda m: (m[0], np.radians(m[1])))(control.stability_margins(opened)),
            _margins,
        ),
        _row("6 rightmost roots", lambda: loop.poles(6), lambda: closed.poles(), _roots),
    ]
    bare = _median(lambda: LAM / (1j * OMEGA + LAM * np.exp(-1j * OMEGA * TAU)))
    lines = [f"{'task':24}{'vsctrl':>10}{'Padé ' + str(ORDER):>10}{'ratio':>8}{'errors':>22}"]
    for name, ours, theirs, our_error, their_error in rows:
        lines.append(
            f"{name:24}{1e3 * ours:8.2f}ms{1e3 * theirs:8.2f}ms{ours / theirs:8.2f}"
            f"{our_error:11.0e}{their_error:11.0e}"
        )
    lines.append(f"10⁵ frequencies against the bare NumPy formula: {rows[0][1] / bare:.2f} ×")
    print("\n".join(lines))
    if out:
        out.mkdir(parents=True, exist_ok=True)
        (out / "delay.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return rows


def _row(
    name: str,
    ours: Callable[[], Any],
    theirs: Callable[[], Any],
    error: Callable[[Any], float],
) -> tuple[str, float, float, float, float]:
    return name, _median(ours), _median(theirs), error(ours()), error(theirs())


def _median(task: Callable[[], Any], runs: int = 7) -> float:
    task()
    times = []
    for _ in range(runs):
        start = perf_counter()
        task()
        times.append(perf_counter() - start)
    return statistics.median(times)


def _frequency(values: Any) -> float:
    exact = LAM / (1j * OMEGA + LAM * np.exp(-1j * OMEGA * TAU))
    return float(np.abs(values / exact - 1).max())


def _step(values: Any) -> float:
    """Against the method of steps on its first three intervals, where it is a short polynomial."""
    t = T[T <= 3 * TAU]
    exact = np.zeros_like(t)
    for k in range(1, 5):
        late = np.maximum(t - (k - 1) * TAU, 0.0)
        exact += (-1) ** (k + 1) * (LAM * late) ** k / np.prod(np.arange(1.0, k + 1))
    return float(np.abs(values[: len(t)] - exact).max())


def _margins(values: Any) -> float:
    x = LAM * TAU
    return float(max(abs(values[0] * 2 * x / np.pi - 1), abs(values[1] - (np.pi / 2 - x))))


def _roots(values: Any) -> float:
    """Relative distance of the six rightmost roots from the Lambert branches."""
    exact = np.array([lambertw(-LAM * TAU, k) for k in range(-4, 4)]) / TAU
    exact = exact[np.argsort(-exact.real)][:6]
    distances = [np.abs(np.asarray(values) - root).min() / abs(root) for root in exact]
    return float(max(distances))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
