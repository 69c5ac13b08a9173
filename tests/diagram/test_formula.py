"""Transfer functions as text: what is read is what SymPy makes of the same formula, exactly."""

import math
from fractions import Fraction

import pytest
import sympy as sp
from effort import share
from hypothesis import given, settings
from hypothesis import strategies as st

from vsctrl.diagram.document.formula import parse
from vsctrl.diagram.document.names import symbol
from vsctrl.diagram.document.render import render
from vsctrl.errors import InputError
from vsctrl.symbols import ell_hat, kappa, lam, s, tau, tau_hat

K, T, a = sp.symbols("K T a")

# Trees of (text, value at a point): written by one, worked out by Python's own numbers -----------
POINT = {"s": 0.7 + 1.1j, "K": 2.5, "T": 0.3, "lam": 1.7, "θ_1": 0.9}
NUMBERS = st.one_of(
    st.integers(0, 40).map(str),
    st.decimals(0, 99, places=2).map(lambda d: f"{d}".rstrip("0") or "0"),
    st.sampled_from(["1e-3", "2.5E2", ".5", "3."]),
)


def leaf(text):
    return text, complex(POINT[text]) if text in POINT else complex(float(text))


def joined(sign, left, right):
    (x, p), (y, q) = left, right
    value = {"+": lambda: p + q, "-": lambda: p - q, "*": lambda: p * q, "/": lambda: p / q}[sign]()
    return f"({x}) {sign} ({y})", value


@st.composite
def formulas(draw, depth=4):
    if depth == 0 or draw(st.booleans()):
        return leaf(draw(st.one_of(NUMBERS, st.sampled_from(list(POINT)))))
    kind = draw(st.sampled_from("+-*/^n"))
    left = draw(formulas(depth - 1))
    if kind == "^":
        power = draw(st.integers(1, 3))
        return f"({left[0]}){draw(st.sampled_from(['^', '**']))}{power}", left[1] ** power
    if kind == "n":
        return f"-({left[0]})", -left[1]
    right = draw(formulas(depth - 1))
    if kind == "/" and abs(right[1]) < 1e-6:
        kind = "*"
    return joined(kind, left, right)


@settings(max_examples=share(400), deadline=None)
@given(formulas())
def test_a_text_has_the_value_that_its_arithmetic_has(formula):
    text, value = formula
    try:
        expr = parse(text)
    except ValueError as refused:  # of exact arithmetic: 0/0 that floats do not see
        assert any(words in str(refused) for words in ("zero", "too many", "no number"))
        return
    point = {symbol("theta_1" if n == "θ_1" else n): x for n, x in POINT.items()}
    found = complex(sp.N(expr.subs(point), 20))
    if math.isfinite(abs(value)) and abs(value) < 1e12:
        assert abs(found - value) <= 1e-8 * (1 + abs(value)), text


@st.composite
def expressions(draw, depth=3):
    """SymPy's own expressions, built without any text."""
    if depth == 0:
        fraction = st.fractions(-9, 9, max_denominator=50).map(
            lambda f: sp.Rational(f.numerator, f.denominator)
        )
        leaves = [s, K, T, lam, kappa, tau, sp.exp(-tau * s), sp.exp(-s * (T + 2)), sp.sqrt(2)]
        return draw(st.one_of(fraction, st.sampled_from(leaves)))
    x, y = draw(expressions(depth - 1)), draw(expressions(depth - 1))
    kind = draw(st.sampled_from("+-*/^"))
    if kind == "^":
        return x ** draw(st.sampled_from([2, 3, -1, sp.Rational(1, 2)])) if x else x
    if kind == "/":
        return x / y if y else x
    return {"+": x + y, "-": x - y, "*": x * y}[kind]


@settings(max_examples=share(400), deadline=None)
@given(expressions())
def test_what_is_written_is_read_back(expr):
    if expr.has(sp.zoo, sp.nan, sp.I):
        return
    text = render(expr)
    try:
        again = parse(text)
    except ValueError as refused:
        assert "too many terms" in str(refused)
        return
    if again != expr:  # a number times a sum of two is multiplied out, and nothing else
        point = {x: sp.Rational(3 + k, 7) for k, x in enumerate(sorted(expr.free_symbols, key=str))}
        off = sp.N(again.subs(point) - expr.subs(point), 30, chop=True)
        assert abs(off) < 1e-20 * (1 + abs(sp.N(expr.subs(point)))), text
    assert parse(render(again)) == again


@pytest.mark.parametrize(
    ("text", "expr"),
    [
        ("K*(1 + 1/(T*s))*exp(-tau*s)", K * (1 + 1 / (T * s)) * sp.exp(-tau * s)),
        ("0.1 + 0.2", sp.Rational(3, 10)),
        ("1e-3*s", s / 1000),
        ("-a^2", -(a**2)),
        ("2^-1", sp.Rational(1, 2)),
        ("2**3**2", sp.Integer(512)),
        ("a/K/T", a / (K * T)),
        ("a - K - T", a - K - T),
        ("λ·κ/s", lam * kappa / s),
        ("exp(−τ*s)", sp.exp(-tau * s)),
        ("ℓ̂ + τ̂", ell_hat + tau_hat),
        ("sqrt(4*a^2)", 2 * sp.sqrt(a**2)),
        ("π", sp.pi),
        ("K^a", K**a),
    ],
)
def test_a_formula_is_exact(text, expr):
    assert parse(text) == expr


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("2s", r"character 2: there is no sign between '2' and 's'; write 2\*s"),
        ("(s+1)(s+2)", r"no sign between '\)' and '\('"),
        ("K(1+s)", r"'K' before a parenthesis is no function; write K\*\(…\)"),
        ("sinh(s)", "'sinh' before .*did you mean 'sin'"),
        ("exp", r"the function exp has no argument"),
        ("1/0", "divides by zero"),
        ("1/(s-s)", "divides by zero"),
        ("0^-1", "no number"),
        ("log(0)", "infinite"),
        ("(a+1", r"'\(' is never closed"),
        ("a+1)", "should end"),
        ("", "ends too early"),
        ("a +", "ends too early"),
        ("a $ b", r"'\$' has no meaning"),
        ("__import__('os')", "has no meaning"),
        ("a.b", "no meaning"),
        ("1e999", "exponent beyond"),
        ("9" * 2000, "more than 1000 digits"),
        ("2^2^9", "exponent is beyond"),
        ("((9^99)^99)^99", "too many digits"),
        ("(a+K+T+s)^99", "too many terms"),
        ("exp(exp(exp(9)))", "holds an exp itself"),
        ("exp(1e9)", "exp of a number beyond"),
        ("(" * 60 + "a" + ")" * 60, "within each other"),
        ("2^" * 60 + "1", "within each other"),
        ("a" * 30_000, "characters; write one of at most"),
        ("2^(s + 1)", "exponent must be a fraction"),
        (3.5, "no text"),
    ],
)
def test_what_is_no_formula_is_refused_in_a_sentence(text, words):
    with pytest.raises(ValueError, match=words):
        parse(text)


def test_numbers_are_written_as_decimals_where_they_are_some():
    texts = [render(sp.Rational(f)) for f in ("0.08", "1/3", "-5/2", "7")]
    assert texts == ["0.08", "1/3", "-2.5", "7"]
    assert render(K / (T * s + 1) * sp.exp(-T * s)) == "K*exp(-T*s)/(T*s + 1)"
    assert Fraction(parse(render(sp.Rational(0.1))).p, parse(render(sp.Rational(0.1))).q) == 0.1


def test_what_the_grammar_has_not_is_not_written():
    for expr in (sp.besselj(0, K), sp.I * K, sp.Symbol("two words"), sp.Symbol("exp")):
        with pytest.raises(InputError, match=r"to_toml: .*(cannot be)"):
            render(expr)


# Whatever is typed ------------------------------------------------------------------------------
ALPHABET = st.sampled_from([*"sKT()+-*/^.0123456789 e", "exp(", "sqrt(", "**", "λ", "τ̂", "−", "$"])


@settings(max_examples=share(4000, 250), deadline=None)
@given(st.one_of(st.lists(ALPHABET, max_size=25).map("".join), st.text(max_size=25)))
def test_any_text_is_an_expression_or_a_sentence(text):
    try:
        expr = parse(text)
    except ValueError as refused:
        assert len(str(refused)) < 300 and ";" in str(refused)
    else:
        assert isinstance(expr, sp.Expr)
