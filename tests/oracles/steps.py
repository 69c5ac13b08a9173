"""Figure 1 by the method of steps in mpmath: polynomials delay by delay, no series, no transform.

In the unit of time τ, without feed-forward, the error e = S − 1 after a unit step obeys
e′(t) = −x e(t − 1) with e = −1 up to t = 0, where x = κλτ.
"""

from functools import cache

import mpmath as mp

DIGITS = 45


@cache
def pieces(x: str, n: int) -> list[list[mp.mpf]]:
    """Coefficients, lowest first, of e on [k, k + 1] as a polynomial in t − k, k = 0 … n − 1."""
    with mp.workdps(DIGITS):
        gain, found, before = mp.mpf(x), [], [mp.mpf(-1)]
        start = mp.mpf(-1)
        for _ in range(n):
            piece = [start] + [-gain * c / (i + 1) for i, c in enumerate(before)]
            # Higher coefficients are xᵏ/k!: below 1e-48 they are nothing.
            while len(piece) > 1 and abs(piece[-1]) < mp.mpf(10) ** -48:
                piece.pop()
            found.append(piece)
            start, before = mp.fsum(piece), piece
        return found


def error(x: str, t: mp.mpf, n: int = 200) -> mp.mpf:
    """e(t) for 0 ≤ t < n."""
    with mp.workdps(DIGITS):
        k = int(mp.floor(t))
        return mp.polyval(pieces(x, n)[k][::-1], t - k)


def squared(x: str, n: int) -> mp.mpf:
    """∫ e² dt over n delays."""
    with mp.workdps(DIGITS):
        return mp.fsum(
            a * b / (i + j + 1)
            for piece in pieces(x, n)
            for i, a in enumerate(piece)
            for j, b in enumerate(piece)
        )


def extremes(x: str, n: int) -> list[mp.mpf]:
    """e where e′ = 0, in order: one delay after each zero of e."""
    with mp.workdps(DIGITS):
        found = []
        for k, piece in enumerate(pieces(x, n)[:-1]):
            ends = piece[0], mp.fsum(piece)
            if mp.sign(ends[0]) != mp.sign(ends[1]):
                zero = mp.findroot(
                    lambda t, piece=piece: mp.polyval(piece[::-1], t),
                    (0, 1), solver="anderson", tol=mp.mpf(10) ** -80,
                )  # fmt: skip
                found.append(error(x, k + 1 + zero, n))
        return found
