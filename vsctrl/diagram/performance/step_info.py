"""The figures of a step response: exact extrema and crossings, between any samples."""

from __future__ import annotations

import math

from vsctrl.diagram.frequency.at_zero import dc_gain
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.performance.course import course
from vsctrl.diagram.performance.decay import decay
from vsctrl.diagram.performance.features import Pieces
from vsctrl.diagram.performance.step_figures import (
    StepInfo,
    farthest,
    figures,
    rise_parts,
    settling_band,
    unsettled,
)
from vsctrl.diagram.signals.elementary import Step
from vsctrl.errors import LimitError

SETTLED = 1e-6  #: of the largest value, to which the response must have come to its final value


def step_info(channel: NumericChannel, settling: object, rise: object) -> StepInfo:
    """See `Channel.step_info`."""
    band, parts = settling_band(settling), rise_parts(rise)
    system = channel.realisation
    known = decay(channel)
    final = dc_gain(channel)
    if known.rate <= 0:
        return unsettled(final, band, parts, known.sentence)
    pieces = Pieces.of(course(system, Step(), known), channel.sign)
    if abs(pieces.last[-1] - final) > SETTLED * max(farthest(pieces), abs(final)):
        raise LimitError(
            f"step_info: after {pieces.ends[-1]:.4g} s the response is at {pieces.last[-1]:.6g} "
            f"and not at its final value {final:.6g}; a mode that its poles do not show is left."
        )
    return figures(pieces, final, band, parts, math.isinf(known.rate))
