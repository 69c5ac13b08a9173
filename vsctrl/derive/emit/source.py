"""One derived matrix as the source text of one batched NumPy function.

The module exists because SymPy's own ``lambdify`` fails on batched input when an entry is a
constant: here the batch shape comes from the arguments and every entry is written into its place.
Which functions make up a module is left to ``kernels``.
"""

import ast
from collections.abc import Sequence

from sympy import Expr, ImmutableMatrix, Symbol
from sympy.printing.codeprinter import PrintMethodNotImplementedError
from sympy.printing.numpy import NumPyPrinter

from vsctrl.derive.emit.shared import common, factors
from vsctrl.errors import InputError

LINE_LENGTH = 100
_INDENT = "    "


class Printer(NumPyPrinter):
    """NumPy source in which integer powers of a symbol are products and quotients."""

    reserved_words: set[str]

    def __init__(self) -> None:
        super().__init__()
        # Names that the printed function uses for itself; SymPy appends _ to an argument so named.
        # A new set: SymPy keeps the original on the class, where every other printer reads it.
        self.reserved_words = {*self.reserved_words, "np", "numpy", "out", "shape"}

    def _print_Pow(self, expr: Expr, rational: bool = False, **kwargs: object) -> str:
        # NumPyPrinter writes 1/z² as z**(-2.0), which calls pow for every element.
        if number := factors(expr):
            product = "*".join([self._print(expr.base)] * number)
            return f"({product})" if expr.exp > 0 else f"(1.0/({product}))"
        if expr.exp == -1:
            return f"(1.0/({self._print(expr.base)}))"
        return str(super()._print_Pow(expr, rational=rational, **kwargs))

    def _print_Float(self, expr: Expr) -> str:
        # NumPyPrinter rounds to 15 digits.
        return repr(float(expr))

    def doprint(self, expr: Expr) -> str:
        """NumPy source. Errors: `InputError` for a function that NumPy does not have."""
        try:
            text = str(super().doprint(expr))
        except PrintMethodNotImplementedError:
            text = ""
        if not text or set(self.module_imports) - {"numpy"}:
            raise InputError(f"NumPy has no function for {expr}; write the feature without it.")
        return text


class _ShortName(ast.NodeTransformer):
    """``numpy.sqrt`` → ``np.sqrt``."""

    def visit_Name(self, node: ast.Name) -> ast.Name:
        return ast.Name("np", node.ctx) if node.id == "numpy" else node


def function_source(
    name: str, arguments: Sequence[Symbol], matrix: ImmutableMatrix, docstring: Sequence[str]
) -> str:
    """Source of ``name(*arguments)``, which returns the matrix with the batch axes in front.

    A column of k entries gives (..., k), a k×n matrix (..., k, n); the arguments are floats or
    arrays that broadcast. Common subexpressions are computed once.
    """
    names = [Printer().doprint(argument) for argument in arguments]
    shared, entries = common(list(matrix), names)
    reduced = ImmutableMatrix(*matrix.shape, entries)
    column = matrix.cols == 1
    tail = f"{matrix.rows}" if column else f"{matrix.rows}, {matrix.cols}"
    # One allocation for the batch; zeros, because a constant-zero entry is then already in place.
    empty = "zeros" if any(entry.is_zero for entry in matrix) else "empty"
    body = [line for symbol, value in shared for line in _assigned(f"{symbol}", value)]
    body += _allocated(empty, names, tail)
    for i in range(matrix.rows):
        for j in range(matrix.cols):
            if not matrix[i, j].is_zero:
                place = f"{i}" if column else f"{i}, {j}"
                body += _assigned(f"out[..., {place}]", reduced[i, j])
    body.append("return out")
    lines = [*_signature(name, names), *(_INDENT + line for line in _quoted(docstring) + body)]
    return "\n".join(line.rstrip() for line in lines) + "\n"


def _expression(value: Expr) -> str:
    """NumPy source with spaces around operators and no needless parentheses."""
    tree = ast.parse(Printer().doprint(value), mode="eval")
    return ast.unparse(_ShortName().visit(tree))


def _allocated(function: str, names: Sequence[str], tail: str) -> list[str]:
    """``out`` as the formatter lays it out; where the line would be long, its shape comes first."""
    joined = ", ".join(names)
    one = f"out = np.{function}((*np.broadcast({joined}).shape, {tail}))"
    if len(_INDENT + one) <= LINE_LENGTH:
        return [one]
    shape = [f"shape = np.broadcast({joined}).shape"]
    if len(_INDENT + shape[0]) > LINE_LENGTH:
        inside = [joined] if len(2 * _INDENT + joined) <= LINE_LENGTH else [f"{n}," for n in names]
        shape = ["shape = np.broadcast(", *(_INDENT + line for line in inside), ").shape"]
    return [*shape, f"out = np.{function}((*shape, {tail}))"]


def _assigned(target: str, value: Expr) -> list[str]:
    """The assignment as the formatter lays it out: on one line, on three, or one term a line."""
    text = _expression(value)
    one = f"{target} = {text}"
    if len(_INDENT + one) <= LINE_LENGTH:
        return [one]
    whole = len(2 * _INDENT + text) <= LINE_LENGTH
    terms = [text] if whole else _terms(ast.parse(text, mode="eval").body)
    # What is one long term stays on its line, which no formatter would break either.
    return [one] if len(terms) == 1 and not whole else [
        f"{target} = (", *(_INDENT + term for term in terms), ")"
    ]  # fmt: skip


def _terms(tree: ast.expr) -> list[str]:
    """The terms of a sum, all but the first with their sign."""
    if not isinstance(tree, ast.BinOp) or not isinstance(tree.op, ast.Add | ast.Sub):
        return [ast.unparse(tree)]
    sign = "+" if isinstance(tree.op, ast.Add) else "-"
    return [*_terms(tree.left), f"{sign} {ast.unparse(tree.right)}"]


def _quoted(docstring: Sequence[str]) -> list[str]:
    first, *rest = docstring
    return [f'"""{first}', *rest, '"""'] if rest else [f'"""{first}"""']


def _signature(name: str, names: Sequence[str]) -> list[str]:
    """The def line as the formatter lays it out: on one line, on three, or one argument a line."""
    arguments = [f"{argument}: Values" for argument in names]
    result = ") -> NDArray[np.float64]:"
    one = f"def {name}({', '.join(arguments)}{result}"
    if len(one) <= LINE_LENGTH:
        return [one]
    joined = _INDENT + ", ".join(arguments)
    if len(joined) <= LINE_LENGTH:
        return [f"def {name}(", joined, result]
    return [f"def {name}(", *(f"{_INDENT}{argument}," for argument in arguments), result]
