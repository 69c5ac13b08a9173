"""What of a scenario is not in its loop, because it is not linear or not constant, and why."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vsctrl.servo import Scenario

_VISION = {
    "jitter": "the age of the image varies",
    "missed": "some frames bring no new image",
    "noise_px": "noise moves the camera, but not the loop's stability",
    "quantum_px": "coordinates are rounded",
    "outliers": "points are mismatched at random",
}
_ROBOT = {
    "speed_limit": "a limit holds the camera back",
    "rate_limit": "a limit holds the camera back",
    "acceleration_limit": "a limit holds the camera back",
    "angular_acceleration_limit": "a limit holds the camera back",
    "joints": "joints have ends and speeds of their own",
    "avoidance": "joints slow the camera down before their ends",
}
_LAW = {
    "lam_zero": "the gain falls as the error grows; here it is that of no error",
    "smooth": "the first error is let in little by little",
}
_REFERENCE = "s*(t) leads elsewhere than the reference that the lag is measured from"


def left_out(scenario: Scenario) -> dict[str, str]:
    """Dotted key → why, of everything that the loop of `of` leaves out, in the file's order."""
    law, out = scenario.law, dict[str, str]()
    if scenario.camera.size_px is not None:
        out["camera.size_px"] = "points may leave the image"
    if any(scenario.target.drift) and scenario.target.sway is not None:
        out["target.sway"] = "the target swings to and fro, which leaves no steady error"
    if law.depth == "estimated":
        out["law.depth"] = "depths are estimated while the camera moves"
    out |= {f"law.{key}": why for key, why in _LAW.items() if getattr(law, key) is not None}
    out |= {f"vision.{key}": why for key, why in _VISION.items() if getattr(scenario.vision, key)}
    plain = type(scenario.reference_image)()
    for key, value in scenario.reference_image:
        if value != getattr(plain, key):
            out[f"reference_image.{key}"] = _REFERENCE
    for key, why in _ROBOT.items():
        if getattr(scenario.robot, key) not in (None, False):
            out[f"robot.{key}"] = why
    return out
