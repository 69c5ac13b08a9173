"""The house as a whole: what loads when, what is documented, and what must not occur.

Which room may import which is checked by import-linter in CI.
"""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import vsctrl

ROOT = Path(__file__).resolve().parents[1]
MODULES = sorted((ROOT / "vsctrl").rglob("*.py"))
HEAVY = ["sympy", "control", "matplotlib", "scipy", "numpy", "pydantic", "jinja2", "click"]


def loaded_after(code: str) -> set[str]:
    """Which heavy packages a fresh interpreter has loaded after some code."""
    report = (
        f"import sys; print(*[m for m in {[*HEAVY, 'matplotlib.pyplot']!r} if m in sys.modules])"
    )
    found = subprocess.run(
        [sys.executable, "-c", f"{code}\n{report}"],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
        cwd=ROOT,
    )
    return set(found.stdout.split())


# What loads when -------------------------------------------------------------------------------
def test_importing_vsctrl_loads_nothing_heavy():
    assert loaded_after("import vsctrl; dir(vsctrl); vsctrl.__version__") == set()


def test_a_name_loads_its_own_room_only():
    assert loaded_after("import vsctrl; vsctrl.InputError") == set()
    assert loaded_after("import vsctrl; vsctrl.simulate(vsctrl.paper.sliding())") <= {
        "numpy",
        "pydantic",
    }
    assert not loaded_after(
        "import vsctrl; vsctrl.figure1.transfer('S_ref', 'S'); vsctrl.per_sample(0.1, 0.04)"
    ) & {"control", "matplotlib", "pydantic", "jinja2"}


def test_pyplot_is_never_loaded_by_vsctrl_itself():
    for path in MODULES:
        assert "pyplot" not in imports(path), path


def imports(path: Path) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {part for alias in node.names for part in alias.name.split(".")}
        elif isinstance(node, ast.ImportFrom):
            names |= {*(node.module or "").split("."), *(alias.name for alias in node.names)}
    return names


# The public face -------------------------------------------------------------------------------
def test_every_public_name_resolves_and_is_listed():
    assert len(vsctrl.__all__) == len(set(vsctrl.__all__))
    for name in vsctrl.__all__:
        assert getattr(vsctrl, name) is not None
        assert name in dir(vsctrl)
    assert "__version__" in dir(vsctrl) and dir(vsctrl) == sorted(dir(vsctrl))


def test_the_names_of_design_md_that_this_version_has():
    named = "Block Diagram Parabola Ramp Run Scenario Sine Step Sum derive figure1 loop paper"
    assert {*named.split(), "per_sample", "simulate", "validate", "write_report"} <= set(
        vsctrl.__all__
    )


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match=r"module 'vsctrl' has no attribute 'simulat'"):
        vsctrl.simulat  # noqa: B018
    assert not hasattr(vsctrl, "_repr_html_")


def test_a_name_that_loads_late_is_the_same_object_every_time():
    from vsctrl.servo import Scenario

    assert vsctrl.Scenario is Scenario and vsctrl.figure1 is vsctrl.loop.figure1


def test_type_checkers_see_the_names_that_load_late():
    tree = ast.parse((ROOT / "vsctrl/__init__.py").read_text(encoding="utf-8"))
    typed = {
        alias.asname or alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.If)
        for line in node.body
        if isinstance(line, ast.ImportFrom)
        for alias in line.names
    }
    assert typed == set(vsctrl.__all__)
    assert (ROOT / "vsctrl/py.typed").is_file()


# Source ----------------------------------------------------------------------------------------
def undocumented(node: ast.AST, where: str) -> list[str]:
    found = []
    for part in getattr(node, "body", []):
        if isinstance(part, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            if part.name.startswith("_") or _overload(part):
                continue
            if not ast.get_docstring(part):
                found.append(f"{where}.{part.name}")
            if isinstance(part, ast.ClassDef):
                found += undocumented(part, f"{where}.{part.name}")
    return found


def _overload(part: ast.AST) -> bool:
    return any(
        isinstance(d, ast.Name) and d.id == "overload" for d in getattr(part, "decorator_list", [])
    )


def test_every_module_and_every_public_name_is_documented():
    missing = []
    for path in MODULES:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        where = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        missing += [] if ast.get_docstring(tree) else [where]
        missing += undocumented(tree, where)
    assert not missing


def test_no_module_that_people_write_is_longer_than_400_lines():
    generated = ROOT / "vsctrl/servo/generated/kernels.py"
    assert generated in MODULES
    lines = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in MODULES}
    assert not {path.name for path, n in lines.items() if n > 400 and path != generated}


def test_text_is_never_run_as_code():
    """No eval, exec or parsing of text by SymPy; `sympify(…, strict=True)` refuses text."""
    found = []
    for path in MODULES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call):
                continue
            name = getattr(node.func, "id", getattr(node.func, "attr", ""))
            strict = any(
                k.arg == "strict" and isinstance(k.value, ast.Constant) and k.value.value is True
                for k in node.keywords
            )
            if name in {"eval", "exec", "parse_expr", "S", "compile", "__import__"} or (
                name in {"sympify", "_sympify"} and not strict
            ):
                owner = getattr(getattr(node.func, "value", None), "id", "")
                if owner not in {"re", "Coefficients"}:
                    found.append(f"{path.relative_to(ROOT)}:{node.lineno} {name}")
    assert not found


def test_nothing_prints_but_the_command_line():
    for path in MODULES:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        calls = [n for n in ast.walk(tree) if isinstance(n, ast.Call)]
        assert not [n for n in calls if getattr(n.func, "id", "") in {"print", "breakpoint"}], path


# The repository --------------------------------------------------------------------------------
def test_the_top_level_holds_what_it_should():
    listed = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True, timeout=30
    )
    top = {line.split("/")[0] for line in listed.stdout.splitlines()}
    allowed = {"pyproject.toml", "vsctrl", "analysis", "notebooks", "tests", "README.md"}
    assert {name for name in top if not name.startswith(".")} <= allowed
    assert {"pyproject.toml", "vsctrl", "tests", "README.md"} <= top


def test_test_files_have_names_of_their_own():
    """pytest imports them by base name, since no folder of tests is a package."""
    files = [p for p in (ROOT / "tests").rglob("*.py") if p.name != "conftest.py"]
    names = [p.name for p in files]
    assert "__init__.py" not in names
    assert len(names) == len(set(names))
