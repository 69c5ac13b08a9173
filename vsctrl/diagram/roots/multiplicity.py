"""Which roots are different, and how often each is one.

Newton's method arrives at a root from several starts. Two ends are one root if the discs that
rounding leaves open (`newton.resolution`) meet, and different ones otherwise, however near. How
many roots a disc holds is asked of the argument principle; of several, their power sums

    pₖ = (1/2πj) ∮ (s − c)ᵏ d log det M(s)

say where each is. They are one multiple root where all pₖ about their mean vanish to rounding: then
a change of the coefficients by their rounding makes them one, and nothing tells them apart.
Source: P. Kravanja, M. Van Barel, "Computing the Zeros of Analytic Functions", Springer 2000.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import connected_components

from vsctrl.arrays import Array, Complex
from vsctrl.diagram.realisation.delay_system import DelaySystem
from vsctrl.diagram.roots.newton import (
    NOISE,
    log_slope_and_doubt,
    polished,
    rate_of,
    resolution,
)

SAFE = 8.0  #: times ρ: the disc in which a root is, rounding being estimated only
ROUNDED = 40.0  #: times the doubt of det M: a power sum below it is rounding
DEEPEST = 3  #: how often what is told apart is looked at once more
LARGEST = 20  #: roots in one place


@dataclass(frozen=True)
class _Disc:
    """What one root, or several that are near each other, may be anywhere in."""

    centre: complex
    radius: float
    sharp: bool  #: Newton's method ended there, rather than only came near


def distinct(system: DelaySystem, ends: Complex, steps: Array, depth: int = 0) -> Complex:
    """The roots at which Newton's method ended, each as often as it is one; pairs are exact."""
    discs = _merged(_discs(system, ends.real + 1j * np.abs(ends.imag), steps))
    gaps = [_gap(disc, discs) for disc in discs]
    radii = [_least(system, disc, gap) for disc, gap in zip(discs, gaps, strict=True)]
    simple = _hold_one(system, np.array([disc.centre for disc in discs]), np.array(radii))
    rest, out = [], []
    for disc, one in zip(discs, simple, strict=True):
        if one and disc.sharp:
            out += _with_conjugate(disc.centre)
        else:
            rest.append(disc)
    while rest:
        disc = rest.pop(0)
        gap = _gap(disc, rest + [_Disc(z, 0.0, True) for z in out])
        radius = _least(system, disc, gap)
        counted = _sums(system, disc.centre, radius, 16, 1)
        if counted is None:
            # Rounding, or a root on the circle.
            grown = _absorbed(system, disc, rest, radius)
            if grown is not None:
                rest = grown
            elif disc.sharp:
                out += _with_conjugate(disc.centre)
            continue
        count = round(float(counted[0][0].real))
        if count == 1 and disc.sharp:
            out += _with_conjugate(disc.centre)
        elif 0 < count <= LARGEST:
            out += _several(system, disc, count, gap, depth)
        elif count > LARGEST:
            out += _with_conjugate(disc.centre) * count
    return np.array(out, complex)


def _hold_one(system: DelaySystem, centres: Complex, radii: Array) -> list[bool]:
    """Whether each circle is seen to hold one root and no more."""
    if not len(centres):
        return []
    turn = np.exp(2j * np.pi * (np.arange(16) + 0.5) / 16)
    radii = np.where(np.isfinite(radii), radii, 0.0)
    with np.errstate(all="ignore"):
        try:
            slope, doubt = log_slope_and_doubt(
                system, (centres[:, None] + radii[:, None] * turn).ravel()
            )
        except np.linalg.LinAlgError:
            return [False] * len(centres)
        count = (slope.reshape(-1, 16) * turn).mean(1) * radii
        return list((doubt.reshape(-1, 16).max(1) < NOISE) & (np.abs(count - 1) < 0.1))


def _discs(system: DelaySystem, z: Complex, steps: Array) -> list[_Disc]:
    rate, rho = rate_of(system), resolution(system, z)
    most = 0.05 * np.abs(z) + 1e-6 * rate
    sharp = (steps <= SAFE * rho) & (SAFE * rho < most)
    radius = np.minimum(SAFE * rho + np.where(sharp, 0.0, 10 * steps), most)
    radius = np.maximum(radius, 1e-30 * rate)
    if system.delays:
        radius = np.minimum(radius, 0.5 * rate)
    # One that only came near what another one reached says nothing.
    nearer = np.abs(z[:, None] - z[sharp]) <= radius[:, None] + radius[sharp]
    keep = sharp | ~nearer.any(1)
    out = []
    for k in np.flatnonzero(keep):
        centre, r = complex(z[k]), float(radius[k])
        out.append(_Disc(complex(centre.real) if abs(centre.imag) <= r else centre, r, sharp[k]))
    return out


def _merged(discs: list[_Disc]) -> list[_Disc]:
    """Discs that meet as one, about the member that is known best."""
    if not discs:
        return []
    z = np.array([d.centre for d in discs])
    r = np.array([d.radius for d in discs])
    meet = np.abs(z[:, None] - z) <= r[:, None] + r
    _, label = connected_components(meet, directed=False)
    out = []
    for group in range(label.max() + 1):
        members = np.flatnonzero(label == group)
        best = members[np.lexsort((r[members], np.array([not discs[k].sharp for k in members])))[0]]
        sharp = discs[best].sharp
        spread = float((np.abs(z[members] - z[best]) + r[members]).max())
        centre = complex(z[best])
        if abs(centre.imag) <= spread:
            spread += abs(centre.imag)
            centre = complex(centre.real)
        out.append(_Disc(centre, spread, sharp))
    return out


def _gap(disc: _Disc, others: list[_Disc]) -> float:
    """How far the nearest other disc is, those of conjugates counted."""
    centres = [other.centre for other in others if other.centre != disc.centre]
    mirrored = [c.conjugate() for c in [*centres, disc.centre] if c.imag]
    all_ = np.array([*centres, *mirrored], complex)
    return float(np.abs(all_ - disc.centre).min(initial=np.inf))


def _least(system: DelaySystem, disc: _Disc, gap: float) -> float:
    """The radius of a circle well round a disc and clear of the next."""
    wide = min(4 * disc.radius, _widest(system, disc.centre))
    return min(max(1.2 * disc.radius, wide), 0.5 * gap)


def _widest(system: DelaySystem, centre: complex) -> float:
    """The radius of the largest circle along which 64 points follow the argument."""
    rate = rate_of(system)
    size = 0.4 * max(abs(centre), rate)
    return min(size, 2 * rate) if system.delays else size


def _absorbed(
    system: DelaySystem, disc: _Disc, discs: list[_Disc], radius: float
) -> list[_Disc] | None:
    """The discs after one on whose edge the argument cannot be followed took in its neighbours."""
    reach = min(4 * max(radius, disc.radius), _widest(system, disc.centre))
    if not disc.radius < 0.7 * reach:
        return None
    return _merged([_Disc(disc.centre, reach, disc.sharp), *discs])


def _several(system: DelaySystem, disc: _Disc, count: int, gap: float, depth: int) -> list[complex]:
    """The roots in a disc that holds several: one multiple root, or each of them."""
    least = _least(system, disc, gap)
    most = max(min(0.4 * gap, _widest(system, disc.centre)), least)
    radii = [most / 3**k for k in range(int(np.log(most / least) / np.log(3)) + 1)]
    for radius in [*radii, least]:
        found = _sums(system, disc.centre, radius, 64, count)
        if found is not None and round(float(found[0][0].real)) == count:
            break
    else:
        return _with_conjugate(disc.centre) if disc.sharp else []
    centre = disc.centre + complex(found[0][1]) / count
    centre = centre if disc.centre.imag else complex(centre.real)
    about = _sums(system, centre, radius, 64, count)
    if about is None:
        return []
    sums, doubt = about
    k = np.arange(2, count + 1)
    if count > 1 and (np.abs(sums[2:]) <= ROUNDED * doubt * k * radius**k).all():
        return _with_conjugate(centre) * count
    return _told_apart(system, centre, radius, sums, depth)


def _told_apart(
    system: DelaySystem, centre: complex, radius: float, sums: Complex, depth: int
) -> list[complex]:
    """The roots of which these are the power sums, polished; as they are where that fails."""
    count = len(sums) - 1
    # Newton's identities: k eₖ = Σ (−1)^{i−1} e_{k−i} pᵢ.
    e = [1.0 + 0j]
    for k in range(1, count + 1):
        e.append(sum((-1) ** (i - 1) * e[k - i] * complex(sums[i]) for i in range(1, k + 1)) / k)
    seeds = centre + np.roots([(-1) ** k * value for k, value in enumerate(e)])
    if depth < DEEPEST:
        roots = distinct(system, *polished(system, np.asarray(seeds, complex)), depth + 1)
        far = 3 * float(np.abs(seeds - centre).max()) + 1e-300
        near = roots[np.minimum(np.abs(roots - centre), np.abs(roots.conj() - centre)) <= far]
        if centre.imag:
            near = near[near.imag > 0]
        if len(near) == count:
            return [z for root in near for z in (_with_conjugate(root) if centre.imag else [root])]
    if not (np.abs(seeds - centre) < radius).all():
        return []
    if centre.imag:
        return [z for seed in seeds for z in (seed, seed.conjugate())]
    return list(seeds)


def _sums(
    system: DelaySystem, centre: complex, radius: float, points: int, most: int
) -> tuple[Complex, float] | None:
    """The power sums p₀ … p_most of the roots in a circle about its centre, and the doubt of det M.

    None where a root is so near the circle, or rounding so large, that they say nothing.
    """
    if not 0 < radius < np.inf:
        return None
    turn = radius * np.exp(2j * np.pi * (np.arange(points) + 0.5) / points)
    with np.errstate(all="ignore"):
        try:
            slope, doubt = log_slope_and_doubt(system, centre + turn)
        except np.linalg.LinAlgError:
            return None
        weight = slope * turn / points
        total = weight.sum()
        if not doubt.max() < NOISE or not abs(total - np.round(total.real)) < 0.1:
            return None
    sums = np.asarray([(weight * turn**k).sum() for k in range(most + 1)])
    return sums, float(doubt.max())


def _with_conjugate(root: complex) -> list[complex]:
    root = complex(root)
    return [root, root.conjugate()] if root.imag else [root]
