"""Every notebook runs from top to bottom, and is kept free of outputs and of functions.

All notebooks run in the process of the tests, each in a namespace of its own, so that imports and
what SymPy has worked out serve all of them; with ``--long`` each runs in a kernel as well, as
Jupyter runs it.
"""

import json
from collections.abc import Iterator
from contextlib import chdir
from pathlib import Path

import effort
import matplotlib as mpl
import numpy as np
import pytest
from IPython.core.interactiveshell import InteractiveShell
from IPython.utils.capture import capture_output
from traitlets.config import Config

FOLDER = Path(__file__).parents[1] / "notebooks"
KERNEL, LONG = "02_interaction_matrices", "03_six_dof"
# What a notebook must come to show, as text: results that are known without vsctrl.
SHOWN = {
    "01_the_one_over_lambda_law": [
        "v*(tau + (k_ff*kappa - 1)/(kappa*lambda))",
        "-v/lambda",
        "3.1999996",  # v·τ = 3.2 mm, less what e^(−3.24·5) has left of the transient
        "19.634954084936208",  # π/(2·0.08)
        "15.45084971874737",  # 2 sin(π/10)/0.04
        "The run completed all 1501 frames.",
        "the loop is unstable",
        "1/(2*tau)",
    ],
    "02_interaction_matrices": [
        "[-1/z,    0, X/z,      X*Y, -X**2 - 1,  Y]",  # Chaumette and Hutchinson 2006, eq. 11
        "[-A*a, -B*a, a*(3*A*x_g + 3*B*y_g + 2*C), 3*a*y_g, -3*a*x_g, 0]",  # Chaumette 2004
        "array([[0., 0., 0., 1., 0., 0.]",  # θu at the goal
        "True",  # the user's own feature against finite differences
        "[-F_x*V_x/z_0]",
        "F_x*omega*(d_z*z_0 - x_0**2 - z_0**2)/z_0**2",
    ],
    "03_six_dof": [
        "{'with the derivative term, mm': 3.2, 'without, mm': -4.8}",  # vτ and v(τ − 1/λ), λ = 5
        "(2.56, array(",  # ωdτ
        "'matrix law': array([4.6545,",  # 40 (0.08 + 0.1/(1.1·2.5))
        "'run': array([ 4.6545,",
        "'lag, mm': 1.4545",  # 40·0.1/(1.1·2.5)
        "'speed, mm/s': 36.3636",  # V·Z/Ẑ
        "'lag, mm': -1.6,",  # −40·0.1/2.5
        "'speed, mm/s': 44.0",  # V·F̂/F
        "'gain limit, s⁻¹': 15.451}",  # 2 sin(π/10)/0.04
        "{'v_z, m/s': -3.0,",  # −λZ(1 − cos 120°)
        "{'v_z, m/s': 3.0,",
        "'ω_z, rad/s': -2.1651",  # −λ sin 120°
        "{'v_z, m/s': 0.0, 'ω_z, rad/s': -8.6603",  # −2λ tan 60°
        "'polar': {'v_z, m/s': 0.0,\n  'ω_z, rad/s': -5.236",  # −λ·2π/3
        "'ω_z, rad/s': 2.618",  # λ·π/3: the long axis of a rectangle is the same after half a turn
        "'pose': 3.2}",
    ],
    "04_linking_and_limits": [
        "array([ 0.064,  0.   ,  0.   ,  0.   , -0.08 ,  0.   ])",  # −ωd and ω
        "'linear adds': 1.646823882",  # (0.04 + 0.024 + √(0.064² + 0.03²) + 0.03)/0.1
        "'smooth adds': 2.470235823",  # 3/2 of it
        "('acceleration', 0.05, 1.25)",  # dω², over 0.04
        "(1.118033988749895, 2.23606797749979, True)",  # √1.25, and 2 s of it
        "0.2356         0.2 m/s",  # 0.15·π/2
        "0.3701          1 m/s²",  # 0.15·(π/2)²
        "(2.0, 1.2)",  # L/v + v/a and 2√(L/a)
        "((7.4096",  # 0.2601/(0.04 cos 0.5): joint 3 of a wrist at q₅ = 0.5
        "(24.98, 24.98)",  # (0.064² + 0.03²)/(2·0.1)
        "(-90.0, 226)",  # (0.03 − 0.04)·9
        "-T*a/lambda",
        "'run, mm': -0.4}",  # −a(T + Tₛ/2)/λ
        "'run, mm': -1.4}",
        "'run, mm': -2.4}",
    ],
    "05_latency_and_prediction": [
        "{0.0: 0.0, 0.02: 0.8, 0.05: 2.0, 0.08: 3.2, 0.1: 4.0}",  # vτ
        "v*(tau - tauhat)",
        "(True, array([ 1.6,  1.2,  0.8,  0.4,  0. , -0.4, -0.8, -1.2, -1.6]))",
        "array([20.    , 12.    ,  7.2   ,  4.32  ,  2.592 ,  1.5552])",  # 20·0.6ᵏ
        "[117.8097245",  # 3π/(2·0.04)
        "39.2699081",  # π/(2·0.04)
        "'Smith, 80 ms': 'completed'",  # 20 s⁻¹ is below 2/0.04
        "'nothing': -8.0",  # −v/λ
        "'Smith': -9.6",  # −v/λ − vτ
        "'integral, 1.6 s': 0.0",
        "(7.31,\n {'nothing': 7.31",  # |v/(jω + λ e^(−jω(τ + Tₛ/2)))|
        "over once': 4.0}",  # information goes with the square of the speed
        "array([[-0.125, -0.075, -0.125]",  # the LEDs of the paper
    ],
    "07_block_diagrams": [
        "3.14159265358979",  # SIMC: π, 61.35°, 1.59, 2.14 (Skogestad 2003, Table 1)
        "61.352110243",
        "1.5904902",
        "2.14159265358979",
        "count=2, certified=True",
        "array([ 0. , -0.5])",  # x' = −x(t − 1) by hand
        "(0, (1+0j), 0j)",  # the column's integral action
    ],
}


def test_every_notebook_has_results_to_show():
    assert sorted(path.stem for path in FOLDER.glob("*.ipynb")) == sorted(SHOWN)


class Shell(InteractiveShell):
    """IPython without a window system: figures are shown in the notebook."""

    def enable_gui(self, gui=None):
        assert gui is None


@pytest.fixture
def shell() -> Iterator[Shell]:
    """A fresh IPython in the folder of the notebooks; what a notebook sets for all is put back."""
    config = Config({"HistoryManager": {"enabled": False}})
    with mpl.rc_context(), np.printoptions(), chdir(FOLDER):
        shell = Shell.instance(config=config)
        yield shell
        shell.restore_sys_module_state()
        Shell.clear_instance()


def code_of(name):
    """The code cells of a notebook, as its file has them."""
    notebook = json.loads((FOLDER / f"{name}.ipynb").read_text(encoding="utf-8"))
    return [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]


@pytest.mark.parametrize("name", SHOWN)
def test_a_notebook_is_kept_without_outputs_and_without_functions(name):
    code = code_of(name)
    assert not any(cell["outputs"] or cell["execution_count"] for cell in code)
    assert not any("def " in "".join(cell["source"]) for cell in code)


# One of them runs in a kernel below. What takes minutes, every experiment of `validate_all`, is run
# piece by piece by the tests of its rooms, and as a notebook with --long.
@pytest.mark.parametrize("name", [n for n in SHOWN if effort.long or n not in {KERNEL, LONG}])
def test_a_notebook_runs_silently_and_shows_known_results(name, shell):
    shown = []
    for cell in code_of(name):
        with capture_output() as captured:
            result = shell.run_cell("".join(cell["source"]))
        result.raise_error()
        assert not captured.stderr
        shown += [out.data for out in captured.outputs]
        if result.result is not None:
            shown.append(shell.display_formatter.format(result.result)[0])
    together = "\n".join(data.get("text/plain", "") for data in shown)
    for text in SHOWN[name]:
        assert text in together


# One starts a kernel in every run; its imports alone cost seconds.
@pytest.mark.parametrize("name", SHOWN if effort.long else [KERNEL])
@pytest.mark.filterwarnings("default")  # the kernel's own sockets, not vsctrl's code
def test_a_notebook_runs_silently_in_a_kernel(name):
    import nbformat  # seconds, for the grammar of its addresses
    from nbclient import NotebookClient

    notebook = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
    resources = {"metadata": {"path": str(FOLDER)}}
    NotebookClient(notebook, timeout=300, kernel_name="python3", resources=resources).execute()
    outputs = [out for cell in notebook.cells for out in cell.get("outputs", ())]
    assert not [out.text for out in outputs if out.get("name") == "stderr"]
    shown = "\n".join(out.data.get("text/plain", "") for out in outputs if "data" in out)
    for text in SHOWN[name]:
        assert text in shown
