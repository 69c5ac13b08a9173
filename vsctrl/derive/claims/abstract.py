"""Abstract: that any motion of the camera combines a rotation and a translation."""

from vsctrl.derive.claims.claim import Evidence, claim
from vsctrl.derive.claims.equations_11_to_14 import V, r, r_tilde
from vsctrl.derive.claims.equations_15_to_17 import axis_motion
from vsctrl.symbols import omega


@claim(
    "abstract",
    "abstract",
    "any trajectories can be depicted as a combination of rotation and translation",
    status="holds",
)
def screws() -> Evidence:
    """Of each instant (Mozzi and Chasles): any V is −ω r̃ d + (r·V) r with d = r̃ V/ω, a turn about
    an axis at d and a slide along it, for ω ≠ 0; for ω = 0 it is the translation V."""
    arm = r_tilde * V / omega
    return Evidence(printed=[V - (axis_motion(arm) + r.dot(V) * r), r.dot(arm)])
