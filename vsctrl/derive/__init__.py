"""What can be proved: motion, features, interaction matrices and references, in SymPy only."""

from vsctrl.derive.camera import NORMALISED, PIXELS, Camera
from vsctrl.derive.emit import emit, emit_servo_kernels
from vsctrl.derive.features import Feature
from vsctrl.derive.interaction import interaction_matrix
from vsctrl.derive.motion import point_motion, rotation, rotation_about, skew
from vsctrl.derive.points import Point
from vsctrl.derive.references import (
    Reference,
    reference,
    rotation_reference,
    translation_reference,
)

__all__ = [
    "NORMALISED",
    "PIXELS",
    "Camera",
    "Feature",
    "Point",
    "Reference",
    "emit",
    "emit_servo_kernels",
    "interaction_matrix",
    "point_motion",
    "reference",
    "rotation",
    "rotation_about",
    "rotation_reference",
    "skew",
    "translation_reference",
]
