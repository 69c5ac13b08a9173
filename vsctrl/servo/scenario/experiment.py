"""The tables that every experiment has: camera, target, start, law and vision.

What an experiment may add to these is in ``options``.
"""

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from vsctrl.checks import is_number
from vsctrl.problems import Problem, show
from vsctrl.servo.control.law import Interaction
from vsctrl.servo.features.feature_sets import MEASURES
from vsctrl.servo.scenario import fields
from vsctrl.servo.scenario.tables import Table
from vsctrl.servo.scenario.types import (
    CHOICE,
    MaybePair,
    MaybePositive,
    Nonnegative,
    Number,
    Points,
    Positive,
    Seconds,
    Share,
    Twist,
    Vector3,
    Whole,
)
from vsctrl.servo.timing import Placement

Scheme = Literal["image", "pose"]
Depth = Literal["true", "constant", "estimated"]


def _no_distance(value: object) -> object:
    if is_number(value):
        raise ValueError(
            f"{show(value)} is a number where a word belongs, true, constant or estimated; "
            "how far the target is follows from start.position, a depth that the law has wrong is "
            "law.depth_ratio"
        )
    return value


class CameraTable(Table):
    """[camera]: the true lens and image."""

    heading = "camera"
    Fx: Positive = Field(description="focal length along x, px")
    Fy: Positive = Field(description="focal length along y, px")
    size_px: MaybePair = Field(
        None, description="width and height of the image about the principal point, px"
    )
    k1: Number = Field(
        0.0, description="radial distortion, unknown to the law: X becomes X (1 + k1 (x² + y²))"
    )


class TargetTable(Table):
    """[target]: points of the object frame, and how that frame moves."""

    heading = "target"
    points: Points = Field(description="x, y, z of each point in the object frame, m")
    drift: Twist = Field(
        (0.0,) * 6, description="twist of the target in its own frame, m/s and rad/s"
    )
    sway: MaybePositive = Field(
        None, description="period in which the target swings to and fro, s; drift is its greatest"
    )


class StartTable(Table):
    """[start]: pose of the reference at t = 0, and where the camera really is then."""

    heading = "start"
    position: Vector3 = Field(description="camera in the object frame, m")
    euler_xyz_deg: Vector3 = Field(description="intrinsic XYZ angles of the camera, degrees")
    offset: Twist = Field(
        (0.0,) * 6, description="twist from the reference start to the true start, m and rad"
    )


class LawTable(Table):
    """[law]: the control law (10)."""

    heading = "law"
    lam: Positive = Field(description="gain λ, 1/s")
    k_ff: Number = Field(1.0, description="feed-forward gain: 1 the paper's law, 0 without")
    interaction: Annotated[Interaction, CHOICE] = Field(
        "current", description="L at: current, desired, mean or initial"
    )
    placement: Annotated[Placement, CHOICE] = Field(
        "measurement", description="where the latency acts: measurement, aligned or actuator"
    )
    depth_ratio: Positive = Field(1.0, description="depth used by the law over the true depth")
    scheme: Annotated[Scheme, CHOICE] = Field(
        "image", description="what is servoed: the image, or the pose found from it"
    )
    features: Annotated[str, BeforeValidator(fields.choice(*MEASURES))] = Field(
        "points",
        description=f"of the image: {', '.join(MEASURES)}",
        json_schema_extra={"enum": list(MEASURES)},
    )
    depth: Annotated[Depth, CHOICE, BeforeValidator(_no_distance)] = Field(
        "true", description="in L: true, constant (that at the start) or estimated from motion"
    )
    lam_zero: MaybePositive = Field(
        None, description="gain at no error, 1/s: falls to lam with the error (adaptive gain)"
    )
    lam_slope: MaybePositive = Field(
        None,
        description="how fast it falls at no error, 1/s per unit of the greatest |e|, px for "
        "points; that of ViSP is per m and rad of L⁺e, and no number for here",
    )
    smooth: MaybePositive = Field(
        None, description="rate at which the first error e(0) is let in, 1/s (smooth start)"
    )
    T_i: MaybePositive = Field(
        None, description="time of the integral action λ(1 + 1/(T_i s)), s; left out: none"
    )
    preview: Seconds = Field(0.0, description="how early the whole reference is used, s")
    preview_ff: Seconds = Field(0.0, description="how early its derivative alone is used, s")

    def problems(self) -> Iterator[Problem]:
        """Half an adaptive gain, and one that rises with the error."""
        given = {name: getattr(self, name) for name in ("lam_zero", "lam_slope")}
        missing = [name for name, value in given.items() if value is None]
        if len(missing) == 1:
            yield (
                missing[0],
                "missing; the adaptive gain needs lam_zero and lam_slope, give both or none",
            )
        elif self.lam_zero is not None and self.lam_zero <= self.lam:
            yield (
                "lam_zero",
                f"{self.lam_zero:g} is not above lam = {self.lam:g}, to which the gain falls as "
                "the error grows; exchange them",
            )


class VisionTable(Table):
    """[vision]: timing and noise of the measurement."""

    heading = "vision"
    period: Positive = Field(description="video period, s")
    latency: Seconds = Field(
        description="age of a measurement when it is used, s, any number of periods"
    )
    jitter: Seconds = Field(
        0.0,
        description="standard deviation of that age, s; ages below 0 are cut to 0, which raises "
        "their mean where jitter is not small beside the latency",
    )
    missed: Share = Field(0.0, description="share of frames without a new measurement")
    noise_px: Nonnegative = Field(0.0, description="standard deviation per image coordinate, px")
    quantum_px: Nonnegative = Field(0.0, description="coordinates are rounded to this, px")
    outliers: Share = Field(0.0, description="share of points that are mismatched in an image")
    outlier_px: Nonnegative = Field(20.0, description="standard deviation of a mismatch, px")
    seed: Whole = Field(0, description="seed of all that is random")
