"""A run as a moving picture: what the camera sees, and where it is.

The frame of the object is drawn as if it stood still, also where the target moves: everything
that counts is relative to it. The number of pictures does not grow with the run.
"""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]
from numpy.typing import NDArray
from PIL import Image

from vsctrl import files
from vsctrl.arrays import Array
from vsctrl.checks import is_whole, unusable
from vsctrl.errors import InputError
from vsctrl.report.plots.run import image_plane
from vsctrl.report.plots.style import EXACT, GREY, INK, STYLE, WITH, takes
from vsctrl.servo import Run
from vsctrl.tables import escaped, visible

#: Most pictures of an animation, and the least and greatest time that it plays, s.
MOST, SHORTEST, LONGEST = 100, 2.0, 10.0
#: What a GIF counts time in, s; readers slow down anything quicker than two of them.
TICK, QUICKEST = 0.01, 2
#: The camera is drawn this deep, as a share of the scene.
FRUSTUM = 0.16
#: A camera farther from its reference than this many scenes is not drawn.
AWAY = 1.0
#: Shades of every colour in a picture, from white.
SHADES = 40
#: Levels of red, green and blue that are told apart on the way to the shades.
LEVELS = 32


@dataclass(frozen=True, slots=True, repr=False)
class Animation:
    """A moving picture that a notebook plays: `gif`, the bytes of its file; `alt`, it in words."""

    gif: bytes
    alt: str

    def save(self, path: str | Path) -> None:
        """Write the GIF to exactly this path: all of it or nothing.

        Errors: `InputError` when the file cannot be written.
        """
        files.write(files.as_path("path", path), self.gif, "animation")

    def __repr__(self) -> str:
        """One line, whatever its size."""
        return f"<{self.alt} GIF of {len(self.gif) / 1000:.0f} kB>"

    def _repr_html_(self) -> str:
        data = base64.b64encode(self.gif).decode()
        return (
            f'<img src="data:image/gif;base64,{data}" alt="{escaped(self.alt)}" '
            'style="max-width:100%">'
        )


@takes(Run)
def animate(
    run: Run,
    path: str | Path | None = None,
    *,
    pictures: int = MOST,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> Animation:
    """The run as a GIF, what the camera sees and where it is; a notebook plays what is returned.

    path: the file to write it to, all of it or nothing. pictures: how many at most; the first and
    the last frame are among them. progress: is told how many are drawn, of how many. Errors:
    `InputError` for what is no run, fewer than two pictures, or an unwritable path.

    >>> run = vs.simulate(vs.paper.sliding().with_(duration=0.2))
    >>> animation = vs.animate(run)
    """
    if not is_whole(pictures):
        raise unusable("animate: pictures", pictures, "a whole number of 2 or more")
    if pictures < 2:
        raise InputError(f"pictures: {pictures} do not move; give 2 or more.")
    chosen, ticks = timing(run, pictures)
    with mpl.rc_context(STYLE):
        scene = _Scene.of(run)
        drawn = []
        for count, k in enumerate(chosen, start=1):
            scene.show(int(k))
            drawn.append(scene.picture())
            progress(count, len(chosen))
    out = io.BytesIO()
    drawn[0].save(
        out,
        format="GIF",
        save_all=True,
        append_images=drawn[1:],
        # The last picture stays for a while before the loop begins anew.
        duration=[round(1000 * TICK * n) for n in ticks],
        loop=0,
        disposal=1,
    )
    name = visible(run.scenario.name)
    alt = f"{name}: the image and the camera to t = {run.t[-1]:g} s, {run.status.kind}."
    animation = Animation(out.getvalue(), alt)
    if path is not None:
        animation.save(path)
    return animation


def timing(run: Run, pictures: int = MOST) -> tuple[Array, list[int]]:
    """Which frames are shown, and for how many hundredths of a second each.

    In the run's own time where that is bearable to watch, else faster or slower.
    """
    n = len(run.t)
    playing = min(max(float(run.t[-1]), SHORTEST), LONGEST)
    shown = min(n, pictures, math.floor(playing / (TICK * QUICKEST)))
    chosen = np.unique(np.round(np.linspace(0, n - 1, shown)).astype(int))
    # No step is shorter than a reader shows it, and none so long that nothing seems to happen.
    each = min(max(round(playing / TICK / max(1, len(chosen) - 1)), QUICKEST), 50)
    return chosen, [each] * (len(chosen) - 1) + [max(each, 100)]


@dataclass(frozen=True, slots=True, eq=False)
class _Scene:
    """The picture, what stays in it, and the parts that move."""

    run: Run
    figure: Figure
    speed: str
    depth: float
    size: Array
    far: Array
    moving: dict[str, Any]

    @classmethod
    def of(cls, run: Run) -> _Scene:
        figure = Figure(figsize=(9.6, 4.6), dpi=80, facecolor="white")
        FigureCanvasAgg(figure)
        image = figure.add_axes((0.085, 0.13, 0.375, 0.72))
        space = figure.add_axes((0.47, 0.01, 0.52, 0.88), projection="3d")
        assert isinstance(space, Axes3D)
        target = np.array(run.scenario.target.points)
        goal, path = run.reference_pose[:, :3, 3], run.pose[:, :3, 3]
        scene = np.concatenate([target, goal])
        extent = float(np.ptp(scene, axis=0).max())
        far = np.linalg.norm(path - goal, axis=1) > AWAY * extent
        image_plane(image, run, paths=False, within=~far)
        depth = FRUSTUM * extent
        half = _half_image(run)
        ends = np.concatenate([_corners(pose, depth, half) for pose in run.reference_pose[[0, -1]]])
        _space(space, np.concatenate([scene, path[~far], ends]))
        space.computed_zorder = False  # lines are drawn in the order that is written here
        space.plot(*_turned(goal), color=INK, linestyle="--", linewidth=0.9)
        space.plot(*_turned(target), "o", color=EXACT, markersize=5)
        moving = _image_parts(image) | {
            "title": figure.text(0.02, 0.955, "", ha="left", va="center", fontsize=10.5),
            "rays": space.plot([], [], [], color=GREY, linewidth=0.5, zorder=2)[0],
            "wanted": space.plot([], [], [], color=INK, linewidth=0.8, zorder=3)[0],
            "path": space.plot([], [], [], color=WITH, linewidth=1.8, zorder=4)[0],
            "camera": space.plot([], [], [], color=WITH, linewidth=1.6, zorder=5)[0],
        }
        names = ("camera", "wanted")
        space.legend(
            [moving[name] for name in names],
            ["camera", "reference"],
            loc="upper right",
            bbox_to_anchor=(1.0, 1.06),
            ncols=2,
        )
        _, ticks = timing(run)
        played = TICK * sum(ticks[:-1])
        ratio = float(run.t[-1]) / played if played else 1.0
        speed = "" if abs(ratio - 1) < 0.1 else f", shown {ratio:.2g} times as fast"
        return cls(run, figure, speed, depth, half, far, moving)

    def show(self, k: int) -> None:
        """Move everything to frame k."""
        run, parts = self.run, self.moving
        n = run.depths.shape[1]
        shown, goal = (e.reshape(-1, n, 2) for e in (run.features, run.reference))
        seen = np.where(run.visible[..., None], shown, np.nan)
        parts["seen"].set_data(*seen[k].T)
        parts["asked"].set_data(*goal[k].T)
        for name, every in (("trails", seen), ("asked trails", goal)):
            # One line for all points, broken between them.
            gap = np.full((1, n, 2), np.nan)
            parts[name].set_data(
                *np.concatenate([every[: k + 1], gap]).transpose(2, 1, 0).reshape(2, -1)
            )
        name = visible(run.scenario.name).replace("$", r"\$")
        name = name if len(name) <= 40 else name[:39] + "…"
        ends = k == len(run.t) - 1 and not run.status.complete
        words = f"   the run ends here: {run.status.kind}" if ends else ""
        parts["title"].set_text(f"{name}   t = {run.t[k]:.2f} s{self.speed}{words}")
        path = np.where(self.far[:, None], np.nan, run.pose[:, :3, 3])
        parts["path"].set_data_3d(*_turned(path[: k + 1]))
        wanted = _wires(run.reference_pose[k], self.depth, self.size)
        parts["wanted"].set_data_3d(*_turned(wanted))
        wires = _wires(run.pose[k], self.depth, self.size)
        rays = np.full((3 * n, 3), np.nan)
        rays[0::3], rays[1::3] = run.pose[k, :3, 3], np.array(run.scenario.target.points)
        rays[~np.repeat(run.visible[k], 3)] = np.nan
        hidden = np.nan if self.far[k] else 0.0
        parts["camera"].set_data_3d(*_turned(wires + hidden))
        parts["rays"].set_data_3d(*_turned(rays + hidden))

    def picture(self) -> Image.Image:
        """The figure as an image of few colours."""
        canvas = self.figure.canvas
        assert isinstance(canvas, FigureCanvasAgg)
        canvas.draw()  # type: ignore[no-untyped-call]
        seen = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
        level = seen[..., :3].astype(int) * (LEVELS - 1) // 255
        place, shades = _palette()
        out = Image.fromarray(place[level[..., 0], level[..., 1], level[..., 2]])
        out.putpalette(shades.ravel().tolist())
        return out


@cache
def _palette() -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """The shades of all colours that are drawn, the same for all pictures so that none flickers.

    Returns the number of the shade nearest to a colour of (red, green, blue) levels, (32, 32, 32),
    and the shades, (n, 3).
    """
    white = np.full(3, 255.0)
    ends = [np.array(to_rgb(colour)) * 255 for colour in (INK, WITH, EXACT, GREY)]
    pairs = [*((colour, white) for colour in ends), (ends[0], ends[1]), (ends[0], ends[2])]
    share = np.linspace(0, 1, SHADES)[:, None]
    shades = np.round(np.concatenate([a + share * (b - a) for a, b in pairs]))
    level = np.linspace(0, 255, LEVELS)
    place = np.empty((LEVELS,) * 3, dtype=np.uint8)
    for red in range(LEVELS):
        colours = np.stack(np.broadcast_arrays(level[red], level[:, None], level), axis=-1)
        place[red] = np.square(colours[..., None, :] - shades).sum(axis=-1).argmin(axis=-1)
    return place, shades.astype(np.uint8)


def _image_parts(axes: Axes) -> dict[str, Any]:
    """What moves in the image plane."""
    parts = {
        "trails": axes.plot([], [], color=WITH, linewidth=1.6, label="seen")[0],
        "asked trails": axes.plot(
            [], [], color=INK, linewidth=0.8, linestyle="--", label="reference"
        )[0],
        "asked": axes.plot([], [], "x", color=INK, markersize=7)[0],
        "seen": axes.plot([], [], "o", color=WITH, markersize=6)[0],
    }
    axes.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2, borderaxespad=0.1)
    return parts


def _half_image(run: Run) -> Array:
    """Half of the image over the focal length, (2,): tangents of the half angles of view."""
    camera = run.scenario.camera
    focal = np.array([camera.Fx, camera.Fy])
    if camera.size_px is not None:
        out: Array = np.array(camera.size_px) / 2 / focal
        return out
    # Without a size, what the reference asks to see.
    asked = np.abs(run.reference.reshape(-1, 2)).max(axis=0) / focal
    return np.clip(1.05 * asked, 0.1, 1.0)


def _corners(pose: Array, depth: float, half: Array) -> Array:
    """Centre and image corners of a camera in the object frame, (5, 3) in m."""
    # As large for a wide lens as for a narrow one.
    z = depth / max(1.0, float(half.max()))
    x, y = z * half
    local = np.array([[0, 0, 0], [-x, -y, z], [x, -y, z], [x, y, z], [-x, y, z]])
    out: Array = local @ pose[:3, :3].T + pose[:3, 3]
    return out


def _wires(pose: Array, depth: float, half: Array) -> Array:
    """The pyramid of view as one line."""
    return _corners(pose, depth, half)[[0, 1, 2, 0, 3, 4, 0, 3, 2, 1, 4]]


def _turned(points: Array) -> Array:
    """Axes of the picture from those of the object, (3, n): y of the object points downwards."""
    return 1e3 * points[:, [0, 2, 1]].T


def _space(axes: Axes3D, inside: Array) -> None:
    """Equal scales around everything, seen from behind the camera and above."""
    shown = _turned(inside)
    low, high = shown.min(axis=1), shown.max(axis=1)
    margin = 0.04 * float((high - low).max()) + 1e-3
    low, high = low - margin, high + margin
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(high[2], low[2]))
    axes.set_box_aspect(tuple(high - low), zoom=1.06)
    axes.view_init(elev=24, azim=-62)
    axes.set_xlabel("x, mm", labelpad=-2)
    axes.set_ylabel("z, mm", labelpad=0)
    axes.set_zlabel("y, mm", labelpad=-6)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(MaxNLocator(4 if axis is not axes.zaxis else 3))
        axis.pane.fill = False
    axes.tick_params(labelsize=7.5, pad=-1)
