"""What can be proved: motion, features, interaction matrices and references, in SymPy only."""

from vsctrl.derive.camera import NORMALISED, PIXELS, Camera
from vsctrl.derive.claims import Claim, Proof, ledger
from vsctrl.derive.emit import emit, emit_servo_kernels
from vsctrl.derive.evaluate import evaluate
from vsctrl.derive.features.curves import Ellipse, Line, Primitive
from vsctrl.derive.features.feature import Feature
from vsctrl.derive.features.moments import (
    Area,
    CentredMoment,
    GravityCentre,
    Moment,
    Moments,
    NormalisedMoments,
    Orientation,
    m,
    mu,
)
from vsctrl.derive.features.outlines import SeenCircle, SeenEllipse, SeenLine, SeenSphere
from vsctrl.derive.features.planes import plane_of
from vsctrl.derive.features.points import (
    Depth,
    LogDepth,
    Point,
    Point3D,
    PolarPoint,
    Segment,
    Sphere,
    VanishingPoint,
)
from vsctrl.derive.features.poses import PoseFeature, ThetaU, Translation
from vsctrl.derive.features.sets import FeatureSet, copies, together
from vsctrl.derive.kinematics.interaction import interaction_matrix
from vsctrl.derive.kinematics.motion import point_motion, rotation, rotation_about, skew
from vsctrl.derive.references.references import (
    Reference,
    reference,
    reference_along,
    rotation_reference,
    translation_reference,
)

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
    "m",
    "mu",
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


def __dir__() -> list[str]:
    return list(__all__)
