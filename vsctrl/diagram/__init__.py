"""One block diagram and all its faces: symbolic, frequency, roots, time, Padé, picture.

Numbers and pictures load on first use; making a diagram needs SymPy only.
"""

from vsctrl.diagram.description.blocks import Block, Sum
from vsctrl.diagram.diagram import Diagram
from vsctrl.diagram.document.applied import Applied
from vsctrl.diagram.document.keys import schema
from vsctrl.diagram.loop import Loop
from vsctrl.diagram.signals.elementary import Exponential, Parabola, Pulse, Ramp, Sine, Step
from vsctrl.diagram.signals.samples import Samples
from vsctrl.diagram.signals.signal import Signal

__all__ = [
    "Applied",
    "Block",
    "Diagram",
    "Exponential",
    "Loop",
    "Parabola",
    "Pulse",
    "Ramp",
    "Samples",
    "Signal",
    "Sine",
    "Step",
    "Sum",
    "schema",
]
