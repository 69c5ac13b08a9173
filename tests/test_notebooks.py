"""Every notebook runs from top to bottom, and is kept free of outputs and of functions."""

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

FOLDER = Path(__file__).parents[1] / "notebooks"
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


@pytest.mark.parametrize("name", SHOWN)
@pytest.mark.filterwarnings("default")  # the kernel's own sockets, not vsctrl's code
def test_notebook(name):
    notebook = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert not any(cell.outputs or cell.execution_count for cell in code)
    assert not any("def " in cell.source for cell in code)
    resources = {"metadata": {"path": str(FOLDER)}}
    NotebookClient(notebook, timeout=300, kernel_name="python3", resources=resources).execute()
    outputs = [out for cell in code for out in cell.outputs]
    assert not [out.text for out in outputs if out.get("name") == "stderr"]
    shown = "\n".join(out.data.get("text/plain", "") for out in outputs if "data" in out)
    for text in SHOWN[name]:
        assert text in shown
