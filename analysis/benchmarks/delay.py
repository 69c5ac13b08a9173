"""Figure 1 with 80 ms of delay: the exact engine beside its peers, in one run.

``python analysis/benchmarks/delay.py [OUT]`` prints a table: what was asked, of which tool, how
long it took, how many times vsctrl's own time that is, and how far the answer is from a closed
form. Times are of this machine and only their ratios mean anything; with the variable
OPENBLAS_NUM_THREADS=1 they scatter less, since the matrices are small. Peers: python-control with
Padé models; jitcdde and PathSim where they are installed (``pip install -e '.[benchmark]'``).
"""

import json
import statistics
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable
from contextlib import chdir
from dataclasses import asdict, dataclass
from functools import cache
from math import factorial
from pathlib import Path
from time import perf_counter
from typing import Any

import control
import numpy as np
import sympy as sp
from scipy.special import lambertw

import vsctrl as vs
from vsctrl.symbols import s

LAM, TAU, ORDER = 2.5, 0.08, 6
STEP = 0.001  #: s, spacing of the time response
OMEGA = np.geomspace(0.01, 100.0, 100_000)
T = np.arange(10_001) * STEP
PATIENCE = 1.5  #: s after which a slow task is not repeated more than it has to be

Task = Callable[[], Any]
Peer = dict[str, Task]  #: task → what does it


@dataclass(frozen=True)
class Row:
    """One task done by one tool; `seconds` is None for a peer that is not installed."""

    task: str
    tool: str
    seconds: float | None = None
    ratio: float | None = None  #: times the time that vsctrl takes for the same task
    error: float | None = None  #: against the closed form; None where nothing is computed


FREQUENCY, STEPPED, MARGINS, ROOTS, NUMBERS, FIRST = (
    "10⁵ frequencies",
    "step, 10 s at 1 ms",
    "gain, phase margin",
    "6 rightmost roots",
    "numbers put in, at()",
    "transfer, fresh process",
)


def main(out: Path | None = None, repeat: int = 7) -> list[Row]:
    """Run every task `repeat` times; returns a row for each task and tool.

    With `out`, the table is also written there as delay.txt and the rows as delay.json.
    """
    tools = {
        "vsctrl": _vsctrl,
        "bare NumPy": _bare,
        f"control, Padé {ORDER} tf": _pade_tf,
        f"control, Padé {ORDER} ss": _pade_ss,
        "jitcdde": _jitcdde,
        "PathSim": _pathsim,
    }
    checks = {FREQUENCY: _frequency, STEPPED: _step, MARGINS: _margins, ROOTS: _roots}
    found, absent = {}, []
    for name, make in tools.items():
        try:
            found[name] = make()
        except ModuleNotFoundError:
            absent.append(Row("", name))
    rows: list[Row] = []
    for task in (FREQUENCY, STEPPED, MARGINS, ROOTS, NUMBERS):
        ours = None
        for name, tool in found.items():
            for label, does in tool.items():
                if label.startswith(task):
                    seconds, answer = _timed(does, repeat)
                    ours = ours or seconds
                    error = checks[task](answer) if label in checks else None
                    shown = name + label.removeprefix(task)
                    rows.append(Row(task, shown, seconds, seconds / ours, error))
    rows += [_in_a_fresh_process(name, repeat) for name in DIAGRAMS] + absent
    text = table(rows)
    print(text)
    if out:
        out.mkdir(parents=True, exist_ok=True)
        (out / "delay.txt").write_text(text + "\n", encoding="utf-8")
        data = [asdict(row) for row in rows]
        written = json.dumps(data, indent=1, ensure_ascii=False) + "\n"
        (out / "delay.json").write_text(written, encoding="utf-8")
    return rows


def table(rows: list[Row]) -> str:
    """The rows as aligned text; a peer that is not installed has a line that says so."""
    lines = [f"{'task':25}{'tool':26}{'time':>11}{'× vsctrl':>10}{'error':>9}"]
    before = ""
    for row in rows:
        if row.seconds is None:
            lines.append(f"{row.tool}: not installed")
            continue
        ratio = "" if row.ratio is None else f"{row.ratio:.3g}"
        error = "" if row.error is None else f"{row.error:.0e}"
        task, before = "" if row.task == before else row.task, row.task
        lines.append(f"{task:25}{row.tool:26}{1e3 * row.seconds:8.3g} ms{ratio:>10}{error:>9}")
    return "\n".join(lines)


def _timed(task: Task, repeat: int) -> tuple[float, Any]:
    """(median time in s, answer) of some runs after a first one, which fills caches.

    With `repeat` 1 that first one is all there is.
    """
    times: list[float] = []
    while len(times) < min(4, repeat) or (len(times) < repeat + 1 and sum(times) < PATIENCE):
        start = perf_counter()
        answer = task()
        times.append(perf_counter() - start)
    return statistics.median(times[1:] or times), answer


# The tools. Each returns what it can do; a peer that is not installed fails to import.


def _vsctrl() -> Peer:
    values = {"lam": LAM, "tau": TAU, "ell": 1, "ell_hat": 1, "k_ff": 0}

    def loop() -> Any:  # a new system each time, so that nothing is remembered from the last run
        return vs.figure1.at(values)

    def margins() -> tuple[float, float]:
        found = loop().open("S_meas").margins()
        return found.gain, found.phase

    return {
        FREQUENCY: lambda: loop()["S_ref", "S"](1j * OMEGA),
        STEPPED: lambda: loop()["S_ref", "S"].response(vs.Step(), T).y.ravel(),
        MARGINS: margins,
        ROOTS: lambda: loop().poles(6),
        NUMBERS: loop,
    }


def _bare() -> Peer:
    return {FREQUENCY: lambda: _closed_form(1j * OMEGA)}


def _pade_tf() -> Peer:
    plant, late = control.tf([LAM], [1, 0]), control.tf(*control.pade(TAU, ORDER))
    closed = control.feedback(plant, late)
    return _pade(plant * late, closed, control.ss(closed))


def _pade_ss() -> Peer:
    plant = control.ss(control.tf([LAM], [1, 0]))
    late = control.ss(control.tf(*control.pade(TAU, ORDER)))
    closed = control.feedback(plant, late)
    return _pade(plant * late, closed, closed)


def _pade(opened: Any, closed: Any, states: Any) -> Peer:
    def margins() -> tuple[float, float]:
        found = control.stability_margins(opened)
        return found[0], np.radians(found[1])

    return {
        FREQUENCY: lambda: closed(1j * OMEGA),
        STEPPED: lambda: control.step_response(states, T).y.ravel(),  # of a tf it makes these first
        MARGINS: margins,
        ROOTS: closed.poles,
    }


def _jitcdde(rtol: float = 1e-8) -> Peer:
    """The loop as ẏ(t) = λ (1 − y(t − τ)), compiled once; without a compiler, by its lambdas."""
    import jitcdde

    def made(compiler: bool = True) -> Any:
        dde = jitcdde.jitcdde([LAM * (1 - jitcdde.y(0, jitcdde.t - TAU))], verbose=False)
        dde.set_integration_parameters(rtol=rtol, atol=rtol / 100, first_step=STEP, max_step=TAU)
        dde.constant_past([0.0], time=0.0)
        if compiler:
            with tempfile.TemporaryDirectory() as away, chdir(away):
                dde.compile_C()  # setuptools would read the pyproject.toml of where it runs
        else:
            dde.generate_lambdas()
        return dde

    try:
        dde, how = made(), "C"
    except (Exception, SystemExit):  # whatever setuptools and the compiler have to say
        dde, how = made(compiler=False), "Python"

    def run() -> Any:
        dde.purge_past()
        dde.constant_past([0.0], time=0.0)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it says that 1 ms is closer than its own steps
            dde.step_on_discontinuities()
            begun = dde.t > T
            first = dde.get_state().get_state(T[begun])[:, 0]
            return np.concatenate([first, [dde.integrate(t)[0] for t in T[~begun]]])

    making = f"{STEPPED}, making {how}"
    return {STEPPED: run, making: lambda: made(how == "C")}


def _pathsim() -> Peer:
    """The loop as blocks; Runge and Kutta's fixed steps of 1 ms, which fall on the kinks."""
    from pathsim import Connection, Simulation, blocks
    from pathsim.solvers import RK4

    one, gain, robot = blocks.Constant(1.0), blocks.Amplifier(LAM), blocks.Integrator()
    error, vision, scope = blocks.Adder("+-"), blocks.Delay(TAU), blocks.Scope()
    wires = [
        Connection(one, error[0]),
        Connection(error, gain),
        Connection(gain, robot),
        Connection(robot, vision, scope),
        Connection(vision, error[1]),
    ]
    parts = [one, error, gain, robot, vision, scope]
    simulation = Simulation(parts, wires, dt=STEP, Solver=RK4, log=False)

    def run() -> Any:
        simulation.run(float(T[-1]), reset=True, adaptive=False)
        return np.asarray(scope.read()[1][0])[: len(T)]

    return {STEPPED: run}


# What is right. None of it shares code with vsctrl, nor with a peer.


def _closed_form(at: Any) -> Any:
    return LAM / (at + LAM * np.exp(-at * TAU))


def _frequency(values: Any) -> float:
    return float(np.abs(values / _closed_form(1j * OMEGA) - 1).max())


def _step(values: Any, every: int = 7) -> float:
    return float(np.abs(values[::every] - _method_of_steps(every)).max())


@cache
def _method_of_steps(every: int) -> Any:
    """y = Σ (−1)ᵏ⁺¹ (λ (t − (k−1) τ))ᵏ/k! over the terms begun, at each so many-th time.

    The terms are large and cancel, so they are added as whole numbers of 2⁻²⁰⁰.
    """
    unit, late = round(1 / (LAM * STEP)), round(TAU / STEP)
    assert np.isclose(unit * LAM * STEP, 1) and np.isclose(late * STEP, TAU)
    count = np.arange(0, len(T), every).astype(object)  # Python's integers
    total, k = 0 * count, 1
    while (k - 1) * late < len(T):
        begun = np.maximum(count - (k - 1) * late, 0)
        total = total - (-1) ** k * ((begun**k << 200) // (unit**k * factorial(k)))
        k += 1
    return (total / 2**200).astype(float)


def _margins(values: Any) -> float:
    """Against π/(2x) and π/2 − x, x = λτ."""
    x = LAM * TAU
    return float(max(abs(values[0] * 2 * x / np.pi - 1), abs(values[1] - (np.pi / 2 - x))))


def _roots(values: Any) -> float:
    """Relative distance of the six rightmost roots from W_k(−λτ)/τ, Lambert's branches."""
    exact = np.array([lambertw(-LAM * TAU, k) for k in range(-4, 4)]) / TAU
    exact = exact[np.argsort(-exact.real)][:6]
    return float(max(np.abs(np.asarray(values) - root).min() / abs(root) for root in exact))


# The exact transfer function of a diagram that this process has never seen.


def cascade() -> vs.Diagram:
    """Two nested loops of a process: fourteen blocks, four different delays, sixteen parameters.

    A flow x is controlled inside, a quality y outside of it; a measured disturbance d is fed
    forward, and so is the set point r.
    """
    kp, ki, kq, kj, ko, kd, gd, b, c = sp.symbols("kp ki kq kj ko kd gd b c", positive=True)
    Ta, Tx, Ty = sp.symbols("Ta Tx Ty", positive=True)
    valve, flow, pipe, analyser = sp.symbols("tau_a tau_x tau_p tau_y", positive=True)
    return vs.Diagram(
        [
            # outside: quality
            vs.Block("set-point filter", 1 / (1 + Ty * s), "r -> wanted"),
            vs.Sum("e_y = wanted - y_meas"),
            vs.Block("outer PI", kp + ki / s, "e_y -> x_pi"),
            vs.Block("outer feed-forward", ko, "wanted -> x_ff"),
            vs.Sum("x_ref = x_pi + x_ff"),
            # inside: flow
            vs.Sum("e_x = x_ref - x_meas"),
            vs.Block("inner PI", kq + kj / s, "e_x -> u_pi"),
            vs.Block("disturbance sensor", 1 / (1 + Tx * s), "d -> d_meas"),
            vs.Block("disturbance feed-forward", kd, "d_meas -> u_ff"),
            vs.Sum("u = u_pi - u_ff"),
            vs.Block("valve", sp.exp(-valve * s) / (1 + Ta * s), "u -> q"),
            vs.Block("disturbance", gd / (1 + Tx * s), "d -> q_d"),
            vs.Sum("p = q + q_d"),
            vs.Block("vessel", b / (1 + Tx * s), "p -> x"),
            vs.Block("flow meter", sp.exp(-flow * s), "x -> x_meas"),
            # from the flow to the quality
            vs.Block("pipe", sp.exp(-pipe * s), "x -> x_late"),
            vs.Block("reactor", c / s, "x_late -> y"),
            vs.Block("analyser", sp.exp(-analyser * s), "y -> y_raw"),
            vs.Block("analyser filter", 1 / (1 + Ty * s), "y_raw -> y_meas"),
        ],
        inputs=["r", "d"],
        outputs=["y"],
    )


def _cascade_by_hand(at: complex, v: dict[str, float]) -> complex:
    """y/r of `cascade`, its two loops closed one after the other."""
    late = {name: np.exp(-v[f"tau_{name}"] * at) for name in "axpy"}
    forward = v["b"] * late["a"] / ((1 + v["Ta"] * at) * (1 + v["Tx"] * at))
    forward *= v["kq"] + v["kj"] / at
    plant = forward / (1 + forward * late["x"]) * late["p"] * v["c"] / at
    controller, smooth = v["kp"] + v["ki"] / at, 1 / (1 + v["Ty"] * at)
    return plant * (controller + v["ko"]) * smooth / (1 + plant * controller * late["y"] * smooth)


def _figure1_by_hand(at: complex, v: dict[str, float]) -> complex:
    late = v["ell"] * v["lam"] * np.exp(-v["tau"] * at)
    return v["ell"] * (v["lam"] + v["k_ff"] * at) / (v["ell_hat"] * at + late)


DIAGRAMS: dict[str, tuple[Callable[[], vs.Diagram], tuple[str, str], Callable[..., complex]]] = {
    "vsctrl, figure 1": (lambda: vs.figure1, ("S_ref", "S"), _figure1_by_hand),
    "vsctrl, 14 blocks": (cascade, ("r", "y"), _cascade_by_hand),
}


def symbolic(name: str) -> tuple[float, float]:
    """(time in s, error) of the transfer function of one of `DIAGRAMS`, the first time it is asked.

    The error is relative, against the loops closed by hand, at a complex s and made-up numbers.
    """
    make, channel, by_hand = DIAGRAMS[name]
    diagram = make()
    start = perf_counter()
    found = diagram.transfer(*channel)
    seconds = perf_counter() - start
    at = 0.3 + 0.7j
    values = {word: 0.5 + 0.1 * i for i, word in enumerate(diagram.parameters)}
    numbers = {diagram.parameters[word]: value for word, value in values.items()}
    exact = by_hand(at, values)
    return seconds, abs(complex(found.subs(numbers).subs(s, at)) / exact - 1)


def _in_a_fresh_process(name: str, repeat: int) -> Row:
    """SymPy remembers what it has worked out, so each time is that of a new Python."""
    command = [sys.executable, str(Path(__file__).resolve()), "--symbolic", name]
    runs = [
        json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        for _ in range(min(repeat, 3))
    ]
    seconds, errors = zip(*runs, strict=True)
    return Row(FIRST, name, statistics.median(seconds), None, max(errors))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--symbolic"]:
        print(json.dumps(symbolic(sys.argv[2])))
    else:
        main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
