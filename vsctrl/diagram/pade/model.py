"""A Padé model that knows what it stands for: a python-control system that shows its own error.

The error is that of the matrices as they are, rounding included, against the exact response:

    error(ω) = |model(jω) − H(jω)| / max(|H(jω)|, 1e-3 · median of |H| within half an octave of ω)

It is relative everywhere, also beside the pole of an integrator; only in a notch of H, where any
difference is large relative to nothing, is it measured against what lies around the notch. Where H
is 0 all around, the error is absolute.
"""

from __future__ import annotations

import copy
from typing import Any

import control
import numpy as np
from numpy.typing import ArrayLike

from vsctrl.arrays import Array, Complex
from vsctrl.checks import reals, unusable
from vsctrl.diagram.frequency.numeric_channel import NumericChannel
from vsctrl.diagram.pade.approximant import Degrees
from vsctrl.diagram.pade.band import checked_band
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.signals.elementary import Step
from vsctrl.diagram.time.response import checked_times, from_rest
from vsctrl.errors import InputError
from vsctrl.tables import plain

FLOOR = 1e-3  #: of the response around it, below which a notch is not followed
OCTAVE = 2.0 ** np.linspace(-0.5, 0.5, 17)
BESIDE = 1e-6  #: relative distance to a pole on the axis; nearer there is only rounding
FROM = 1e-4  #: of a band's end, where the scan of one from 0 begins
PER_DECADE = 50
MOST_POINTS = 4000
CHUNK = 2_000_000  #: complex numbers that are worked on at once


class PadeModel(control.StateSpace):
    """A channel whose delays are Padé models of one order: a `control.StateSpace` with its error.

    `degrees` are those of each delay's model, `exact` is the channel that it stands for, and its
    error is looked for over `band` (rad/s). Sums, products and loops made of it are plain state
    spaces.
    """

    def __init__(
        self,
        matrices: tuple[Array, Array, Array, Array],
        exact: NumericChannel,
        degrees: Degrees,
        band: tuple[float, float],
        **names: Any,
    ) -> None:
        super().__init__(*matrices, **names)
        self.degrees = degrees
        self.exact = exact
        self.band = band

    def __deepcopy__(self, memo: dict[int, Any]) -> PadeModel:
        """A copy with matrices and names of its own; the exact channel, which is frozen, is kept.

        python-control copies systems deeply, and a diagram need not be copied with each.
        """
        twin = type(self).__new__(type(self))
        memo |= {id(self): twin, id(self.exact): self.exact}
        twin.__setstate__(copy.deepcopy(self.__getstate__(), memo))
        return twin

    def __getstate__(self) -> dict[str, Any]:
        """All but the two functions that python-control makes of a system: they cannot travel."""
        return {k: v for k, v in vars(self).copy().items() if k not in ("updfcn", "outfcn")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        matrices = (state[letter] for letter in "ABCD")
        super().__init__(*matrices, name=state["name"])
        self.__dict__.update(state)

    @property
    def order(self) -> int | Degrees:
        """The order of each delay's model, or its degrees where these are not equal."""
        m, n = self.degrees
        return n if m == n else self.degrees

    @property
    def delays(self) -> tuple[float, ...]:
        """The delays that are modelled, in s, each once."""
        return tuple(sorted(set(self.exact.realisation.tau.tolist())))

    def values(self, s: ArrayLike) -> Complex:
        """The model at complex s (rad/s), any shape; as ``model(s)``, but all points at once."""
        points = np.asarray(s, complex)
        system = DelaySystem(self.A, self.B, self.C, self.D, ())
        parts = max(1, points.size * (self.nstates + 1) ** 2 // CHUNK)
        try:
            values = [system.transfer(x)[:, 0, 0] for x in np.array_split(points.ravel(), parts)]
        except np.linalg.LinAlgError:  # one of the points is a pole
            values = [np.atleast_1d(self(points.ravel(), squeeze=True, warn_infinite=False))]
        return np.concatenate(values).reshape(points.shape)

    def error(self, omega: ArrayLike) -> Array:
        """The relative error at each ω (rad/s), real and of the shape of `omega`.

        At ω = 0 and on a pole it is that a little beside.
        Errors: `InputError` for what is no finite frequency.
        """
        w = reals(omega)
        if w is None:
            raise unusable("error: omega", omega, "finite frequencies in rad/s")
        unit = self.band[1]
        w = np.where(w == 0, BESIDE * unit, w)
        with np.errstate(all="ignore"):
            exact = self.exact(1j * w)
            w = np.where(np.isfinite(exact), w, w * (1 + BESIDE))
            exact, around = self.exact(1j * w), np.abs(self.exact(1j * w[..., None] * OCTAVE))
            size = np.maximum(np.abs(exact), FLOOR * np.median(around, axis=-1))
            off = np.abs(self.values(1j * w) - exact)
            relative = off / np.where(size == 0, 1.0, size)
        return np.where(np.isnan(relative), np.inf, relative)

    def worst(self, band: tuple[float, float] | None = None) -> tuple[float, float]:
        """(ω, error): the largest relative error over a band (rad/s), and where it is.

        The band is scanned by 50 points a decade, by steps of 0.2 rad of the delays' turn, and
        round each resonance and notch of the model; the highest peaks seen are then halved down to
        where they are. A band from 0 is scanned from 1e-4 of its end: Padé models are exact at 0.
        """
        low, high = self.band if band is None else checked_band(self.exact, band)
        omega = self._scanned(low, high)
        error = self.error(omega)
        for _ in range(40):
            top = error.max()
            padded = np.concatenate([[-1.0], error, [-1.0]])
            peak = (error >= padded[:-2]) & (error >= padded[2:]) & (error >= top / 3)
            peak[np.argsort(error)[:-40]] = False
            gap = np.flatnonzero(peak[:-1] | peak[1:])
            gap = gap[np.diff(omega)[gap] > BESIDE * omega[gap]]
            if not len(gap):
                break
            middle = (omega[gap] + omega[gap + 1]) / 2
            new = self.error(middle)
            omega, error = np.insert(omega, gap + 1, middle), np.insert(error, gap + 1, new)
        best = int(error.argmax())
        return float(omega[best]), float(error[best])

    def roughly_worst(self) -> float:
        """The largest relative error at a few frequencies of the band: at most that of `worst`."""
        low, high = self.band
        omega = self._scanned(low, high)
        return float(self.error(omega[:: -max(1, len(omega) // 60)]).max())

    def step_error(self, t: ArrayLike) -> Array:
        """Step response of the model minus the exact one, at equally spaced times from 0 (s).

        Where the exact one jumps, its right limit counts.
        Errors: `InputError` for other times, and for a channel with no step response.
        """
        H, times = self.exact, checked_times(t)
        exact = H.sign * from_rest(H.system, H.source, H.target, Step(), times, "right")[:, 0]
        steps = np.diff(times)
        even = len(times) > 1 and steps[0] > 0 and np.ptp(steps) < 1e-6 * steps[0]
        if not even or times[0] != 0:
            raise InputError("step_error: t must be equally spaced times that begin at 0 s.")
        return np.asarray(control.forced_response(self, times, np.ones_like(times)).outputs - exact)

    @property
    def sentence(self) -> str:
        """What the model stands for and how far off it is over its band, in one line."""
        off = self.worst()[1]
        where = f"over {self.band[0]:g}…{self.band[1]:.4g} rad/s against the exact response"
        if not self.delays:
            return f"No delay: nothing is approximated; largest error {off:.1g} {where}"
        listed = ", ".join(f"{tau:g}" for tau in self.delays)
        several = "delays" if len(self.delays) > 1 else "a delay of"
        return f"Padé order {self.order} for {several} {listed} s; largest error {off:.1g} {where}"

    def data(self) -> dict[str, Any]:
        """Order, delays (s), band (rad/s) and largest error as JSON takes them."""
        frequency, error = self.worst()
        return {
            "order": plain(self.order),
            "delays": list(self.delays),
            "band": list(self.band),
            "worst_frequency": plain(frequency),
            "worst_error": plain(error),
        }

    def __str__(self) -> str:
        return f"{super().__str__()}\n\n{self.sentence}"

    def _repr_html_(self) -> str:
        # python-control writes no matrix that is too large to read, and then gives None.
        head = super()._repr_html_() or f"{self.name}: {self.nstates} states"
        return f"{head}\n<p>{self.sentence}</p>"

    def _scanned(self, low: float, high: float) -> Array:
        """Frequencies of a band that no peak of the error can hide between, by rising ω."""
        low = low or FROM * high
        delay_s = sum(self.exact.realisation.tau.tolist())
        turns = min(MOST_POINTS, 2 + int(5 * delay_s * (high - low)))
        decades = np.log10(high / low)
        zeros = np.asarray(self.zeros(), complex) if self.nstates else np.zeros(0, complex)
        features = np.concatenate([self.poles(), zeros[np.isfinite(zeros)]])
        # On the axis itself there is only rounding to compare.
        width = np.maximum(np.abs(features.real), BESIDE * np.abs(features))
        off_axis = features[np.abs(features.real) > BESIDE * np.abs(features)]
        every = np.concatenate(
            [
                np.geomspace(low, high, 8 + int(PER_DECADE * decades)),
                np.linspace(low, high, turns),
                *(np.abs(features.imag) + k * width for k in (-2.0, -1.0, -0.5, 0.5, 1.0, 2.0)),
                np.abs(off_axis.imag),
            ]
        )
        return np.unique(every[(every >= low) & (every <= high)])
