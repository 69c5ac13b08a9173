"""What Padé models make of a channel: their error over frequency, and how it falls with order."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from vsctrl.checks import is_whole, quoted
from vsctrl.diagram.channel import Channel
from vsctrl.errors import InputError
from vsctrl.report.plots.canvas import NOTEBOOK, Size, canvas, legend, plain, say
from vsctrl.report.plots.margin_words import short
from vsctrl.report.plots.style import GREY, SERIES

ORDERS = (1, 2, 3, 4, 6, 8)
DRAWN = 4  #: orders whose error is drawn over ω
POINTS = 300
LEAST = 1e-14  #: errors below are rounding


def pade(
    channel: Any,
    orders: Any = ORDERS,
    *,
    band: tuple[float, float] | None = None,
    ax: Any = None,
    size: Size = None,
) -> Figure:
    """The relative error of a channel's Padé models against its exact delays.

    ``pade(system["r", "y"])``: |model − H|/|H| over ω in rad/s of up to four orders, and the
    largest over the band against the order. orders: 1 to 40. band: (low, high), rad/s, as of
    `Channel.pade`. A `PadeModel` is drawn by itself. ax: two axes of yours. size: (width, height),
    inches. Returns the figure, with `caption` and `alt`.
    Errors: `InputError` for what is no channel, for orders that are none, and as of `Channel.pade`.

    >>> loop = vs.figure1.at(lam=2.5, tau=0.08, ell=1, ell_hat=1, k_ff=1)
    >>> figure = vs.plots.pade(loop.with_(k_ff=0)["S_ref", "S"])
    >>> figure.alt
    'Error of Padé models of S_ref to S over frequency and over order.'
    """
    models = _models(channel, orders, band)
    name = plain(models[0].exact.source), plain(models[0].exact.target)
    narrow = size is not None and np.size(size) == 2 and size[0] < 5
    shape = (2, 1) if narrow else (1, 2)
    with canvas(ax, size, (NOTEBOOK[0], 3.6), *shape) as (figure, (left, right)):
        low, high = models[0].band
        omega = np.geomspace(low or 1e-3 * high, high, POINTS)
        step = max(1, -(-len(models) // DRAWN))
        for i, model in enumerate(models[::step]):
            error = np.maximum(model.error(omega), LEAST)
            left.loglog(omega, error, color=SERIES[i % len(SERIES)], label=f"order {model.order}")
        left.set_title("error over frequency")
        left.set_xlabel("ω, rad/s")
        left.set_ylabel("relative error")
        left.set_xlim(omega[0], omega[-1])
        worst = [max(model.worst()[1], LEAST) for model in models]
        right.semilogy([sum(m.degrees) / 2 for m in models], worst, "o-", color=SERIES[0])
        right.axhline(0.01, color=GREY, linewidth=0.9, linestyle="--")
        right.set_title("largest error in the band, 1 % dashed")
        right.set_xlabel("order")
        right.xaxis.set_major_locator(MaxNLocator(6, integer=True))
        legend(figure, left, least=1)
        enough = next((m.order for m, e in zip(models, worst, strict=True) if e <= 0.01), None)
        words = f"Up to {short(high, ' rad/s')} "
        words += (
            f"order {enough} of these is the first within 1 % of the exact response."
            if enough is not None
            else f"no order of these comes within 1 %: {short(100 * min(worst), ' %')} are left."
        )
        about = f"Error of Padé models of {name[0]} to {name[1]} over frequency and over order."
        say(figure, left, "error over frequency", words, about)
    return figure


def _models(channel: Any, orders: Any, band: Any) -> list[Any]:
    module = sys.modules.get("vsctrl.diagram.pade.model")
    if module is not None and isinstance(channel, module.PadeModel):
        return [channel]
    if not isinstance(channel, Channel):
        raise InputError(
            f"pade: {quoted(channel)} is no channel; give system['r', 'y'] or system.open('y')."
        )
    try:
        every = list(orders)
    except TypeError:
        every = []
    if not every or not all(is_whole(order) for order in every):
        raise InputError(
            f"pade: orders = {quoted(orders)} is not usable; give a list like (1, 2, 4)."
        )
    return [channel.pade(int(order), band=band) for order in sorted(set(every))]
