"""Random experiments in which all is linear: small, and with none of what limits or changes."""

import numpy as np

import vsctrl as vs

SIZE = 1e-6  # of offsets in m and rad, and of speeds: what is of second order is 1e-12


def random_scenario(rng, *, frames=150, **fixed):
    """An experiment with delays of any fraction, wrong beliefs and every compensation, at random.

    Its gain is that of a hundredth per frame; give it another one with ``with_(lam=…)``.
    """
    period = float(rng.choice([0.01, 0.04, 1 / 30]))
    fields = {
        "period": period, "lam": 0.01 / period, "duration": frames * period,
        "latency": float(rng.choice([0, 1, 2, 3, rng.uniform(0, 4)]) * period),
        "k_ff": float(rng.choice([0, 1, rng.uniform(0, 1.5)])),
        "interaction": str(rng.choice(["current", "desired", "mean", "initial"])),
        "offset": tuple(SIZE * rng.uniform(-1, 1, 6)),
    }  # fmt: skip
    if rng.random() < 0.3:
        fields |= {"kind": "hold"}
    else:
        fields |= {
            "V": tuple(SIZE * rng.uniform(-1, 1, 3)),
            "Omega": tuple(SIZE * rng.uniform(-1, 1, 3)),
        }
    fields |= _beliefs(rng) | _robot(rng, period)
    if fields.get("placement") is None:
        fields |= _predictor(rng, period, fields["latency"])
    if rng.random() < 0.3:
        fields["T_i"] = float(rng.uniform(20, 80) * period)
    if rng.random() < 0.3:
        fields["preview"] = float(rng.uniform(0, 3) * period)
    if rng.random() < 0.2:
        fields["preview_ff"] = float(rng.uniform(0, 3) * period)
    if rng.random() < 0.2:
        fields["drift"] = tuple(SIZE * rng.uniform(-1, 1, 6))
    return vs.paper.sliding().with_(**fields | fixed)


def _beliefs(rng):
    """What the law believes of camera, depths and hand."""
    out = {}
    if rng.random() < 0.4:
        out["depth_ratio"] = float(rng.uniform(0.7, 1.4))
    if rng.random() < 0.3:
        out["focal_ratio"] = float(rng.uniform(0.8, 1.25))
    if rng.random() < 0.2:
        out["depth_ratios"] = tuple(rng.uniform(0.8, 1.2, 4))
    if rng.random() < 0.2:
        out["centre_px"] = tuple(rng.uniform(-30, 30, 2))
    if rng.random() < 0.3:
        twist = np.concatenate([rng.uniform(-0.05, 0.05, 3), rng.uniform(-0.1, 0.1, 3)])
        out["hand_eye"] = tuple(twist)
    return out


def _robot(rng, period):
    out = {}
    if rng.random() < 0.25:
        return {"placement": str(rng.choice(["aligned", "actuator"]))}
    if rng.random() < 0.3:
        out["dead_time"] = float(rng.uniform(0, 3) * period)
    if rng.random() < 0.3:
        out["time_constant"] = float(rng.uniform(0.2, 5) * period)
    return out


def _predictor(rng, period, latency):
    kind = rng.choice(["none", "none", "smith", "velocity", "acceleration"])
    if kind == "none":
        return {}
    out = {"predictor": str(kind)}
    if rng.random() < 0.4:
        out["tau_hat"] = float(max(0.0, latency + rng.uniform(-1, 1) * period))
    if kind != "smith":
        out |= {
            "process": float(10 ** rng.uniform(0, 3)),
            "measurement_px": float(rng.uniform(0.1, 2)),
        }
    return out
