"""Plain and slow: the sampled loop written straight from the text, one frame after the other.

It shares nothing with the package: SciPy's matrix exponential moves the camera, the projection is
its one line, the interaction matrix is the complex-step derivative of that line along each twist
(exact to rounding, no formula of L anywhere), and the pseudo-inverse is formed outright.
"""

from functools import cache

import numpy as np
from scipy.linalg import expm, logm
from scipy.spatial.transform import Rotation


def hat(T):
    vx, vy, vz, x, y, z = T
    return np.array([[0, -z, y, vx], [z, 0, -x, vy], [-y, x, 0, vz], [0, 0, 0, 0]])


def start_pose(scenario):
    oTc = np.eye(4)
    angles = scenario.start.euler_xyz_deg
    oTc[:3, :3] = Rotation.from_euler("XYZ", angles, degrees=True).as_matrix()
    oTc[:3, 3] = scenario.start.position
    return oTc


def see(scenario, oTc):
    """Points of the target in the camera frame, (n, 3)."""
    homogeneous = np.column_stack([scenario.target.points, np.ones(len(scenario.target.points))])
    return (np.linalg.inv(oTc) @ homogeneous.T).T[:, :3]


def project(scenario, p):
    F = np.array([scenario.camera.Fx, scenario.camera.Fy])
    return (F * p[:, :2] / p[:, 2:]).ravel()


def interaction(scenario, image, depths):
    """L of points with this image at these depths: how the image moves when p' = −V − Ω × p."""
    F = np.array([scenario.camera.Fx, scenario.camera.Fy])
    p = np.column_stack([image.reshape(-1, 2) / F * depths[:, None], depths])
    h = 1e-30
    columns = []
    for T in np.eye(6):
        dp = -T[:3] - np.cross(T[3:], p)
        columns.append(project(scenario, p + 1j * h * dp).imag / h)
    return np.stack(columns, axis=1)


def screw(scenario):
    """Time → pose and twist of a constant twist."""
    T = np.array([*scenario.motion.V, *scenario.motion.Omega])
    return lambda t: (start_pose(scenario) @ expm(hat(T) * t), T)


def run(scenario, motion=None):
    """Lists of (pose, lag, error, measured error, twist), one entry a frame.

    motion: time → pose and twist of the reference, a constant twist if None.
    """
    motion = motion or screw(scenario)
    Ts, N = scenario.vision.period, int(scenario.motion.duration / scenario.vision.period + 1e-6)
    d = round(scenario.vision.latency / Ts)
    law, rho = scenario.law, scenario.law.depth_ratio
    rng = np.random.default_rng(scenario.vision.seed)
    noise = scenario.vision.noise_px * rng.standard_normal((N + 1, 2 * len(scenario.target.points)))

    @cache
    def reference(k):
        pose, _ = motion(k * Ts)
        p = see(scenario, pose)
        return pose, project(scenario, p), p[:, 2]

    oTc = start_pose(scenario) @ expm(hat(np.array(scenario.start.offset)))
    images, depths, commands, frames = [], [], [], []
    for k in range(N + 1):
        pose_ref, s_ref, Z_ref = reference(k)
        p = see(scenario, oTc)
        s = project(scenario, p)
        images.append(s + noise[k])
        depths.append(p[:, 2])

        if law.placement == "actuator":
            m, (s_err, Z_err) = k, (s_ref, Z_ref)
        elif law.placement == "aligned":
            m, (_, s_err, Z_err) = max(0, k - d), reference(max(0, k - d))
        else:
            m, (s_err, Z_err) = max(0, k - d), (s_ref, Z_ref)
        e = images[m] - s_err

        if law.interaction == "initial":
            L_hat = interaction(scenario, images[0], rho * depths[0])
        else:
            L_current = interaction(scenario, images[m], rho * depths[m])
            L_desired = interaction(scenario, s_err, rho * Z_err)
            L_hat = {
                "current": L_current,
                "desired": L_desired,
                "mean": (L_current + L_desired) / 2,
            }[law.interaction]
        ds = interaction(scenario, s_ref, Z_ref) @ motion(k * Ts)[1]
        C = np.linalg.pinv(L_hat)
        commands.append(-law.lam * C @ e + law.k_ff * C @ ds)

        late = d if law.placement == "actuator" else 0
        twist = commands[k - late] if k >= late else np.zeros(6)
        xi = np.real(logm(np.linalg.inv(pose_ref) @ oTc))
        lag = np.array([*xi[:3, 3], xi[2, 1], xi[0, 2], xi[1, 0]])
        frames.append((oTc, lag, s - s_ref, e, twist))
        oTc = oTc @ expm(hat(twist) * Ts)
    return [np.array(column) for column in zip(*frames, strict=True)]
