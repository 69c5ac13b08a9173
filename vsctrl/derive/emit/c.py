"""A derived matrix as one C99 function that needs math.h and nothing else.

The module exists for controllers that run without Python: the function takes its numbers by value,
allocates nothing and writes L row by row. Names that C keeps for itself get a letter more.
"""

import re
import unicodedata
from collections.abc import Sequence

from sympy import Expr, Float, Symbol
from sympy.printing.c import C99CodePrinter
from sympy.printing.codeprinter import PrintMethodNotImplementedError

from vsctrl.derive.emit.meanings import described
from vsctrl.derive.emit.shared import common, computable, factors
from vsctrl.derive.kinematics.interaction import VisualFeature
from vsctrl.errors import InputError

_LINE = 100
_KEYWORDS = """
    auto break case char const continue default do double else enum extern float for goto if inline
    int long register restrict return short signed sizeof static struct switch typedef union
    unsigned void volatile while
    asm fortran typeof alignas alignof bool constexpr false nullptr static_assert thread_local true
    catch class concept delete explicit export friend mutable namespace new noexcept operator
    private protected public requires template this throw try typename using virtual
    and and_eq bitand bitor compl not not_eq or or_eq xor xor_eq
    linux unix i386 near far
    L
"""
_FUNCTIONS = """
    acos acosh asin asinh atan atan2 atanh cbrt ceil copysign cos cosh drem erf erfc exp exp10 exp2
    expm1 fabs fdim finite floor fma fmax fmin fmod frexp gamma hypot ilogb isinf isnan j0 j1 jn
    ldexp lgamma lgamma_r llrint llround log log10 log1p log2 logb lrint lround modf nan nearbyint
    nextafter nexttoward pow pow10 remainder remquo rint round scalb scalbln scalbn significand sin
    sincos sinh sqrt tan tanh tgamma trunc y0 y1 yn
"""
_MACROS = """
    iscanonical issubnormal fpclassify isfinite isgreater isgreaterequal isless islessequal
    islessgreater isnormal isunordered signbit issignaling iszero signgam float_t double_t
    math_errhandling matherr iseqsig HUGE INFINITY NAN DOMAIN SING OVERFLOW UNDERFLOW PLOSS TLOSS
    MAXFLOAT X_TLOSS
"""
_TAKEN = frozenset(
    [
        *(_KEYWORDS + _MACROS).split(),
        *(name + kind for name in _FUNCTIONS.split() for kind in ("", "f", "l")),
    ]
)
_FAMILIES = ("FP_", "HUGE_", "MATH_", "M_", "SNAN")


class _Printer(C99CodePrinter):
    """C in which integer powers of a symbol are products and every number keeps its digits."""

    def __init__(self, names: dict[Symbol, str]) -> None:
        # Without the macros for π and its like, which ISO C does not have.
        super().__init__({"math_macros": {}, "strict": True})
        self._names = names

    def _print_Symbol(self, expr: Symbol) -> str:
        return self._names.get(expr, expr.name)

    def _print_Pow(self, expr: Expr) -> str:
        if (number := factors(expr)) and expr.exp != -1:
            product = "*".join([self._print(expr.base)] * number)
            return f"({product})" if expr.exp > 0 else f"(1.0/({product}))"
        if expr.exp.is_Rational and abs(expr.exp) == Float(0.5):
            root = f"sqrt({self._print(expr.base)})"
            return root if expr.exp > 0 else f"(1.0/{root})"
        return str(super()._print_Pow(expr))

    def _print_Float(self, expr: Expr) -> str:
        return repr(float(expr))

    def _print_Integer(self, expr: Expr) -> str:
        # Among doubles an int is as good, as long as it is one.
        return str(expr) if abs(expr) < 2**15 else repr(float(expr))

    def _print_Rational(self, expr: Expr) -> str:
        return f"{float(expr.p)!r}/{float(expr.q)!r}"

    def _print_NumberSymbol(self, expr: Expr) -> str:
        return repr(float(expr))


def c_function(feature: VisualFeature) -> str:
    """C99 source of ``void <name>_interaction(const double …, double L[k][6])``.

    Errors: `InputError` for a function that math.h does not have, or an L that is not real.
    """
    L, arguments = computable(feature), feature.arguments
    name = f"{_ascii(feature.name)}_interaction"
    names = safe_names(arguments, {name})
    shared, entries = common(list(L), {*names.values()})
    printer = _Printer(names)
    body = [f"(void){names[a]};" for a in arguments if a not in L.free_symbols]
    body += [f"const double {symbol} = {_expression(printer, value)};" for symbol, value in shared]
    for place, entry in enumerate(entries):
        i, j = divmod(place, 6)
        body.append(f"L[{i}][{j}] = {_expression(printer, entry)};")
    comment = [
        f"L of {_ascii(feature.name)}, {L.rows} x 6, by rows: s' = L T for a still target.",
        "",
        "Columns Vx Vy Vz (per m/s), Omega_x Omega_y Omega_z (per rad/s) of the twist T of the",
        "camera in its own frame.",
        *_without_accents(described(arguments, [names[a] for a in arguments])),
        "",
        "Derived by vsctrl with SymPy from how a still point p moves in the frame of a moving",
        "camera, p' = -V - Omega x p. Not finite where the feature is singular.",
    ]
    lines = ["#include <math.h>", "", "/*", *(f" * {line}".rstrip() for line in comment), " */"]
    lines += [*_signature(name, [names[a] for a in arguments], L.rows), "{"]
    lines += [f"    {line}" for line in body]
    return "\n".join([*lines, "}"]) + "\n"


def is_reserved(name: str) -> bool:
    """Whether a C or C++ compiler, or its math.h under any of its switches, may know the name."""
    return name in _TAKEN or name.startswith(_FAMILIES)


def safe_names(arguments: Sequence[Symbol], taken: set[str]) -> dict[Symbol, str]:
    """A different C identifier for each argument, its own name where C lets it be."""
    used, names = set(taken), {}
    # Those that keep their names come first, so that no other is renamed into one of them.
    for symbol in sorted(arguments, key=lambda a: _ascii(a.name) != a.name or is_reserved(a.name)):
        name = _ascii(symbol.name)
        name = f"v{name}" if name.startswith(_FAMILIES) else name
        while name in used or is_reserved(name):
            name += "_"
        used.add(name)
        names[symbol] = name
    return names


def _ascii(name: str) -> str:
    """An identifier in plain letters: θ_x as theta_x, what starts with _ or has __ without."""
    plain = "".join(c if c.isascii() else _spelled(c) for c in name)
    plain = re.sub(r"__+", "_", plain)
    return f"v{plain}" if plain.startswith("_") else plain


def _spelled(character: str) -> str:
    greek = re.fullmatch(r"GREEK (SMALL|CAPITAL) LETTER (\w+)", unicodedata.name(character, ""))
    if greek:
        return greek[2].lower() if greek[1] == "SMALL" else greek[2].capitalize()
    return f"u{ord(character):04X}"


def _without_accents(lines: Sequence[str]) -> list[str]:
    return [line.encode("ascii", "replace").decode() for line in lines]


def _expression(printer: _Printer, value: Expr) -> str:
    try:
        text = " ".join(printer.doprint(value).split())
    except PrintMethodNotImplementedError:
        text = ""
    if not text or "Not supported" in text:
        raise InputError(f"C has no function for {value}; write the feature without it.")
    # A lone int would do, but reads as if L were one.
    return f"{text}.0" if text.lstrip("-").isdigit() else text


def _signature(name: str, names: Sequence[str], rows: int) -> list[str]:
    parts = [*(f"const double {argument}" for argument in names), f"double L[{rows}][6]"]
    one = f"void {name}({', '.join(parts)})"
    if len(one) <= _LINE:
        return [one]
    lines, line = [f"void {name}("], "   "
    for part in [*(f"{part}," for part in parts[:-1]), f"{parts[-1]})"]:
        if len(f"{line} {part}") > _LINE:
            lines.append(line)
            line = "   "
        line = f"{line} {part}"
    return [*lines, line]
