"""One block diagram and all its faces: symbolic, frequency, roots, time, Padé, picture.

Numbers and pictures load on first use; making a diagram needs SymPy only.
"""

from vsctrl.diagram.blocks import Block, Sum
from vsctrl.diagram.diagram import Diagram
from vsctrl.diagram.exponential import Exponential
from vsctrl.diagram.samples import Samples
from vsctrl.diagram.signals import Parabola, Pulse, Ramp, Signal, Sine, Step

__all__ = [
    "Block",
    "Diagram",
    "Exponential",
    "Parabola",
    "Pulse",
    "Ramp",
    "Samples",
    "Signal",
    "Sine",
    "Step",
    "Sum",
]
