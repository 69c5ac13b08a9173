"""One linear system of python-control as parts: blocks for channels, integrators for states.

A state space of several inputs and outputs shares its states between its channels, and a block for
each channel would hold a copy of them all: an unstable one would run away from its copies. So
states become integrators, joined by gains, wherever more than one input or output sees them or a
transfer function would hide one.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import sympy as sp
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from vsctrl.checks import decimal, quoted
from vsctrl.diagram.description import control_systems
from vsctrl.diagram.description.blocks import Block, Part, Sum
from vsctrl.errors import InputError
from vsctrl.symbols import s

MOST_STATES = 100  #: that become integrators
MOST_IN_A_BLOCK = 12  #: states, whose characteristic polynomial is worked out exactly

Weights = dict[str, float]  #: signal → its factor in a sum


def weights_of(terms: Iterable[tuple[Mapping[str, float], float]]) -> Weights:
    """The weighted sum of weighted sums, without those that cancel."""
    out: Weights = {}
    for weights, factor in terms:
        for name, weight in weights.items() if factor else ():
            out[name] = out.get(name, 0.0) + float(factor) * weight
    return {name: weight for name, weight in out.items() if weight}


@dataclass
class Builder:
    """Parts as they come, and the names that are taken."""

    control: Any
    parts: list[Part] = field(default_factory=list)
    signals: set[str] = field(default_factory=set)
    blocks: set[str] = field(default_factory=set)

    def signal(self, label: str) -> str:
        """A name of its own for a signal, as near to the label as one can be."""
        name = re.sub(r"\W+", "_", str(label)).strip("_") or "x"
        return _own(name if name.isidentifier() else f"x_{name}", self.signals, "_")

    def block(self, name: str, expr: Any, source: str, target: str) -> None:
        """A block with a name of its own."""
        called = _own(name.strip() or "block", self.blocks, " ")
        self.parts.append(Block(called, expr, f"{source} -> {target}"))

    def total(self, weights: Mapping[str, float], target: str, name: str) -> None:
        """A signal as a weighted sum of others: a sum, and gains for weights other than ±1."""
        terms = []
        for signal, weight in (weights or {target: 0.0}).items():
            if abs(weight) == 1:
                terms.append(f"{'-' if weight < 0 else '+'} {signal}")
            elif len(weights) <= 1:
                self.block(name, _exact(weight, name), signal, target)
                return
            else:
                scaled = self.signal(f"{target}_of_{signal}")
                self.block(f"{name}: {signal}", _exact(weight, name), signal, scaled)
                terms.append(f"+ {scaled}")
        self.parts.append(Sum(f"{target} = {' '.join(terms).removeprefix('+ ')}"))

    def as_signal(self, weights: Weights, wanted: str) -> str:
        """The name of the signal that is the weighted sum, a new one where there is none yet."""
        name = self.signal(wanted)
        self.total(weights, name, name)
        return name

    def source(self, weights: Weights, wanted: str) -> str:
        """The signal itself where the weighted sum is one, else a new one."""
        if list(weights.values()) == [1.0]:
            return next(iter(weights))
        return self.as_signal(weights, wanted)

    def subsystem(
        self, system: Any, sources: Sequence[Weights], outputs: Sequence[str], name: str
    ) -> None:
        """The parts of a system from its inputs, weighted sums of signals, to named outputs.

        Errors: `InputError` for a system that is not linear or in discrete time.
        """
        linear = isinstance(system, self.control.TransferFunction | self.control.StateSpace)
        if not linear:
            raise InputError(
                f"from_control: {quoted(name)} is a {type(system).__name__}, which is not linear; "
                "give a TransferFunction or a StateSpace, as control.linearize makes one."
            )
        if system.dt:
            raise InputError(
                f"from_control: {quoted(name)} is in discrete time, dt = {system.dt}; give a "
                "system in "
                "continuous time and sample the diagram with at(…).sampled(…)."
            )
        labels = [f"{name}_{label}" for label in system.input_labels]
        if isinstance(system, self.control.TransferFunction):
            self._channels(system, sources, outputs, name, labels)
        elif not system.nstates:
            for row, output in zip(system.D, outputs, strict=True):
                self._static(weights_of(zip(sources, row, strict=True)), output, name)
        else:
            inputs = [self.source(w, label) for w, label in zip(sources, labels, strict=True)]
            self._states(system, inputs, outputs, name)

    def _static(self, weights: Weights, output: str, name: str) -> None:
        """A gain or a summing junction; a plain sum of several signals needs no block."""
        if len(weights) == 1:
            ((signal, weight),) = weights.items()
            self.block(name, _exact(weight, name), signal, output)
        else:
            self.total(weights, output, name)

    def _channels(
        self,
        system: Any,
        sources: Sequence[Weights],
        outputs: Sequence[str],
        name: str,
        labels: Sequence[str],
    ) -> None:
        inputs = [self.source(w, label) for w, label in zip(sources, labels, strict=True)]
        for i, output in enumerate(outputs):
            live = [j for j in range(system.ninputs) if np.any(system.num[i][j])]
            terms: Weights = {}
            for j in live:
                alone = system.ninputs == system.noutputs == 1
                called = name if alone else f"{name}: {system.input_labels[j]} to {output}"
                target = output if len(live) == 1 else self.signal(f"{output}_of_{inputs[j]}")
                sides = ([_exact(c, called) for c in x[i][j]] for x in (system.num, system.den))
                above, below = (sp.Poly(side, s).as_expr() for side in sides)
                self.block(called, above / below, inputs[j], target)
                terms[target] = 1.0
            if len(live) != 1:
                self.total(terms, output, f"{name}: {output}")

    def _states(
        self, system: Any, inputs: Sequence[str], outputs: Sequence[str], name: str
    ) -> None:
        """States in groups that do not see each other; a group of one channel may be a block."""
        each: list[Weights] = [{u: 1.0} for u in inputs]
        terms = [weights_of(zip(each, row, strict=True)) for row in system.D]
        count, group = connected_components(csr_array(system.A != 0), directed=False)
        for k in range(count):
            of = np.flatnonzero(group == k)
            A, B, C = system.A[np.ix_(of, of)], system.B[of], system.C[:, of]
            (ins,), (outs,) = B.any(axis=0).nonzero(), C.any(axis=1).nonzero()
            expr = None
            if len(ins) == len(outs) == 1 and len(of) <= MOST_IN_A_BLOCK:
                expr = self._whole(A, B[:, ins], C[outs], name)
            if expr is None:
                self._integrators(system, of, inputs, terms, name)
                continue
            i, j = int(outs[0]), int(ins[0])
            if count == system.ninputs == system.noutputs == 1:
                self.block(name, expr + _exact(system.D[0, 0], name), inputs[j], outputs[i])
                return
            target = self.signal(f"{outputs[i]}_of_{inputs[j]}")
            self.block(f"{name}: {inputs[j]} to {outputs[i]}", expr, inputs[j], target)
            terms[i] |= {target: 1.0}
        for output, weights in zip(outputs, terms, strict=True):
            self.total(weights, output, f"{name}: {output}")

    def _whole(self, A: Any, B: Any, C: Any, name: str) -> sp.Expr | None:
        """The transfer function of some states, None where it would hide one of them."""
        expr = control_systems.expression(self.control.ss(A, B, C, 0), name)
        below = sp.fraction(sp.cancel(expr))[1]
        return expr if sp.degree(below, s) == len(A) else None

    def _integrators(
        self, system: Any, of: Any, inputs: Sequence[str], terms: list[Weights], name: str
    ) -> None:
        """x′ = Ax + Bu, one integrator a state; what no output shows is led to one by a gain 0."""
        if len(of) > MOST_STATES:
            raise InputError(
                f"from_control: {quoted(name)} shares {len(of)} states between its channels, and "
                "at most "
                f"{MOST_STATES} become integrators; reduce it or give its channels apart."
            )
        labels = {int(k): self.signal(f"{name}_{system.state_labels[k]}") for k in of}
        for k, x in labels.items():
            states = [({labels[int(j)]: 1.0}, system.A[k, j]) for j in of]
            driven = [({u: 1.0}, w) for u, w in zip(inputs, system.B[k], strict=True)]
            weights, rate = weights_of([*states, *driven]), self.signal(f"{x}_rate")
            self.total(weights or {x: 0.0}, rate, rate)
            self.block(x, 1 / s, rate, x)
            shown = False
            for row, shares in zip(system.C, terms, strict=True):
                if row[k]:
                    shares[x], shown = float(row[k]), True
            if not shown and not any(system.A[j, k] for j in of):
                terms[0][x] = 0.0


def _own(name: str, taken: set[str], between: str) -> str:
    """The name, or with a number behind it where it is taken; taken from now on."""
    own, number = name, 2
    while own in taken:
        own, number = f"{name}{between}{number}", number + 1
    taken.add(own)
    return own


def _exact(value: float, name: str) -> sp.Rational:
    return sp.Rational(decimal(f"from_control: {quoted(name)}", value))
