"""Features of points, of which all that is derived follows by the chain rule."""

from sympy import Symbol

from vsctrl.derive.camera import NORMALISED, Camera
from vsctrl.derive.features import Feature
from vsctrl.symbols import X, Y, x, y, z


def Point(camera: Camera = NORMALISED) -> Feature:
    """An image point s = (X, Y), normalised or as the camera reports it.

    Arguments X, Y (image point), z (depth, m) and the camera's parameters; behind a lens that
    distorts, X and Y stand for the undistorted normalised point. Source: eq. 15 with
    ``camera=PIXELS``; ViSP's vpFeaturePoint without.
    """
    image = camera.image(x / z, y / z)
    straight = all(k.is_zero for k in camera.distortion)
    measured = image if straight else (x / z, y / z)
    x_n, y_n = camera.normalised(X, Y) if straight else (X, Y)
    return Feature(
        name="point",
        expressions=image,
        points=((x, y, z),),
        parameters=camera.parameters,
        measures=((X, measured[0]), (Y, measured[1])),
        places=((x, x_n * z), (y, y_n * z)),
    )


def numbered(i: int) -> tuple[Symbol, Symbol, Symbol]:
    """Coordinates (x_i, y_i, z_i) of the i-th of several points, z_i > 0."""
    return (
        Symbol(f"x_{i}", real=True),
        Symbol(f"y_{i}", real=True),
        Symbol(f"z_{i}", positive=True),
    )
