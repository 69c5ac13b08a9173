"""Derived expressions as source code that runs without SymPy.

The package exists so that the simulator computes what was proved: its kernels are printed here,
committed, and checked to regenerate to the letter. ``source`` prints NumPy functions, ``c`` those
for C, ``mathematics`` what is read, ``kernels`` whole modules; ``python -m
vsctrl.derive.emit`` writes the simulator's module to standard output.
"""

from vsctrl.derive.emit.kernels import emit, emit_servo_kernels

__all__ = ["emit", "emit_servo_kernels"]
