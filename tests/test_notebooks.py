"""Every notebook shows what is stored of it, and what it shows is known without vsctrl.

All run in the process of the tests (`notebooks/refresh.py`); cells that take many seconds, the
drawing of pictures and a kernel as Jupyter starts it come with ``--long``.
"""

import copy
import importlib.util
import re
from pathlib import Path

import effort
import pytest
from PIL import Image

FOLDER = Path(__file__).parents[1] / "notebooks"
# What a notebook must come to show, as text: results that are known without vsctrl.
SHOWN = {
    "00_tour": [
        "3.142",  # SIMC: π, 61.35°, 1.59, 2.14 min (Skogestad 2003, Table 1)
        "61.35°",
        "128.5 s",
        "parameters.thta: no block uses it (did you mean 'theta'?)",
        "15.45 s⁻¹",  # 2 sin(π/10)/0.04
        "+3.200 mm",  # v·τ
    ],
    "01_the_one_over_lambda_law": [
        "v*(tau + (k_ff*kappa - 1)/(kappa*lambda))",
        "-v/lambda",
        "19.635",  # π/(2·0.08)
        "15.451",  # 2 sin(π/10)/0.04
        "The run completed all 1501 frames.",
        "the loop is unstable",
        "1/(2*tau)",
    ],
    "02_interaction_matrices": [
        "[-1/z,    0, X/z,      X*Y, -X**2 - 1,  Y]",  # Chaumette and Hutchinson 2006, eq. 11
        "[-A*a, -B*a, a*(3*A*x_g + 3*B*y_g + 2*C), 3*a*y_g, -3*a*x_g, 0]",  # Chaumette 2004
        "moved                    -0.607881\nby the matrix            -0.607881",
        "[-F_x*V_x/z_0]",
        "F_x*omega*(d_z*z_0 - x_0**2 - z_0**2)/z_0**2",
    ],
    "03_six_dof": [
        "lag at the end, mm                       3.2     -4.8",  # vτ and v(τ − 1/λ), λ = 5
        "lag  -2.56",  # −ωdτ
        "sliding    matrix law  4.6545",  # 40 (0.08 + 0.1/(1.1·2.5))
        "depths +10 % in the law                  40.0000   1.4545",  # 40·0.1/(1.1·2.5)
        "depths +10 % in the reference            36.3636",  # V·Z/Ẑ
        "focal length +10 % in the law            40.0000  -1.6000",  # −40·0.1/2.5
        "focal length +10 % in the reference      44.0000",  # V·F̂/F
        "15.4508",  # 2 sin(π/10)/0.04
        "current      -3.0     -2.1651",  # −λZ(1 − cos 120°), −λ sin 120°
        "desired       3.0     -2.1651",
        "mean          0.0     -8.6603",  # −2λ tan 60°
    ],
    "04_linking_and_limits": [
        "turn     0.064     0.00      0.0        0.0      -0.08",  # −ωd and ω
        "linear          1.6468  1.6468",  # (0.04 + 0.024 + √(0.064² + 0.03²) + 0.03)/0.1
        "smooth          2.4702  2.4702",  # 3/2 of it
        "acceleration: 0.0500 m/s², a share of 1.2500",  # dω², over 0.04
        "1.1180 times as long, 2.2361 s: it can",  # √1.25, and 2 s of it
        "0.2356         0.2 m/s",  # 0.15·π/2
        "0.3701          1 m/s²",  # 0.15·(π/2)²
        "24.98 mm by hand, 24.98 mm in the run",  # (0.064² + 0.03²)/(2·0.1)
        "-90.000 mm at the end, held back in 226 frames",  # (0.03 − 0.04)·9
        "-T*a/lambda",
        "T = 100 ms                -2.4     -2.4",  # −a(T + Tₛ/2)/λ
    ],
    "05_latency_and_prediction": [
        "20 ms       0.8      0.8",  # vτ
        "v*(tau - tauhat)",
        "τ̂ = 120 ms            -1.6     -1.6",
        "20.0     12.0      7.2     4.32    2.592   1.5552",  # 20·0.6ᵏ
        "117.81",  # 3π/(2·0.04)
        "39.27",  # π/(2·0.04)
        "Smith, 80 ms          completed",  # 20 s⁻¹ is below 2/0.04
        "nothing                             -8.0",  # −v/λ
        "Smith                               -9.6",  # −v/λ − vτ
        "integral, 1.6 s                      0.0",
        "7.31 mm by the formula",  # |v/(jω + λ e^(−jω(τ + Tₛ/2)))|
        "4.000 times as much",  # information goes with the square of the speed
        "LED 1 -125.0  -75.0 -125.0",  # of the paper
    ],
    "06_robustness": [
        "7.85",  # π/(2·2.5·0.08)
        "15.450850  15.450850",
        "10.300566",  # 15.4508/1.5
        "depth +10 %                           14.046              4.655    4.655",
        "focal length −10 %                    13.906              4.800    4.800",
        "latency +20 ms                        13.397              4.000    4.000",
        "Ms = 1.4   4.658",  # κλτ = 0.3727
    ],
    "07_block_diagrams": [
        "gain margin             3.142",  # Skogestad 2003, Table 1
        "phase margin, degrees  61.352",
        "2 roots right of the axis, certified",
        "right to 1e-12",  # x' = −x(t − 1) by hand
        "0 unstable roots; at rest 1.000 and 0.000",  # the column's integral action
    ],
}


@pytest.fixture(scope="module")
def refresh():
    """The script that runs and writes them."""
    spec = importlib.util.spec_from_file_location("refresh", FOLDER / "refresh.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def shown(notebook):
    """All texts that a notebook's cells show."""
    outputs = [out for cell in notebook.cells for out in cell.get("outputs", ())]
    return "\n".join(out.get("text") or out.data.get("text/plain", "") for out in outputs)


def closed_up(text):
    """Columns a single space apart."""
    return re.sub(" +", " ", text)


def run_in_a_kernel(notebook):
    """Run it as Jupyter does, which says nothing on stderr."""
    from nbclient import NotebookClient

    resources = {"metadata": {"path": str(FOLDER)}}
    NotebookClient(notebook, timeout=300, kernel_name="python3", resources=resources).execute()
    outputs = [out for cell in notebook.cells for out in cell.get("outputs", ())]
    assert not [out.text for out in outputs if out.get("name") == "stderr"]


@pytest.mark.filterwarnings("default" if effort.long else "error")  # a kernel's own sockets
@pytest.mark.parametrize("name", SHOWN)
def test_a_notebook_shows_what_is_stored_of_it_and_what_is_known(name, refresh):
    now, kept = refresh.run(name, long=effort.long, pictures=effort.long), refresh.stored(name)
    assert refresh.differences(kept, now) == []
    seen = closed_up(shown(now))
    for text in SHOWN[name]:
        assert closed_up(text) in seen, text
    if effort.long:
        run_in_a_kernel(refresh.source(name))


def test_every_notebook_is_stored_has_a_picture_and_is_behind_a_door(refresh):
    assert refresh.names() == sorted(SHOWN)
    assert sorted(path.stem for path in FOLDER.glob("*.ipynb")) == sorted(SHOWN)
    assert sorted(path.stem for path in refresh.THUMBNAILS.iterdir()) == sorted(SHOWN)
    doors = (FOLDER / "README.md").read_text(encoding="utf-8")
    links = set(re.findall(r"\]\(([\w/]+\.\w+)\)", doors))
    assert {f"{name}.ipynb" for name in SHOWN} <= links
    assert all((FOLDER / link).exists() for link in links)
    assert sum(path.stat().st_size for path in FOLDER.rglob("*") if path.is_file()) < 3_000_000


@pytest.mark.parametrize("name", SHOWN)
def test_a_notebook_shows_no_bare_dicts_arrays_or_objects_and_defines_no_functions(name, refresh):
    notebook = refresh.stored(name)
    for cell in notebook.cells:
        assert cell.cell_type == "markdown" or "def " not in cell.source
        for output in cell.get("outputs", ()):
            text = output.get("text") or output.data["text/plain"]
            better = set(output.get("data", ())) - {"text/plain"}
            assert not re.match(r"[{\[]|\(?array\(|<\w+", text) or better, text
            assert better or output.output_type == "stream", text


def test_what_is_not_the_same_is_found(refresh):
    same, name = refresh.same_text, "02_interaction_matrices"
    assert same("lag −3.2000 mm, 1e-14", "lag −3.2001 mm, 3e-15")
    assert not same("3.20 mm", "3.25 mm") and not same("+3.2", "−3.2") and not same("a 1", "b 1")
    dark, light = (Image.new("L", (80, 80), shade) for shade in (0, 20))
    assert refresh.same_picture(dark, dark) and not refresh.same_picture(dark, light)
    kept = refresh.stored(name)
    for cell in kept.cells:
        cell.execution_count = 1
    changed = copy.deepcopy(kept)
    next(c for c in changed.cells if c.cell_type == "code" and c.outputs).outputs.pop()
    assert "another number" in refresh.differences(kept, changed)[0]
    changed = copy.deepcopy(kept)
    changed.cells[0].source += "!"
    assert refresh.differences(kept, changed) == ["the cells are not those of the source"]
