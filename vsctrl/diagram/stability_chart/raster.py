"""The regions of a stability chart: flooded between the exact boundaries, each with its count."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from vsctrl.arrays import Array
from vsctrl.errors import InputError


@dataclass(frozen=True)
class Regions:
    """A raster (height, width) of unstable roots, rows upwards from the lowest y, and its places.

    `places` are (x, y, count, share of the chart) of the point farthest inside each region.
    """

    unstable: Array
    places: tuple[tuple[float, float, float, float], ...]


def flood(
    x: Array, y: Array, counts: Array, boundaries: list[Array], width: int, height: int
) -> Regions:
    """Fill each part of the raster that no boundary cuts with the count of its grid corners.

    Errors: `InputError` for a raster of less than 2 or more than 4000 pixels a side.
    """
    if not (2 <= width <= 4000 and 2 <= height <= 4000):
        raise InputError(
            f"regions: {width} × {height} pixels are not usable; give 2 to 4000 each way."
        )
    low = np.array([x[0], y[0]])
    size = np.array([x[-1], y[-1]]) - low
    last = np.array([width - 1, height - 1])
    u, v = np.meshgrid(np.linspace(0, 1, width), np.linspace(0, 1, height))
    column = (u * (len(x) - 1)).round().astype(int)
    row = (v * (len(y) - 1)).round().astype(int)
    guess = counts[row, column]
    endless = np.isinf(guess)
    wall = np.zeros((height, width), bool)
    for points in boundaries:
        pixels = (points - low) / size * last
        # Points half a pixel apart touch corner to corner: no flood of four neighbours leaks.
        steps = np.maximum(np.ceil(2 * np.abs(np.diff(pixels, axis=0)).max(axis=1)), 1).astype(int)
        for a, b, n in zip(pixels[:-1], pixels[1:], steps, strict=True):
            i, j = (a + (b - a) * np.linspace(0, 1, n + 1)[:, None]).round().astype(int).T
            wall[np.clip(j, 0, height - 1), np.clip(i, 0, width - 1)] = True
    labels, number = ndimage.label(~wall & ~endless)
    corners = np.meshgrid(
        np.linspace(0, width - 1, len(x)).round().astype(int),
        np.linspace(0, height - 1, len(y)).round().astype(int),
    )
    at_corner = labels[corners[1], corners[0]]
    unstable = np.where(endless, np.inf, np.nan)
    for label in range(1, number + 1):
        inside = labels == label
        corner_counts = counts[at_corner == label]
        values, often = np.unique(
            corner_counts if len(corner_counts) else guess[inside], return_counts=True
        )
        unstable[inside] = values[np.argmax(often)]
    known = ~np.isnan(unstable)
    if known.any():
        nearest = ndimage.distance_transform_edt(
            ~known, return_distances=False, return_indices=True
        )
        unstable = unstable[tuple(nearest)]
    masks = [labels == label for label in range(1, number + 1)]
    masks += [endless] if endless.any() else []
    places = []
    for mask in masks:
        depth = ndimage.distance_transform_edt(np.pad(mask, 1))[1:-1, 1:-1]
        # Of the places about as deep inside, the one nearest the region's middle.
        deep = np.argwhere(depth >= 0.9 * depth.max())
        away = np.linalg.norm((deep - np.argwhere(mask).mean(axis=0)) / mask.shape, axis=1)
        j, i = deep[int(np.argmin(away))]
        u_, v_ = low + size * np.array([i, j]) / last
        places.append((float(u_), float(v_), float(unstable[j, i]), float(mask.mean())))
    return Regions(unstable, tuple(places))
