"""Runs as xarray datasets, for work with labels: select, resample, compare, write as netCDF.

xarray is an optional companion (``pip install vsctrl[scale]``) and is loaded by a call only.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from importlib import metadata
from typing import TYPE_CHECKING, Any

from vsctrl.errors import InputError
from vsctrl.servo.results.columns import COLUMNS, TWIST, feature_names, measured_in_pixels, sizes
from vsctrl.servo.results.frames import Frames

if TYPE_CHECKING:
    import xarray


def dataset(run: Frames) -> xarray.Dataset:
    """Every array of a run with named dimensions, units and meanings.

    Raises InputError when xarray is not installed.
    """
    try:
        import xarray
    except ImportError:
        raise InputError(
            "to_xarray: the package xarray is not installed; install it with "
            "pip install 'vsctrl[scale]'."
        ) from None
    p = sizes(run.scenario)["point"]
    in_pixels = measured_in_pixels(run.scenario)
    names: dict[str, Any] = {
        "frame": range(len(run.t)),
        "component": list(TWIST),
        "feature": feature_names(p),
        "point": range(1, p + 1),
    }
    variables: dict[str, Any] = {}
    for name, column in COLUMNS.items():
        value = getattr(run, name)
        if value is None:
            continue
        dims, units = column.dims, column.units
        if name == "measured_error" and in_pixels and value.shape == run.features.shape:
            dims, units = ("frame", "feature"), "px"
        variables[name] = (dims, value, {"units": units, "description": column.meaning})
        if "joint" in dims:
            names["joint"] = range(1, 7)
    status = run.status
    return xarray.Dataset(
        {name: variable for name, variable in variables.items() if name != "t"},
        coords={"t": variables["t"], **{name: (name, list(v)) for name, v in names.items()}},
        # Text and whole numbers only, which every file format takes.
        attrs={
            "title": run.scenario.name,
            "scenario": run.scenario.to_toml(),
            "digest": run.scenario.digest,
            "status": status.kind,
            "status_frame": status.frame,
            "status_sentence": status.sentence,
            "events": json.dumps([asdict(event) for event in run.events]),
            "vsctrl": metadata.version("vsctrl"),
        },
    )
