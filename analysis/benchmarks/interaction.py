"""Interaction matrices of a million places: derived and evaluated, and NumPy by hand, in one run.

``python analysis/benchmarks/interaction.py [OUT]`` prints a table: what was computed, by whom, how
long it took, how many times vsctrl's own time that is, and how far the numbers are from those by
hand; then how long each feature of the catalogue takes to derive in a Python that has never seen
it. Times are of this machine and only their ratios mean anything.
"""

import json
import statistics
import subprocess
import sys
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vsctrl.derive import Point, Segment, emit, evaluate
from vsctrl.derive.catalogue import FEATURES, named

PLACES = 10**6
PATIENCE = 3.0  #: s after which a slow task is not repeated more than it has to be
DERIVATION = "derivation, fresh process"

Values = NDArray[np.float64]


@dataclass(frozen=True)
class Row:
    """One task done by one tool."""

    task: str
    tool: str
    seconds: float
    ratio: float | None = None  #: times the time that `evaluate` takes for the same task
    error: float | None = None  #: against L by hand, over its largest entry


def main(
    out: Path | None = None,
    repeat: int = 7,
    places: int = PLACES,
    features: Iterable[str] = tuple(FEATURES),
) -> list[Row]:
    """Run every task `repeat` times; returns a row for each task and tool, and for each feature.

    With `out`, the table is also written there as interaction.txt and the rows as interaction.json.
    """
    rows: list[Row] = []
    for make, by_hand in ((Point, point_by_hand), (Segment, segment_by_hand)):
        feature = make()
        values = _places([symbol.name for symbol in feature.arguments], places)
        space: dict[str, Any] = {}
        exec(emit(feature), space)
        printed = space[f"{feature.name}_interaction"]
        expected = by_hand(**values)
        tools: dict[str, Callable[..., Values]] = {
            "evaluate": partial(evaluate, feature),
            "NumPy by hand": by_hand,
            "printed by emit": printed,
        }
        ours = None
        for tool, compute in tools.items():
            seconds, L = _timed(partial(compute, **values), repeat)
            ours = ours or seconds
            error = float(np.abs(L - expected).max() / np.abs(expected).max())
            task = f"{feature.name}, {places:.0e} places"
            rows.append(Row(task, tool, seconds, seconds / ours, error))
    rows += [Row(DERIVATION, name, _in_a_fresh_process(name, min(repeat, 3))) for name in features]
    text = table(rows)
    print(text)
    if out:
        out.mkdir(parents=True, exist_ok=True)
        (out / "interaction.txt").write_text(text + "\n", encoding="utf-8")
        written = json.dumps([asdict(row) for row in rows], indent=1, ensure_ascii=False) + "\n"
        (out / "interaction.json").write_text(written, encoding="utf-8")
    return rows


def table(rows: list[Row]) -> str:
    """The rows as aligned text."""
    lines = [f"{'task':27}{'tool':26}{'time':>11}{'× evaluate':>12}{'error':>9}"]
    before = ""
    for row in rows:
        ratio = "" if row.ratio is None else f"{row.ratio:.3g}"
        error = "" if row.error is None else f"{row.error:.0e}"
        task, before = "" if row.task == before else row.task, row.task
        lines.append(f"{task:27}{row.tool:26}{1e3 * row.seconds:8.3g} ms{ratio:>12}{error:>9}")
    return "\n".join(lines)


# By hand, as people write it, without a look at what is derived. ----------------------------------


def point_by_hand(X: Values, Y: Values, z: Values) -> Values:
    """L of a normalised image point, (n, 2, 6), one allocation and a column at a time."""
    L = np.zeros((len(X), 2, 6))
    inverse, product = 1 / z, X * Y
    L[:, 0, 0] = L[:, 1, 1] = -inverse
    L[:, 0, 2] = X * inverse
    L[:, 0, 3] = product
    L[:, 0, 4] = -(1 + X * X)
    L[:, 0, 5] = Y
    L[:, 1, 2] = Y * inverse
    L[:, 1, 3] = 1 + Y * Y
    L[:, 1, 4] = -product
    L[:, 1, 5] = -X
    return L


def segment_by_hand(
    x_c: Values, y_c: Values, l: Values, alpha: Values, z_1: Values, z_2: Values
) -> Values:
    """L of a segment, (n, 4, 6), by the chain rule from L of its two ends."""
    c, s = np.cos(alpha), np.sin(alpha)
    first = point_by_hand(x_c + l / 2 * c, y_c + l / 2 * s, z_1)
    second = point_by_hand(x_c - l / 2 * c, y_c - l / 2 * s, z_2)
    apart, c, s = first - second, c[:, None], s[:, None]
    L = np.empty((len(l), 4, 6))
    L[:, :2] = (first + second) / 2
    L[:, 2] = c * apart[:, 0] + s * apart[:, 1]
    L[:, 3] = (c * apart[:, 1] - s * apart[:, 0]) / l[:, None]
    return L


def _places(names: list[str], places: int) -> dict[str, Values]:
    rng = np.random.default_rng(0)
    return {name: rng.uniform(0.3, 1.2, places) for name in names}


def _timed(task: Callable[[], Any], repeat: int) -> tuple[float, Any]:
    """(median time in s, answer) of some runs after a first one, which derives and compiles."""
    times: list[float] = []
    while len(times) < min(4, repeat) or (len(times) < repeat + 1 and sum(times) < PATIENCE):
        start = perf_counter()
        answer = task()
        times.append(perf_counter() - start)
    return statistics.median(times[1:] or times), answer


def derivation(name: str) -> float:
    """The time in s that L of a feature takes, the first time it is asked for."""
    start = perf_counter()
    named(name).interaction  # noqa: B018
    return perf_counter() - start


def _in_a_fresh_process(name: str, repeat: int) -> float:
    """SymPy remembers what it has worked out, so each time is that of a new Python."""
    command = [sys.executable, str(Path(__file__).resolve()), "--derive", name]
    return statistics.median(
        float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        for _ in range(repeat)
    )


if __name__ == "__main__":
    if sys.argv[1:2] == ["--derive"]:
        print(derivation(sys.argv[2]))
    else:
        main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
