"""The house as a whole: what loads when, what is documented, and what must not occur.

Which room may import which is checked by import-linter in CI.
"""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

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
    """What programs write lives in folders called generated."""
    generated = [path for path in MODULES if path.parent.name == "generated"]
    assert any(path.name != "__init__.py" for path in generated)
    lines = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in MODULES}
    assert not {path.name for path, n in lines.items() if n > 400 and path not in generated}


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


# Imports between modules -----------------------------------------------------------------------
def parsed(root: Path, package: str) -> dict[str, ast.Module]:
    """The modules of a package by their dotted names."""
    trees = {}
    for path in sorted((root / package).rglob("*.py")):
        parts = path.relative_to(root).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        trees[name] = ast.parse(path.read_text(encoding="utf-8"))
    return trees


def imported_names(tree: ast.Module) -> Iterator[tuple[str, str]]:
    """(module, name) of every import wherever it stands, name empty for ``import module``."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, "a relative import"
            yield from ((node.module or "", alias.name) for alias in node.names)


def import_cycles(trees: dict[str, ast.Module]) -> list[list[str]]:
    """Sets of modules that import each other, by late and by type-checking imports too.

    A package counts as its ``__init__`` module, with what that imports itself.
    """
    names = sorted(trees)
    edges = np.zeros((len(names), len(names)), dtype=bool)
    for i, name in enumerate(names):
        for module, entry in imported_names(trees[name]):
            target = f"{module}.{entry}" if f"{module}.{entry}" in trees else module
            if target in trees and target != name:
                edges[i, names.index(target)] = True
    _, component = connected_components(csr_array(edges), directed=True, connection="strong")
    members = [np.flatnonzero(component == k) for k in np.unique(component)]
    return [[names[i] for i in group] for group in members if len(group) > 1]


def test_no_modules_import_each_other_in_a_circle():
    assert import_cycles(parsed(ROOT, "vsctrl")) == []


@pytest.mark.parametrize(
    "back",
    [
        "from house import attic",
        "from house.attic import ROOF",
        "import house.attic",
        "def late():\n    from house.attic import ROOF",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from house.attic import ROOF",
        "from house import room",
    ],
)
def test_a_planted_cycle_is_found(tmp_path: Path, back: str):
    files = {
        "house/__init__.py": "",
        "house/attic.py": "from house.room import walls\nROOF = walls.HEIGHT",
        "house/room/__init__.py": "from house import attic" if "room" in back else "",
        "house/room/walls.py": "import math\nfrom house.room import ground",
        "house/room/ground.py": "",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    if "room" not in back:
        assert import_cycles(parsed(tmp_path, "house")) == []
    (tmp_path / "house/room/ground.py").write_text(back)
    (cycle,) = import_cycles(parsed(tmp_path, "house"))
    assert {"house.attic", "house.room.ground"} <= set(cycle)


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.endswith("__")


def declared(tree: ast.Module) -> set[str]:
    """Names of the functions, classes, variables, fields and attributes that a module makes."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store):
            names.add(node.id if isinstance(node, ast.Name) else node.attr)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            names.add(node.value)  # as of object.__setattr__(self, "_kept", …)
    return names


def private_uses(trees: dict[str, ast.Module]) -> list[str]:
    """Where a module uses a private name of another, by import or as an attribute.

    What a class inherits is its own, so that ``self``, ``cls`` and ``super()`` may have it.
    """
    own = {name: declared(tree) for name, tree in trees.items()}
    everywhere = {name for names in own.values() for name in names if is_private(name)}
    uses = []
    for name, tree in trees.items():
        uses += [
            f"{name} imports {module}.{entry}"
            for module, entry in imported_names(tree)
            if module.partition(".")[0] == name.partition(".")[0]
            and any(map(is_private, (*module.split("."), entry)))
        ]
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and node.attr in everywhere - own[name]:
                owner = getattr(node.value, "func", node.value)
                if getattr(owner, "id", "") not in {"self", "cls", "super"}:
                    uses.append(f"{name} uses {ast.unparse(node)}")
    return uses


def test_no_module_uses_a_private_name_of_another():
    assert private_uses(parsed(ROOT, "vsctrl")) == []


@pytest.mark.parametrize(
    ("text", "uses"),
    [
        ("from house.room import _key", ["house.attic imports house.room._key"]),
        ("from house import room\nroom._key", ["house.attic uses room._key"]),
        ("def f(room):\n    return room._walls", ["house.attic uses room._walls"]),
        ("from house.room import Room\nclass Attic(Room):\n    a = lambda self: self._walls", []),
        ("class Attic:\n    _walls: int\n    def same(self, o): return o._walls", []),
        ("from other import _key\n_key._replace()", []),
    ],
)
def test_a_planted_private_use_is_found(text: str, uses: list[str]):
    room = "_key = 1\nclass Room:\n    def __init__(self): self._walls = 4"
    trees = {"house": "", "house.room": room, "house.attic": text}
    assert private_uses({name: ast.parse(source) for name, source in trees.items()}) == uses


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


def test_what_keeps_results_leaves_them_behind_when_it_travels():
    """Every class with a cached property is a `Caching`, of itself or by a base."""
    bases: dict[str, set[str]] = {}
    keeping: list[tuple[str, set[str]]] = []
    for path in MODULES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef):
                own = {ast.unparse(base) for base in node.bases}
                bases[node.name] = bases.get(node.name, set()) | own
                decorators = [d for f in node.body for d in getattr(f, "decorator_list", ())]
                if any(ast.unparse(d).endswith("cached_property") for d in decorators):
                    keeping.append((node.name, own))

    def above(names: set[str]) -> set[str]:
        return names.union(*(above(bases.get(name, set())) for name in names))

    assert len(keeping) > 15
    assert [name for name, own in keeping if "Caching" not in above(own)] == []


def test_what_people_type_is_quoted_at_most_a_line_long():
    """`!r` in a sentence would print a name of ten thousand letters whole."""
    generates_code = {ROOT / "vsctrl" / "derive" / "emit" / "c.py"}
    found = [
        str(path.relative_to(ROOT))
        for path in sorted((ROOT / "vsctrl").rglob("*.py"))
        if path not in generates_code
        and "InputError" in (text := path.read_text())
        and "!r}" in text
    ]
    # Names of ours: one that is near what was typed, and one that Python asks for.
    assert found == ["vsctrl/__init__.py", "vsctrl/errors.py"]
