"""A camera that really moves: poses by the matrix exponential, rates by finite differences."""

import numpy as np
from scipy.linalg import expm

COLUMNS = ("Vx", "Vy", "Vz", "Wx", "Wy", "Wz")


def displacement(column, h):
    """The 4×4 matrix exp(−hat h) that takes coordinates before into those after, for one twist."""
    V, W = np.split(np.eye(6)[column], 2)
    hat = np.zeros((4, 4))
    hat[:3, :3] = np.cross(np.eye(3), W)  # row i is e_i × W, so this is the matrix of W ×
    hat[:3, 3] = V
    return expm(-hat * h)


def moved(points, column, h):
    """The points (..., 3) after the camera has moved for h along one unit twist, exp(−hat h) p."""
    cTo = displacement(column, h)
    return points @ cTo[:3, :3].T + cTo[:3, 3]


def turned(directions, column, h):
    """The directions (..., 3) after the same motion: they turn and do not move."""
    return directions @ displacement(column, h)[:3, :3].T


def reframed(poses, column, h):
    """The poses (..., 4, 4) of still frames in the camera after the same motion."""
    return displacement(column, h) @ poses


def finite_difference(function, points, column, h=1e-3, move=moved, period=None):
    """Central differences, extrapolated once: error h⁴ = 1e-12 times a fifth derivative.

    ``period`` has the period of every component of the function, 0 for those without.
    """

    def central(step):
        ahead = function(move(points, column, step))
        behind = function(move(points, column, -step))
        return difference(ahead, behind, period) / (2 * step)

    return (4 * central(h / 2) - central(h)) / 3


def difference(s, s_star, period=None):
    """e = s − s*, with the components that have a period p taken into [−p/2, p/2]."""
    e = s - s_star
    if period is None:
        return e
    p = np.reshape(period, (-1,) + (1,) * (e.ndim - 1))
    return e - p * np.round(e / np.where(p == 0, np.inf, p))
