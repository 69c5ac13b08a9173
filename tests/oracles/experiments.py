"""Another simulator of the paper's experiments, which shares nothing with the package.

Lateral motion at constant depth is a scalar recursion; the rest is SciPy's matrix exponential, an
interaction matrix by finite differences, and the pseudo-inverse.
"""

import numpy as np
from oracles.se3 import hat
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

LAM, TAU, TS, V, F = 2.5, 0.08, 0.04, 0.04, 700.0
SIGNS = ((-1, -1), (1, -1), (1, 1), (-1, 1))
LEDS = np.array([(sx * 0.125, sy * 0.075, -0.125) for sx, sy in SIGNS])


def lateral(rate, frames, *, k_ff, lam=LAM, d=2, kappa=1.0, x0=0.0, aligned=False):
    """x_{k+1} = x_k + κTₛ(−λ(x_{k−d} − r_k) + k_ff r′_k): t, x − r, the command."""
    t = TS * np.arange(frames + 1)
    reference, slope = rate(t)
    x, command = np.empty(frames + 1), np.empty(frames + 1)
    x[0] = x0
    for k in range(frames + 1):
        late = max(0, k - d)
        error = x[late] - reference[late if aligned else k]
        command[k] = kappa * (-lam * error + k_ff * slope[k])
        if k < frames:
            x[k + 1] = x[k] + TS * command[k]
    return t, x - reference, command


def ramp(t):
    return V * t, np.full_like(t, V)


def triangle(t):
    phase = t / 15 - np.floor(t / 15)
    up = (phase < 0.25) | (phase >= 0.75)
    return np.interp(phase, [0, 0.25, 0.75, 1], [0, 0.15, -0.15, 0]), np.where(up, 0.04, -0.04)


def sine(t):
    return 0.15 * np.sin(2 * np.pi * t / 15), 0.3 * np.pi / 15 * np.cos(2 * np.pi * t / 15)


def pose(position, degrees):
    oTc = np.eye(4)
    oTc[:3, :3] = Rotation.from_euler("XYZ", degrees, degrees=True).as_matrix()
    oTc[:3, 3] = position
    return oTc


def depths(oTc):
    return ((LEDS - oTc[:3, 3]) @ oTc[:3, :3])[:, 2]


def image(oTc):
    p = (LEDS - oTc[:3, 3]) @ oTc[:3, :3]
    return (F * p[:, :2] / p[:, 2:]).ravel()


STEPS = [expm(1e-5 * hat(sign * axis)) for axis in np.eye(6) for sign in (1, -1)]


def interaction(oTc):
    """L by central differences along the six elementary motions: error 1e-10 of its entries."""
    seen = [image(oTc @ step) for step in STEPS]
    return np.stack([(seen[2 * j] - seen[2 * j + 1]) / 2e-5 for j in range(6)], axis=1)


def believed(oTc, ratios):
    """L̂ where depths are wrong by the factors `ratios`: its columns of translation go with 1/z."""
    L = interaction(oTc)
    factors = np.repeat(np.broadcast_to(ratios, len(LEDS)), 2)[:, None]
    return np.hstack([L[:, :3] / factors, L[:, 3:]])


def simulated(start, T, frames, *, k_ff, lam, offset=None, aligned=False, ratios=1):
    """The law (10) frame by frame, the image two frames late: poses, references, twists."""
    oTc = start @ expm(hat(np.zeros(6) if offset is None else np.array(offset)))
    references = [start @ expm(hat(np.asarray(T) * k * TS)) for k in range(frames + 1)]
    poses, twists = [], []
    for k, reference in enumerate(references):
        poses.append(oTc)
        late = max(0, k - 2)
        error = image(poses[late]) - image(references[late if aligned else k])
        rate = interaction(reference) @ T
        twist = np.linalg.pinv(believed(poses[late], ratios)) @ (k_ff * rate - lam * error)
        twists.append(twist)
        oTc = oTc @ expm(hat(twist * TS))
    return np.array(poses), np.array(references), np.array(twists)


ROTATION_START = pose((-0.154, 0.014, -0.811), (-0.9, -3.8, 0.0))
ROTATION_TWIST = np.array([-0.032, 0, 0, 0, 0.04, 0])
