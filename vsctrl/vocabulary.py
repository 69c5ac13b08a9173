"""What things are called elsewhere, and by which name they go here.

People come with the words of other tools, ``fps``, ``gain``, ``delay``, which no spelling leads to
``period``, ``lam``, ``latency``. Words are compared without case, spaces and signs between them.
"""

from collections.abc import Container, Iterable, Mapping
from typing import NamedTuple

# One line a meaning: its names here, best first, and the words that are used for it. Names with a
# plus sign are given together.
_TABLE = """
lam K K_p: gain kp λ lambda proportional proportional_gain p_gain control_gain
k_ff: feedforward feed_forward ff kff derivative_term feedforward_gain
period T_s: ts dt sample_time sampling_time sampling_period sample_period frame_period video_period
period T_s: frame_time cycle_time sampling
latency tau theta: delay latency tau τ lag_time time_delay vision_delay image_delay pure_delay
dead_time theta tau latency: dead_time deadtime transport_delay θ
tau_hat: model_delay predicted_latency latency_hat tauhat smith_delay modelled_latency
dead_time: robot_delay actuator_delay command_delay
time_constant: actuator_lag robot_lag axis_lag lag
duration times: time t_end tend tfinal t_final seconds length run_time simulation_time total_time
V speed: speed velocity v vel linear_velocity translation
Omega speed: omega ω angular_velocity angular_speed w rot rotation_speed
Fx+Fy: f focal focal_length focal_px focallength fx_fy
size_px: size resolution image_size width height image_width image_height imagesize
k1: distortion radial_distortion lens_distortion
points: leds corners markers object target_points model_points
drift: target_velocity target_speed target_motion target_twist
position: start_position camera_position x0 translation_start xyz start distance range z
euler_xyz_deg: euler orientation angles rpy euler_deg euler_angles euler_xyz rotation_deg attitude
offset: initial_error initial_offset start_offset error0 e0
depth_ratio: depth_error z_ratio depth_scale depthratio
depth_ratio kappa: kappa κ ratio
focal_ratio: focal_error focal_scale
centre_px: principal_point cx cy center centre center_px optical_centre
hand_eye: extrinsics handeye_error camera_mount
interaction: jacobian interaction_matrix image_jacobian
features: feature_type feature primitives
predictor: filter kalman estimator prediction compensator
noise_px: noise sigma std noise_std pixel_noise image_noise
quantum_px: quantisation quantization rounding
missed: dropout dropouts dropped lost frame_loss loss
jitter: latency_jitter delay_jitter latency_std
seed: random_state rng random_seed
T_i: ti ki integral integral_time reset_time i_time
lam_zero: gain_zero lambda_zero λ_0 gain_at_zero
speed_limit: max_speed vmax v_max maximum_speed velocity_limit
rate_limit: max_rate omega_max wmax w_max angular_speed_limit
acceleration_limit: max_accel amax a_max accel_limit acceleration
joints: q q0 joint_positions
preview: look_ahead lookahead anticipation
kind: type motion_type
amplitude: a radius
cycle: oscillation_period motion_period
peak_sensitivity: ms max_sensitivity m_s robustness
phase_margin: pm
gain_margin: gm
damping: zeta ζ damping_ratio
overshoot: mp os
"""
_RATES = (
    "fps rate frame_rate framerate frames_per_second sample_rate sampling_rate hz frequency "
    "frame_frequency video_rate sampling_frequency fs"
)


class Meaning(NamedTuple):
    """The names that a word stands for, given together, and the value in their unit if it has
    another one; None where the value stays."""

    names: tuple[str, ...]
    value: float | None = None


def _plain(word: object) -> str:
    return "".join(c for c in str(word).casefold() if c.isalnum())


def _read() -> dict[str, list[tuple[str, ...]]]:
    found: dict[str, list[tuple[str, ...]]] = {}
    for line in _TABLE.strip().splitlines():
        here, _, elsewhere = line.partition(":")
        names = [tuple(name.split("+")) for name in here.split()]
        for word in elsewhere.split():
            found.setdefault(_plain(word), []).extend(names)
    return found


_MEANT: Mapping[str, list[tuple[str, ...]]] = _read()
_RATE = frozenset(map(_plain, _RATES.split()))


def meant(word: object, known: Container[str], value: object = None) -> Meaning | None:
    """Which of the known names a word of other tools means, None where it means none of them.

    value: what was given with it; of a rate per second, a time in ms and a switch it is converted,
    fps = 25 → period = 0.04.
    """
    number = float(value) if isinstance(value, int | float) else None
    for rate in ("period", "T_s"):
        if rate in known and _plain(word) in _RATE:
            return Meaning((rate,), 1 / number if number is not None and number > 0 else None)
    if str(word).casefold().endswith("_ms"):
        names = _first(str(word)[:-3], known)
        return Meaning(names, None if number is None else number / 1000) if names else None
    names = _first(word, known)
    return Meaning(names, number if isinstance(value, bool) else None) if names else None


def _first(word: object, known: Container[str]) -> tuple[str, ...]:
    """The first meaning of a word that is known, empty where none is."""
    if isinstance(word, str) and word in known:
        return (word,)
    choices: Iterable[tuple[str, ...]] = _MEANT.get(_plain(word), ())
    return next((names for names in choices if all(name in known for name in names)), ())
