"""What is solved and compiled once for a wiring: gains in symbols, coefficients, channels."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, cached_property, partial
from typing import Any

import sympy as sp

from vsctrl.diagram.symbolic import evaluation, order_at_zero, transfer_function
from vsctrl.diagram.symbolic.coefficients import Coefficients
from vsctrl.diagram.symbolic.transfer_function import Solved


class Model(Solved):
    """A wiring with its loop equations, in symbols and compiled."""

    def transfer(self, source: str, target: str) -> sp.Expr:
        """The exact transfer function from one signal to another, delays kept as exp(−τ s).

        `source` is an input of the diagram; `target` any signal.
        """
        self.check_channel(source, target)
        return self._formula(source, target)

    @cached_property
    def _formula(self) -> Callable[[str, str], sp.Expr]:
        return cache(partial(transfer_function.expression, self))

    @cached_property
    def coefficients(self) -> Coefficients:
        """The compiled list of every block's coefficients and every delay."""
        return Coefficients(self)

    @cached_property
    def evaluator(self) -> Callable[[str, str], Callable[..., Any]]:
        """(source, target) → the compiled channel f(s, *parameters), kept once made."""
        return cache(partial(evaluation.evaluator, self))

    @cached_property
    def pole_free_evaluator(self) -> Callable[..., Callable[..., Any]]:
        """(source, target, modules) → the channel's numerator and denominator, kept once made."""
        return cache(partial(evaluation.pole_free_evaluator, self))

    @cached_property
    def terms(self) -> Callable[[str, str], tuple[order_at_zero.Terms, order_at_zero.Terms]]:
        """(source, target) → the terms of the channel's N and Δ, kept once made."""

        def both(source: str, target: str) -> tuple[order_at_zero.Terms, order_at_zero.Terms]:
            num, den = self.gains.channel(source, target)
            letters = self.gains.letters
            return order_at_zero.terms(num, letters), order_at_zero.terms(den, letters)

        return cache(both)
