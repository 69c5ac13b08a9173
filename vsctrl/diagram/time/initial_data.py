"""What every signal of a diagram was at t ≤ 0, from the initial data of some, and how it goes on.

Inputs and blocks with dynamics have initial data of their own, zero where none are given. All other
signals follow: from constants by the gains at s = 0, from functions of time as sums of these and of
their derivatives, each delayed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, partial
from typing import Any

import numpy as np

from vsctrl.arrays import Array
from vsctrl.caching import Caching
from vsctrl.checks import is_finite, quoted
from vsctrl.diagram.description.blocks import Block
from vsctrl.diagram.description.wiring import Wiring, resolve
from vsctrl.diagram.numerics.graphs import on_cycles, reached
from vsctrl.diagram.signals.elementary import Step
from vsctrl.diagram.signals.signal import Signal, beside
from vsctrl.diagram.symbolic.coefficients import BlockCoefficients
from vsctrl.diagram.time import initial_function
from vsctrl.diagram.time.initial_function import DelayedInitialFunction, InitialFunction
from vsctrl.errors import InputError, nearest

Past = float | Callable[[Array], Any]  #: a constant, or a function of times t ≤ 0 (s)
DelayedTerms = dict[tuple[str, int, Fraction], float]  #: (leaf, derivative, delay) → factor

HERE = (0, Fraction(0))  #: the key of a plain number among the coefficients of a block
GLIMPSE = Fraction(1, 1000)  #: seconds that tell a slope where nothing else says how far to look


@dataclass(frozen=True)
class DynamicBlock:
    """A block whose state has initial data: what its output was at t ≤ 0."""

    block: Block
    numbers: BlockCoefficients
    past: Past

    @property
    def den(self) -> Array:
        """d₀ … d_n of a denominator without delays."""
        return np.array(
            [self.numbers.den.get((k, HERE[1]), 0.0) for k in range(self.numbers.order + 1)]
        )

    @property
    def time_constant(self) -> Fraction:
        """Its fastest (s); 1 s for integrators, which have none."""
        fastest = float(np.abs(np.polynomial.polynomial.polyroots(self.den)).max(initial=0.0))
        return Fraction(1 / fastest) if fastest else Fraction(1)

    def check(self) -> None:
        """Refuse a past that the block cannot have had, or that does not tell its state."""
        num, den = self.numbers.num, self.numbers.den
        output, name = self.block.output, self.block.name
        if not callable(self.past):
            if self.past and not at_zero(num):
                raise InputError(
                    f"response: history of {quoted(output)} = {self.past:g}, but block "
                    f"{quoted(name)} is "
                    "zero at s = 0, so that it never rests at anything but 0; leave it out."
                )
        elif set(num) != {HERE} or any(tau for _, tau in den):
            raise InputError(
                f"response: history of {quoted(output)} is a function, which does not tell the "
                "state of "
                f"block {quoted(name)}, as it has a zero or a delay of its own; give a number, or "
                "split it into a block b/den(s), whose output you name, and one with the rest."
            )


class InitialData(Caching):
    """What every signal was at t ≤ 0, and how that alone carries it on."""

    def __init__(
        self, diagram: Wiring, blocks: list[BlockCoefficients], pasts: dict[str, Past], target: str
    ) -> None:
        self.diagram, self.pasts, self.target = diagram, pasts, target
        self.dynamic_blocks: dict[str, DynamicBlock] = {}
        self.static_blocks: dict[str, tuple[Block, DelayedTerms]] = {}
        for block, numbers in zip(diagram.blocks, blocks, strict=True):
            if set(numbers.den) == {HERE}:
                b = numbers.den[HERE]
                factors = {(block.input, *key): c / b for key, c in numbers.num.items()}
                self.static_blocks[block.output] = (block, factors)
            else:
                past = pasts.get(block.output, 0.0)
                self.dynamic_blocks[block.output] = DynamicBlock(block, numbers, past)
        for name in pasts:
            self._check_name(name)
        for dynamic in self.dynamic_blocks.values():
            dynamic.check()
        self._known_terms: dict[str, DelayedTerms] = {}

    def _check_name(self, name: str) -> None:
        if name in self.diagram.inputs or name in self.dynamic_blocks:
            return
        part = self.diagram.drivers[name]
        what = f"block {quoted(part.name)}" if isinstance(part, Block) else f"the sum {part}"
        own = *self.diagram.inputs, *self.dynamic_blocks
        leaves = [leaf for leaf in own if self._feeds(leaf, name)]
        raise InputError(
            f"response: history of {quoted(name)} is not yours to give: {what} has no dynamics and "
            f"follows from what it is fed; name {' or '.join(map(repr, leaves)) or 'none'} instead."
        )

    def _feeds(self, leaf: str, name: str) -> bool:
        """Whether a signal follows from a leaf, an input or a dynamic block, without another."""
        own = {*self.diagram.inputs, *self.dynamic_blocks}
        return leaf in reached([name], lambda n: () if n in own else self.diagram.drivers[n].inputs)

    # Constants -----------------------------------------------------------------------------
    @cached_property
    def constants(self) -> dict[str, float]:
        """What every input and block's output was that has a constant past, or follows from one."""
        out = dict.fromkeys((*self.diagram.inputs, *self.dynamic_blocks), 0.0)
        out |= {name: value for name, value in self.pasts.items() if not callable(value)}
        names = list(self.static_blocks)
        gains, fed = np.zeros((len(names), len(names))), np.zeros(len(names))
        for i, (block, factors) in enumerate(self.static_blocks.values()):
            gain = at_zero({key[1:]: c for key, c in factors.items()})
            for leaf, sign in resolve(self.diagram, block.input).items():
                if leaf in self.static_blocks:
                    gains[i, names.index(leaf)] += sign * gain
                else:
                    fed[i] += sign * gain * out[leaf]
        return out | dict(zip(names, _fixed_point(gains, fed, names), strict=True))

    def constant(self, name: str) -> float:
        """The part of a signal's past that is constant."""
        return sum(k * self.constants[x] for x, k in resolve(self.diagram, name).items())

    # Functions -----------------------------------------------------------------------------
    def delayed_terms(self, name: str, above: tuple[str, ...] = ()) -> DelayedTerms:
        """A signal's past as Σ c φ⁽ᵏ⁾(t − σ) over the initial functions φ."""
        total: DelayedTerms = {}
        for leaf, sign in resolve(self.diagram, name).items():
            for key, c in self._terms_of(leaf, above).items():
                total[key] = total.get(key, 0.0) + sign * c
        return {key: c for key, c in total.items() if c}

    def _terms_of(self, leaf: str, above: tuple[str, ...]) -> DelayedTerms:
        if leaf not in self.static_blocks:
            return {(leaf, *HERE): 1.0} if callable(self.pasts.get(leaf)) else {}
        if leaf in self._known_terms:
            return self._known_terms[leaf]
        if leaf in above:
            if not any(self._feeds(x, leaf) for x, past in self.pasts.items() if callable(past)):
                return {}
            loop = " → ".join((*above[above.index(leaf) :], leaf))
            raise InputError(
                f"response: the loop {loop} has no dynamics, so that its past does not follow from "
                "functions of time that are fed to it; give numbers in history."
            )
        block, factors = self.static_blocks[leaf]
        total: DelayedTerms = {}
        for (source, k, sigma), c in self.delayed_terms(block.input, (*above, leaf)).items():
            for (_, j, tau), factor in factors.items():
                key = (source, k + j, sigma + tau)
                total[key] = total.get(key, 0.0) + c * factor
        if not above:
            self._known_terms[leaf] = total
        return total

    @cached_property
    def functions(self) -> dict[str, InitialFunction]:
        """The functions of time, as far back as they are asked for."""
        wanted = [self.target, *(dynamic.block.input for dynamic in self.dynamic_blocks.values())]
        asked = [key for name in wanted for key in self.delayed_terms(name)]
        out = {}
        for name, past in self.pasts.items():
            if not callable(past):
                continue
            back = max([sigma for leaf, _, sigma in asked if leaf == name], default=Fraction(0))
            order = max([k for leaf, k, _ in asked if leaf == name], default=0)
            if order and not back:
                back = GLIMPSE
            if name in self.dynamic_blocks and self.dynamic_blocks[name].numbers.order > 1:
                back = max(back, self.dynamic_blocks[name].time_constant)
            sample = partial(_sampled, name, past)
            value = float(sample(np.zeros(1))[0])
            out[name] = initial_function.approximate(
                sample, value, back, f"the history of {quoted(name)}"
            )
            _check_slope(name, order, out[name])
        return out

    def value_at_zero(self, leaf: str) -> float:
        """The value at 0 of an input or of a dynamic block's output."""
        function = self.functions.get(leaf)
        return self.constants[leaf] if function is None else function.at_zero

    # From 0 on -----------------------------------------------------------------------------
    def continuation(self, name: str) -> Signal:
        """A signal as its past alone carries it on: leaves keep the value that they had at 0."""
        total: Signal = Step(self.constant(name))
        for (leaf, k, sigma), c in self.delayed_terms(name).items():
            if sigma:
                total = total + DelayedInitialFunction(self.functions[leaf].slope(k), sigma, c)
            elif not k:
                total = total + c * Step(self.value_at_zero(leaf))
        return total

    def carried_on(self, name: str, t: Array, side: str) -> Array:
        """The same at times t ≥ 0 (s), (len(t), 1); the left limit at 0 is the past itself."""
        seen = beside(t, side, max(float(t.max()), 1e-12))
        total = np.full(t.shape, self.constant(name))
        for (leaf, k, sigma), c in self.delayed_terms(name).items():
            delay_s = float(sigma)
            total = total + c * self.functions[leaf].slope(k)(t - delay_s, seen - delay_s)
        return total[:, None]


def at_zero(side: Mapping[tuple[int, Fraction], float]) -> float:
    """A polynomial's value at s = 0, where all delays are 1; rounding is taken as 0."""
    terms = [c for (k, _), c in side.items() if not k]
    total = sum(terms)
    return total if abs(total) > 1e-14 * sum(map(abs, terms)) else 0.0


def _fixed_point(gains: Array, fed: Array, names: list[str]) -> Array:
    """v = gains · v + fed; without loops by putting in, which rounds least."""
    if not on_cycles(gains).any():
        value = fed
        for _ in names:
            value = gains @ value + fed
        return value
    if not fed.any():
        return fed
    loop = np.eye(len(names)) - gains
    if np.linalg.cond(loop) > 1e12:
        raise InputError(
            f"response: with this history the loop without dynamics through {', '.join(names)} "
            "has no steady state; give its inputs no past."
        )
    return np.asarray(np.linalg.solve(loop, fed))


def checked(history: object, diagram: Wiring) -> dict[str, Past]:
    """The history by names that exist, with numbers as floats."""
    if not isinstance(history, Mapping):
        raise InputError(
            f"response: history = {quoted(history)} names no signals; give a mapping like "
            "{'y': 1.0} of names to numbers or functions of t ≤ 0."
        )
    out: dict[str, Past] = {}
    for name, value in history.items():
        if name not in diagram.signals:
            raise InputError(
                f"response: history names {quoted(name)}, but there is no such signal"
                f"{nearest(name, diagram.signals)}; the diagram has {', '.join(diagram.signals)}."
            )
        if isinstance(value, Signal) or not (callable(value) or is_finite(value)):
            kind = "a signal, which is zero before 0" if isinstance(value, Signal) else "unusable"
            raise InputError(
                f"response: history of {quoted(name)} = {quoted(value)} is {kind}; give a finite "
                "number or a "
                "function of an array of times t ≤ 0."
            )
        out[name] = value if callable(value) else float(value)
    return out


def _sampled(name: str, past: Callable[[Array], Any], t: Array) -> Array:
    """A function of time at times t, checked."""
    try:
        values = np.asarray(past(t.copy()))
    except (TypeError, ValueError) as error:
        raise InputError(
            f"response: history of {quoted(name)} cannot be called with an array of times "
            f"({error}); "
            "write it with NumPy's functions."
        ) from error
    if values.dtype.kind not in "iuf" or values.shape != t.shape:
        raise InputError(
            f"response: history of {quoted(name)} returns {values.dtype} of shape {values.shape} "
            "for "
            f"times of shape {t.shape}; return one real number a time."
        )
    lost = np.flatnonzero(~np.isfinite(values))
    if len(lost):
        raise InputError(
            f"response: history of {quoted(name)} is {values[lost[0]]} at t = {t[lost[0]]:.6g} "
            "s; give "
            "a function that is finite as far back as the delays ask for."
        )
    return values.astype(float)


def _check_slope(name: str, order: int, function: InitialFunction) -> None:
    """Refuse a past that would have to be differentiated where it is not smooth."""
    ends = [*function.kinks, Fraction(0)]
    jump = max((abs(function.jumps(end, 1)[0]) for end in ends), default=0.0)
    if order > 1 or (order and jump):
        why = "is differentiated twice" if order > 1 else "jumps and is differentiated"
        raise InputError(
            f"response: history of {quoted(name)} {why} on its way; give a number, or move the "
            "differentiation into a block with dynamics."
        )
