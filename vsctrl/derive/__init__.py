"""What can be proved: motion, features, interaction matrices and references, in SymPy only."""

from vsctrl.derive.camera import NORMALISED, PIXELS, Camera
from vsctrl.derive.claims import Claim, Proof, ledger
from vsctrl.derive.contours import Ellipse, Line, Primitive
from vsctrl.derive.emit import emit, emit_servo_kernels
from vsctrl.derive.features import Feature
from vsctrl.derive.interaction import interaction_matrix
from vsctrl.derive.moments import (
    Area,
    CentredMoment,
    GravityCentre,
    Moment,
    Moments,
    NormalisedMoments,
    Orientation,
)
from vsctrl.derive.motion import point_motion, rotation, rotation_about, skew
from vsctrl.derive.numbers import evaluate
from vsctrl.derive.outlines import SeenCircle, SeenEllipse, SeenLine, SeenSphere
from vsctrl.derive.planes import plane_of
from vsctrl.derive.points import (
    Depth,
    LogDepth,
    Point,
    Point3D,
    PolarPoint,
    Segment,
    Sphere,
    VanishingPoint,
)
from vsctrl.derive.poses import PoseFeature, ThetaU, Translation
from vsctrl.derive.references import (
    Reference,
    reference,
    reference_along,
    rotation_reference,
    translation_reference,
)
from vsctrl.derive.sets import FeatureSet, copies, together

__all__ = [
    "NORMALISED",
    "PIXELS",
    "Area",
    "Camera",
    "CentredMoment",
    "Claim",
    "Depth",
    "Ellipse",
    "Feature",
    "FeatureSet",
    "GravityCentre",
    "Line",
    "LogDepth",
    "Moment",
    "Moments",
    "NormalisedMoments",
    "Orientation",
    "Point",
    "Point3D",
    "PolarPoint",
    "PoseFeature",
    "Primitive",
    "Proof",
    "Reference",
    "SeenCircle",
    "SeenEllipse",
    "SeenLine",
    "SeenSphere",
    "Segment",
    "Sphere",
    "ThetaU",
    "Translation",
    "VanishingPoint",
    "copies",
    "emit",
    "emit_servo_kernels",
    "evaluate",
    "interaction_matrix",
    "ledger",
    "plane_of",
    "point_motion",
    "reference",
    "reference_along",
    "rotation",
    "rotation_about",
    "rotation_reference",
    "skew",
    "together",
    "translation_reference",
]
