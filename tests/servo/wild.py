"""Random experiments: every key of every table is drawn, most of them seldom.

So a loop often lives long enough for the rare ones to meet; now and then a value lies at the very
edge of what can be typed. What is drawn need not be valid.
"""

import numpy as np

from vsctrl.servo.features.feature_sets import MEASURES


class Wild:
    """A seeded source of values, most of them plausible and some absurd."""

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)

    def chance(self, p):
        return bool(self.rng.random() < p)

    def one_of(self, *values):
        return values[int(self.rng.integers(len(values)))]

    def size(self, low, high):
        """A number above 0, even in its logarithm; one in thirty is at an end of what is typed."""
        if self.chance(1 / 30):
            return self.one_of(1e-9, 1e9, 1e-6, 1e6)
        return float(np.exp(self.rng.uniform(np.log(low), np.log(high))))

    def near(self, scale, n=3):
        """n numbers of about this size; one in fifty lists has an absurd one."""
        out = (scale * self.rng.uniform(-1, 1, n)).tolist()
        if self.chance(1 / 50):
            out[int(self.rng.integers(n))] = self.one_of(1e9, -1e9, 1e3, 1e-300)
        if self.chance(1 / 10):
            out = [value if self.chance(0.5) else 0.0 for value in out]
        return out

    def twist(self, v, w):
        return [*self.near(v), *self.near(w)]


def some(wild, p, **draws):
    """Each key with probability p, its value drawn only then."""
    return {name: draw() for name, draw in draws.items() if wild.chance(p)}


def points(wild):
    n = int(wild.rng.integers(3, 9))
    shape = wild.one_of("cloud", "cloud", "square", "square", "line", "same", "plane")
    if shape == "square":
        return [[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]]
    cloud = wild.rng.uniform(-0.2, 0.2, (n, 3))
    if shape == "line":
        cloud = np.outer(cloud[:, 0], cloud[0])
    elif shape == "same":
        cloud[:] = cloud[0]
    elif shape == "plane":
        cloud[:, 2] = 0.0
    return cloud.tolist()


def motion(wild, seconds, kinds=("screw", "hold", "rotation", "oscillation", "path", "linked")):
    kind = wild.one_of(*kinds)
    out = {"kind": kind}
    if kind not in ("path", "linked"):
        out["duration"] = seconds
    if kind == "screw":
        out |= {"V": wild.near(wild.size(1e-3, 1)), "Omega": wild.near(wild.size(1e-3, 1))}
    elif kind == "rotation":
        out |= {"axis": wild.near(1), "arm": wild.near(1), "speed": wild.near(1, 1)[0]}
    elif kind == "oscillation":
        out |= {"direction": wild.twist(1, wild.one_of(0.0, 1.0)), "amplitude": wild.size(1e-3, 1)}
        out[wild.one_of("cycle", "speed")] = wild.size(0.05, 5)
        out |= some(wild, 0.5, waveform=lambda: wild.one_of("sine", "triangle"))
    elif kind == "path":
        n = int(wild.rng.integers(1, 4))
        out["times"] = np.linspace(0, seconds, n + 1)[1:].tolist()
        out["positions"] = [wild.near(0.2) for _ in range(n)]
        out["angles_xyz_deg"] = [wild.near(30) for _ in range(n)]
        out["frame"] = "start"
        out |= some(wild, 0.5, ends=lambda: wild.one_of("rest", "free"))
    elif kind == "linked":
        n = int(wild.rng.integers(1, 4))
        out["parts"] = [motion(wild, seconds / n, kinds[:-1]) for _ in range(n)]
        out["blend"] = wild.one_of("none", "linear", "smooth")
        if out["blend"] != "none":
            out["max_acceleration"] = [wild.size(1, 100), wild.size(1, 100)]
            out |= some(
                wild, 0.3, from_rest=lambda: wild.chance(0.5), to_rest=lambda: wild.chance(0.5)
            )
    return out


def law(wild):
    pose = wild.chance(0.15)
    out = {"lam": wild.size(0.1, 60)}
    if pose:
        out["scheme"] = "pose"
    else:
        out |= some(
            wild,
            0.3,
            interaction=lambda: wild.one_of("current", "desired", "mean", "initial"),
            depth_ratio=lambda: wild.size(0.2, 5),
            depth=lambda: wild.one_of("true", "constant", "estimated"),
            features=lambda: wild.one_of(*MEASURES),
        )
    if wild.chance(0.15):
        out |= {"lam_zero": out["lam"] * wild.size(1.01, 20), "lam_slope": wild.size(1e-3, 100)}
    return out | some(
        wild,
        0.15,
        k_ff=lambda: wild.near(2, 1)[0],
        smooth=lambda: wild.size(0.1, 100),
        T_i=lambda: wild.size(1e-2, 100),
        preview=lambda: wild.size(1e-3, 0.3),
        preview_ff=lambda: wild.size(1e-3, 0.3),
    )


def robot(wild):
    out = some(
        wild,
        0.12,
        speed_limit=lambda: wild.size(1e-3, 1),
        rate_limit=lambda: wild.size(1e-3, 1),
        acceleration_limit=lambda: wild.size(1e-2, 10),
        angular_acceleration_limit=lambda: wild.size(1e-2, 10),
        time_constant=lambda: wild.size(1e-3, 0.5),
    )
    if wild.chance(0.15):
        joints = [-0.05, 0.0, 0.0, 0.0, 0.8, 0.0]
        if wild.chance(0.7):
            joints = np.add(joints, wild.twist(0.6, 0.8)).tolist()
        out |= {"carrier": "gantry", "joints": joints, "avoidance": wild.chance(0.5)}
    return out


def description(wild):
    """A whole experiment of 10 to 40 frames, not always a valid one."""
    period = wild.size(0.005, 0.1)
    seconds = period * int(wild.rng.integers(10, 41 if wild.chance(0.2) else 19))
    target = points(wild)
    where = wild.one_of("measurement", "measurement", "measurement", "aligned", "actuator")
    periods = wild.one_of(0.0, 1.0, 2.0, float(wild.rng.uniform(0, 4)), 7.3)
    out = {
        "name": wild.one_of("wild", "", "ξ — \"quoted\" \\ '''"),
        "sure": True,  # absurd values are the matter here
        "camera": {"Fx": wild.size(100, 2000), "Fy": wild.size(100, 2000)},
        "target": {"points": target},
        "start": {"position": [*wild.near(0.1, 2), -wild.size(0.4, 2)]},
        "motion": motion(wild, seconds),
        "law": law(wild) | {"placement": where},
        "vision": {"period": period, "latency": periods * period},
        "robot": robot(wild),
    }
    out["start"] |= {"euler_xyz_deg": wild.near(wild.one_of(0.0, 10.0, 20.0))}
    out["start"] |= some(wild, 0.5, offset=lambda: wild.twist(wild.size(1e-3, 0.5), 0.3))
    out["camera"] |= some(
        wild,
        0.2,
        size_px=lambda: [wild.size(100, 2000), wild.size(100, 2000)],
        k1=lambda: wild.near(wild.one_of(0.1, 1.0, 10.0), 1)[0],
    )
    if wild.chance(0.2):
        out["target"]["drift"] = wild.twist(0.3, 0.5)
        out["target"] |= some(wild, 0.5, sway=lambda: wild.size(0.1, 10))
    out["vision"] |= some(
        wild,
        0.15,
        jitter=lambda: wild.size(1e-4, 0.1),
        missed=lambda: float(wild.rng.random()),
        noise_px=lambda: wild.size(0.01, 100),
        quantum_px=lambda: wild.size(0.01, 1000),
        outliers=lambda: float(wild.rng.random()),
        outlier_px=lambda: wild.size(0.1, 1000),
        seed=lambda: int(wild.rng.integers(2**63)),
    )
    out["calibration"] = some(
        wild,
        0.1,
        focal_ratio=lambda: wild.size(0.3, 3),
        centre_px=lambda: wild.near(100, 2),
        hand_eye=lambda: wild.twist(0.1, 1),
    )
    if "scheme" not in out["law"]:
        out["calibration"] |= some(
            wild, 0.1, depth_ratios=lambda: [wild.size(0.3, 3) for _ in target]
        )
        if where == "measurement" and wild.chance(0.3):
            out["predictor"] = {"predictor": wild.one_of("smith", "velocity", "acceleration")}
            out["predictor"] |= some(
                wild,
                0.3,
                tau_hat=lambda: wild.size(1e-3, 0.5),
                process=lambda: wild.size(1, 1e4),
                measurement_px=lambda: wild.size(0.01, 100),
            )
    out["reference_image"] = some(
        wild,
        0.06,
        reference_depth_ratio=lambda: wild.size(0.3, 3),
        reference_focal_ratio=lambda: wild.size(0.3, 3),
        reference_centre_px=lambda: wild.near(100, 2),
        reference_k1=lambda: wild.near(1, 1)[0],
        reference_hand_eye=lambda: wild.twist(0.1, 1),
    )
    if where == "measurement":
        out["robot"] |= some(wild, 0.15, dead_time=lambda: wild.size(1e-3, 0.2))
    out["faults"] = {
        key: "continue"
        for key in ("on_behind", "on_lost", "on_rank_loss", "on_joint_limit")
        if wild.chance(0.6)
    }
    return out
