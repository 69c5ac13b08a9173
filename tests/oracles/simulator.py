"""Plain and slow: the loop with everything that can be wrong in it, written straight from the text.

It shares nothing with the package: the interaction matrix is the complex-step derivative of the
projection along each twist (exact to rounding, no formula of L anywhere), the rate of the planned
image one along the reference's, and the pseudo-inverse is formed outright. A camera is a list of
stretches of time in each of which its twist is known; any past pose is found by going along them
again (SciPy's expm, or solve_ivp where a drive accelerates or lags).
"""

from functools import cache
from itertools import pairwise

import numpy as np
from oracles.se3 import carried, hat, log
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

H = 1e-30  # of a complex step: its square is nothing
TIGHT = {"rtol": 1e-12, "atol": 1e-13, "method": "DOP853"}


def start_pose(scenario):
    """Where the scenario starts, as a pose of the camera in the frame of the target."""
    oTc = np.eye(4)
    angles = scenario.start.euler_xyz_deg
    oTc[:3, :3] = Rotation.from_euler("XYZ", angles, degrees=True).as_matrix()
    oTc[:3, 3] = scenario.start.position
    return oTc


def screw(scenario):
    """Time → pose and twist of a constant twist."""
    T = np.array([*scenario.motion.V, *scenario.motion.Omega])
    return lambda t: (start_pose(scenario) @ expm(hat(T) * t), T)


def lens(F, k1, p):
    """Image of points of the camera frame (n, 3), as a lens shows it; complex p are welcome."""
    x = p[:, :2] / p[:, 2:]
    return (F * x * (1 + k1 * (x[:, :1] ** 2 + x[:, 1:] ** 2))).ravel()


def unlens(F, k1, image):
    """x/z and y/z of each point of an image: r (1 + k1 r²) = r_d solved as a cubic."""
    out = []
    for x in image.reshape(-1, 2) / F:
        r_d = np.hypot(*x)
        roots = np.roots([k1, 0.0, 1.0, -r_d]) if k1 else np.array([r_d])
        real = roots[np.abs(roots.imag) < 1e-9].real
        out.append(x * (real[np.argmin(np.abs(real - r_d))] / r_d if r_d else 1.0))
    return np.array(out)


def interaction(F, image, Z):
    p = np.column_stack([image.reshape(-1, 2) / F * Z[:, None], Z])
    columns = [lens(F, 0.0, p + 1j * H * (-T[:3] - np.cross(T[3:], p))).imag / H for T in np.eye(6)]
    return np.stack(columns, axis=1)


class Planner:
    """s*(t), its depths and derivative, as the [reference_image] table has it."""

    def __init__(self, scenario, motion):
        table, camera = scenario.reference_image, scenario.camera
        true_F = np.array([camera.Fx, camera.Fy])
        self.F = table.reference_focal_ratio * true_F
        self.k1 = camera.k1 if table.reference_k1 is None else table.reference_k1
        self.c = np.tile(table.reference_centre_px, len(scenario.target.points))
        self.hand = expm(hat(np.array(table.reference_hand_eye)))
        self.motion, self.start = motion, motion(0.0)[0]
        p = seen(scenario, self.start)
        image = lens(true_F, camera.k1, p) + self.c
        Z = table.reference_depth_ratio * p[:, 2:]
        self.points = np.column_stack([unlens(self.F, self.k1, image) * Z, Z])

    def image(self, t, step=0.0):
        """The image at time t, and a complex step of the motion beyond."""
        pose, T = self.motion(t)
        moved = np.linalg.inv(self.start) @ pose @ expm(hat(T) * 1j * step)
        moved = np.linalg.inv(self.hand) @ moved @ self.hand
        back = np.linalg.inv(moved)
        p = self.points @ back[:3, :3].T + back[:3, 3]
        return lens(self.F, self.k1, p) - self.c

    def s(self, t):
        return np.real(self.image(t))

    def rate(self, t):
        return self.image(t, H).imag / H

    def pose(self, t):
        moved = np.linalg.inv(self.start) @ self.motion(t)[0]
        return self.start @ np.linalg.inv(self.hand) @ moved @ self.hand

    def twist(self, t):
        return carried(np.linalg.inv(self.hand), self.motion(t)[1])


def seen(scenario, oTc):
    P = np.array(scenario.target.points)
    return (P - oTc[:3, 3]) @ oTc[:3, :3]


class Camera:
    """wTc(t): stretches (begin, pose, twist there, aim of the drives, the command in force)."""

    def __init__(self, scenario, start):
        robot = scenario.robot
        self.limits = robot.speed_limit or np.inf, robot.rate_limit or np.inf
        self.a = robot.acceleration_limit or np.inf
        self.alpha = robot.angular_acceleration_limit or np.inf
        self.tau = robot.time_constant
        self.plain = not self.tau and np.isinf([self.a, self.alpha]).all()
        z = np.zeros(6)
        self.stretches = [(0.0, start, z, z, z)]
        self.scaled = [(0.0, False)]  # (from when, whether what arrives then is held back)

    def arrive(self, t, T):
        """From time t on this twist is wanted."""
        pose, twist, aim = self.state(t)
        share = min(
            1.0,
            *(
                limit / size if (size := np.linalg.norm(part)) > limit else 1.0
                for limit, part in zip(self.limits, (T[:3], T[3:]), strict=True)
            ),
        )
        T = share * T
        self.scaled.append((t, share < 1))
        if self.plain:
            twist = aim = T
        self.stretches.append((t, pose, twist, aim, T))

    def held(self, t0, t1):
        """Whether anything that was in force between two times was held back, or is not set yet."""
        aim, wanted = self.state(t1)[2], self.stretches[-1][4]
        if not np.allclose(aim, wanted, atol=1e-11):
            return True
        ends = [*(begin for begin, _ in self.scaled), np.inf][1:]
        return any(
            scaled and begin < t1 - 1e-9 and end > t0 + 1e-9
            for (begin, scaled), end in zip(self.scaled, ends, strict=True)
        )

    def state(self, t):
        """Pose, twist and aim at a time."""
        begin, pose, twist, aim, T = [s for s in self.stretches if s[0] <= t + 1e-12][-1]
        out = self._along(pose, twist, aim, T, t - begin)
        return out[:3]

    def integral(self, t0, t1):
        """∫ T dt over a time."""
        times = sorted({t0, t1, *(s[0] for s in self.stretches if t0 < s[0] < t1)})
        total = np.zeros(6)
        for a, b in pairwise(times):
            _, pose, twist, aim, T = [s for s in self.stretches if s[0] <= a + 1e-12][-1]
            begin = [s[0] for s in self.stretches if s[0] <= a + 1e-12][-1]
            total += self._along(pose, twist, aim, T, b - begin)[3]
            total -= self._along(pose, twist, aim, T, a - begin)[3]
        return total

    def _along(self, pose, twist, aim, T, h):
        if h <= 1e-14:
            return pose, twist, aim, np.zeros(6)
        if self.plain:
            return pose @ expm(hat(T) * h), T, T, h * T
        change = T - aim
        needed = max(np.linalg.norm(change[:3]) / self.a, np.linalg.norm(change[3:]) / self.alpha)
        ramp, total = min(h, needed), np.zeros(6)
        if ramp > 0:
            slope = change / needed
            pose, twist, aim, total = self._drive(pose, twist, aim, slope, ramp)
        if h - ramp > 1e-14:
            aim = T
            pose, twist, aim, more = self._drive(pose, twist, aim, np.zeros(6), h - ramp)
            total = total + more
        return pose, twist, aim, total

    def _drive(self, pose, twist, aim, slope, span):
        """Under an aim that moves by a constant slope; the axes lag behind it."""

        def rates(t, y):
            set_value = aim + slope * t
            now = y[16:22] if self.tau else set_value
            lag = (set_value - now) / self.tau if self.tau else np.zeros(6)
            return np.concatenate([(y[:16].reshape(4, 4) @ hat(now)).ravel(), lag, now])

        y = np.concatenate([pose.ravel(), twist, np.zeros(6)])
        y = solve_ivp(rates, (0.0, span), y, **TIGHT).y[:, -1]
        end = aim + slope * span
        return y[:16].reshape(4, 4), y[16:22] if self.tau else end, end, y[22:]


def run(scenario, motion=None):  # noqa: C901 - one frame after the other, in one place
    """Columns (pose in the object, lag, true error, measured error, command, mean twist)."""
    motion = cache(motion or screw(scenario))  # one along a path integrates from the start
    Ts, law, vision = scenario.vision.period, scenario.law, scenario.vision
    N, p = int(scenario.motion.duration / Ts + 1e-6), len(scenario.target.points)
    t = np.arange(N + 1) * Ts
    tau = vision.latency
    F, k1 = np.array([scenario.camera.Fx, scenario.camera.Fy]), scenario.camera.k1
    plan = Planner(scenario, motion)
    camera = Camera(scenario, start_pose(scenario) @ expm(hat(np.array(scenario.start.offset))))

    # What is random, each kind from its own stream.
    noise = vision.noise_px * np.random.default_rng(vision.seed).standard_normal((N + 1, 2 * p))
    stream = np.random.default_rng([vision.seed, 3])
    wrong = stream.random((N + 1, p)) < vision.outliers
    moved = vision.outlier_px * stream.standard_normal((N + 1, p, 2))
    noise += (moved * wrong[:, :, None]).reshape(N + 1, 2 * p)
    jitter = vision.jitter * np.random.default_rng([vision.seed, 1]).standard_normal(N + 1)
    missed = np.random.default_rng([vision.seed, 2]).random(N + 1) < vision.missed

    image_age = 0.0 if law.placement == "actuator" else tau
    late = scenario.robot.dead_time + (tau if law.placement == "actuator" else 0.0)
    drift, P = np.array(scenario.target.drift), scenario.target.sway

    def pose_in_object(time):
        g = time if P is None else P / (2 * np.pi) * np.sin(2 * np.pi * time / P)
        return np.linalg.inv(expm(hat(drift) * g)) @ camera.state(time)[0]

    def look(time):
        q = seen(scenario, pose_in_object(time))
        return lens(F, k1, q), q[:, 2]

    belief = scenario.calibration
    F_hat = belief.focal_ratio * F
    c = np.tile(belief.centre_px, p)
    rho = law.depth_ratio * np.array(belief.depth_ratios or np.ones(p))
    hand = expm(hat(np.array(belief.hand_eye)))
    constant = seen(scenario, motion(0.0)[0])[:, 2]
    half = None if scenario.camera.size_px is None else np.array(scenario.camera.size_px) / 2
    tau_hat = scenario.predictor.tau_hat
    if tau_hat is None:
        tau_hat = tau + scenario.robot.dead_time

    frames, commands, first, summed = [], [], None, np.zeros(6)
    exposed, shown, L_first, number = 0.0, None, None, 0
    for k in range(N + 1):
        # 1. The image that is shown.
        taken = max(t[k] - max(image_age + jitter[k], 0.0), 0.0)
        if k == 0 or not vision.jitter:
            number = max(int(np.ceil(k - image_age / Ts - 1e-6)), 0)
        elif taken > exposed:
            number = k
        exposed = max(exposed, taken)
        if k == 0 or not missed[k]:
            image, Z = look(exposed)
            visible = np.ones(p, bool)
            if half is not None:
                visible = (np.abs(image.reshape(-1, 2)) <= half).all(axis=1)
            image = image + noise[number]
            if vision.quantum_px:
                image = vision.quantum_px * np.round(image / vision.quantum_px)
            if shown is not None:
                image = np.where(np.repeat(visible, 2), image, shown[0])
            shown = image, Z, visible, pose_in_object(exposed)
        image, Z, visible, found = shown

        # 2. The reference that it is compared with.
        at_error = (max(t[k] - tau, 0.0) if law.placement == "aligned" else t[k]) + law.preview
        at_rate = t[k] + law.preview + law.preview_ff

        # 3. The law.
        if law.scheme == "image":
            known = constant if law.depth == "constant" else Z
            s_star = plan.s(at_error)
            Z_star = seen(scenario, motion(at_error)[0])[:, 2]
            Z_star = constant if law.depth == "constant" else Z_star
            current = interaction(F_hat, image + c, rho * known)
            desired = interaction(F_hat, s_star + c, rho * Z_star)
            L_first = current if L_first is None else L_first
            choices = {"current": current, "desired": desired, "initial": L_first}
            choices["mean"] = (current + desired) / 2
            L = choices[law.interaction]
            if scenario.predictor.predictor == "smith":
                for j, T in enumerate(commands):  # each acted from t_j to t_j+1
                    acted = min(t[j] + Ts, t[k]) - max(t[j], t[k] - tau_hat)
                    if acted > 1e-9 * Ts:
                        image = image + L @ T * acted
            e = image - s_star
        else:
            away = np.linalg.inv(plan.pose(at_error)) @ found
            e = np.concatenate([away[:3, :3].T @ away[:3, 3], log(away)[3:]])
        held = camera.held(t[k] - Ts, t[k])
        first = e if first is None else first
        used = e if law.smooth is None else e - first * np.exp(-law.smooth * t[k])
        rows = np.repeat(visible, 2)
        if law.T_i is not None and not held:
            pulled = np.linalg.pinv(L[rows]) @ used[rows] if law.scheme == "image" else used
            summed = summed + pulled * Ts
        integral = 0.0 if law.T_i is None else summed / law.T_i
        lam = law.lam
        if law.lam_zero is not None:
            span = law.lam_zero - lam
            lam = span * np.exp(-law.lam_slope / span * np.abs(e).max()) + lam
        if law.scheme == "image":
            demand = law.k_ff * plan.rate(at_rate) - lam * used
            T = np.linalg.pinv(L[rows]) @ demand[rows] - lam * integral
        else:
            forward = law.k_ff * carried(np.linalg.inv(away), plan.twist(at_rate))
            T = forward - lam * (used + integral)
        commands.append(T)

        # 4. The motion.
        pose = pose_in_object(t[k])
        q = seen(scenario, pose)
        frames.append(
            [pose, log(np.linalg.inv(motion(t[k])[0]) @ pose), lens(F, k1, q) - plan.s(t[k]), e, T]
        )
        arrivals = [(t[j] + late, j) for j in range(k + 1)]
        for when, j in arrivals:
            if t[k] - 1e-9 * Ts <= when < t[k] + Ts * (1 - 1e-9):
                camera.arrive(max(when, t[k]), carried(hand, commands[j]))
        frames[-1].append(camera.integral(t[k], t[k] + Ts) / Ts)
    return [np.array(column) for column in zip(*frames, strict=True)]
