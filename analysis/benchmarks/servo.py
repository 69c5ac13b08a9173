"""The paper's slide in 500 frames: the simulator beside its peers, and what each option costs.

``python analysis/benchmarks/servo.py [OUT]`` prints a table: what was run, how many times the time
of the standard run that took, between which two numbers half of the rounds lie, and how far the
camera's path is from vsctrl's. Every round runs everything once, so that what else the machine does
meets all alike, and a ratio is that of one round. With the variable OPENBLAS_NUM_THREADS=1 they
scatter less, since the matrices are small. Peers: the same experiment as one writes it in NumPy,
and in C++ with ViSP (``servo_visp.cpp``) where that and a compiler are installed.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

import vsctrl as vs
from vsctrl.servo.features.feature_sets import MEASURES
from vsctrl.servo.scenario.motions import ScrewMotion

FRAMES = 500
PERIOD = 0.040  #: s
# Of the gantry at the start: the slide then stays within its ranges.
JOINTS = [0.0, 0.0, -0.45, 0.0, 0.5, 0.0]
# Paths of one and the same law differ by rounding: 2⁻⁵³, times the condition of L, which is some
# hundred here, times the few frames that the loop takes to forget.
ROUNDING = 1e-12  #: m and rad

Array = NDArray[np.float64]
# Runs once; returns the time that it took in s, and the path (frames + 1, 4, 4) where there is one.
Task = Callable[[], tuple[float, Array | None]]

STANDARD = "vs.simulate"
PEERS = "the slide"
OPTIONS = "vs.simulate with"


@dataclass(frozen=True)
class Row:
    """One run; what it took is None for a peer that is not there, whose `tool` says why."""

    task: str
    tool: str
    ratio: float | None = None  #: times the time of the standard run: median over the rounds
    low: float | None = None  #: first and third quartile of that
    high: float | None = None
    seconds: float | None = None  #: median
    error: float | None = None  #: m and rad, greatest difference from the standard run's poses


def main(out: Path | None = None, repeat: int = 9, frames: int = FRAMES) -> list[Row]:
    """Run everything in each of `repeat` rounds after a first one; a row for each.

    With `out`, the table is also written there as servo.txt and the rows as servo.json. A peer
    whose path is not vsctrl's to rounding is an AssertionError.
    """
    standard = vs.paper.sliding().with_(duration=frames * PERIOD)
    peers: dict[str, Task] = {
        STANDARD: partial(_simulated, standard),
        "NumPy by hand": partial(_clocked, partial(by_hand, standard)),
    }
    options: dict[str, Task] = {
        name: partial(_simulated, standard.with_(**changes)) for name, changes in OPTIONED.items()
    }
    building: Task = partial(_clocked, partial(_built, standard))
    with tempfile.TemporaryDirectory() as folder:
        program = _compiled(Path(folder))
        if isinstance(program, Path):
            peers["ViSP, C++"] = partial(_visp, program, standard)
        tasks = {
            **{(PEERS, name): task for name, task in peers.items()},
            ("its Scenario", "building and checking"): building,
            **{(OPTIONS, name): task for name, task in options.items()},
        }
        rows = _rounds(tasks, repeat)
    if not isinstance(program, Path):
        rows.append(Row(PEERS, f"ViSP, C++: {program}"))
    text = table(rows)
    print(text)
    if out:
        out.mkdir(parents=True, exist_ok=True)
        (out / "servo.txt").write_text(text + "\n", encoding="utf-8")
        written = json.dumps([asdict(row) for row in rows], indent=1, ensure_ascii=False) + "\n"
        (out / "servo.json").write_text(written, encoding="utf-8")
    return rows


def table(rows: list[Row]) -> str:
    """The rows as aligned text; a peer that is not there has a line that says why."""
    head = f"{'what':19}{'how':26}{'× vs.simulate':>14}{'quartiles':>19}{'time':>12}{'error':>9}"
    lines, before = [head], ""
    for row in rows:
        if row.ratio is None or row.seconds is None:
            lines.append(row.tool)
            continue
        task, before = "" if row.task == before else row.task, row.task
        between = f"{row.low:.3g} to {row.high:.3g}"
        error = "" if row.error is None else f"{row.error:.0e}"
        lines.append(
            f"{task:19}{row.tool:26}{row.ratio:14.3g}{between:>19}"
            f"{1e3 * row.seconds:9.3g} ms{error:>9}"
        )
    return "\n".join(lines)


def _rounds(tasks: dict[tuple[str, str], Task], repeat: int) -> list[Row]:
    """Every task once a round; the first round, which fills caches, checks the peers' paths."""
    errors: dict[tuple[str, str], float | None] = {}
    ours: Array | None = None
    for key, task in tasks.items():
        _, path = task()
        errors[key] = None
        if key == (PEERS, STANDARD):
            ours = path
        elif key[0] == PEERS and ours is not None and path is not None:
            errors[key] = error = float(np.abs(path - ours).max())
            assert error < ROUNDING, f"{key[1]} goes another way: {error:.3g} m or rad apart"
    times = {key: np.empty(repeat) for key in tasks}
    for number in range(repeat):
        for key, task in tasks.items():
            times[key][number], _ = task()
    rows = []
    for key, taken in times.items():
        low, ratio, high = np.quantile(taken / times[PEERS, STANDARD], (0.25, 0.5, 0.75)).tolist()
        rows.append(Row(*key, ratio, low, high, float(np.median(taken)), errors[key]))
    return rows


def _clocked(does: Callable[[], Array | None]) -> tuple[float, Array | None]:
    start = perf_counter()
    path = does()
    return perf_counter() - start, path


# vsctrl -------------------------------------------------------------------------------------------

OPTIONED: dict[str, dict[str, object]] = {
    "latency of 1.75 frames": {"latency": 1.75 * PERIOD},
    "noise, Kalman filter": {"noise_px": 0.5, "predictor": "velocity"},
    "pose scheme": {"scheme": "pose"},
    **{f"features: {name}": {"features": name} for name in MEASURES if name != "points"},
    "lagging axes": {"time_constant": 0.05},
    "limited acceleration": {"acceleration_limit": 0.1, "angular_acceleration_limit": 0.5},
    "gantry": {"carrier": "gantry", "joints": JOINTS},
    "gantry with avoidance": {"carrier": "gantry", "joints": JOINTS, "avoidance": True},
}


def _simulated(scenario: vs.Scenario) -> tuple[float, Array | None]:
    start = perf_counter()
    run = vs.simulate(scenario)
    seconds = perf_counter() - start
    assert run.status.ok, run.status.sentence  # else it would be a shorter run
    return seconds, run.pose


def _built(scenario: vs.Scenario) -> None:
    vs.Scenario(**scenario.model_dump())


# The same experiment by hand, as people write it: none of it is shared with vsctrl. ---------------


def by_hand(scenario: vs.Scenario) -> Array:
    """The slide as a loop in NumPy: the poses oTc, (frames + 1, 4, 4)."""
    F, lam, k_ff = scenario.camera.Fx, scenario.law.lam, scenario.law.k_ff
    T_star, dt = _twist(scenario), scenario.vision.period
    d = round(scenario.vision.latency / dt)
    P = np.column_stack([scenario.target.points, np.ones(len(scenario.target.points))]).T
    start = _pose(scenario)

    def hat(T: Array) -> Array:
        vx, vy, vz, wx, wy, wz = T
        return np.array([[0, -wz, wy, vx], [wz, 0, -wx, vy], [-wy, wx, 0, vz], [0, 0, 0, 0]])

    def project(oTc: Array) -> tuple[Array, Array]:
        x, y, z, _ = np.linalg.inv(oTc) @ P
        return np.column_stack([F * x / z, F * y / z]).ravel(), z

    def interaction(s: Array, z: Array) -> Array:
        rows = []
        for i in range(len(z)):
            X, Y, Z = s[2 * i], s[2 * i + 1], z[i]
            rows.append([-F / Z, 0, X / Z, X * Y / F, -(F + X**2 / F), Y])
            rows.append([0, -F / Z, Y / Z, F + Y**2 / F, -X * Y / F, -X])
        return np.array(rows)

    oTc, poses, images = start, [], []
    for k in range(scenario.frames + 1):
        poses.append(oTc)
        images.append(project(oTc))
        s, z = images[max(0, k - d)]
        s_star, z_star = project(start @ expm(hat(T_star) * k * dt))
        ds_star = interaction(s_star, z_star) @ T_star
        L_pinv = np.linalg.pinv(interaction(s, z))
        T = -lam * L_pinv @ (s - s_star) + k_ff * L_pinv @ ds_star
        oTc = oTc @ expm(hat(T) * dt)
    return np.array(poses)


def _twist(scenario: vs.Scenario) -> Array:
    assert isinstance(scenario.motion, ScrewMotion)
    return np.array([*scenario.motion.V, *scenario.motion.Omega])


def _pose(scenario: vs.Scenario) -> Array:
    """The start: ``R = Rx(α) Ry(β) Rz(γ)``."""
    (a, b, c), (s, t, u) = (f(np.radians(scenario.start.euler_xyz_deg)) for f in (np.cos, np.sin))
    out = np.eye(4)
    out[:3, :3] = (
        np.array([[1, 0, 0], [0, a, -s], [0, s, a]])
        @ np.array([[b, 0, t], [0, 1, 0], [-t, 0, b]])
        @ np.array([[c, -u, 0], [u, c, 0], [0, 0, 1]])
    )
    out[:3, 3] = scenario.start.position
    return out


# ViSP ---------------------------------------------------------------------------------------------


def _compiled(folder: Path) -> Path | str:
    """The C++ program, made in a folder; without a compiler or ViSP, why there is none."""
    compiler = shutil.which(os.environ.get("CXX", "c++"))
    if compiler is None:
        return "no compiler is installed"
    source, program = Path(__file__).with_name("servo_visp.cpp"), folder / "servo_visp"
    libraries = [f"-lvisp_{name}" for name in ("vs", "robot", "visual_features", "core")]
    command = [compiler, "-O2", "-DNDEBUG", str(source), "-o", str(program), *libraries]
    made = subprocess.run(command, capture_output=True, text=True, check=False)
    if not made.returncode:
        return program
    if "ViSP is not installed" in made.stderr:
        return "not installed"
    print(made.stderr, file=sys.stderr)
    return "installed, but its program does not compile"


def _visp(program: Path, scenario: vs.Scenario) -> tuple[float, Array | None]:
    """The time of a run within the program, which makes one before it, and its poses."""
    vision = scenario.vision
    late = round(vision.latency / vision.period)
    points = np.array(scenario.target.points)
    numbers = [
        *(scenario.frames, late, vision.period, scenario.law.lam, scenario.law.k_ff),
        *(*_twist(scenario).tolist(), *_pose(scenario).ravel().tolist()),
        *(len(points), *points.ravel().tolist()),
    ]
    given = " ".join(map(repr, numbers))
    done = subprocess.run([program], input=given, capture_output=True, text=True, check=True)
    first, *lines = done.stdout.splitlines()
    path = np.array([line.split() for line in lines], dtype=np.float64)
    return float(first), path.reshape(-1, 4, 4)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
