"""A run as a table of comma-separated values: every number comes back, every column has a unit."""

import csv
import io

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import vsctrl as vs
from vsctrl.errors import InputError


@pytest.fixture(scope="module")
def run():
    scenario = vs.paper.rotation().with_(
        duration=0.8, noise_px=0.3, carrier="gantry", joints=(-0.2, 0, 0, 0, 0.5, 0)
    )
    return vs.simulate(scenario)


@pytest.fixture(scope="module")
def columns(run):
    rows = list(csv.reader(io.StringIO(run.to_csv())))
    assert len({len(row) for row in rows}) == 1 and len(set(rows[0])) == len(rows[0])
    values = np.array(rows[1:], dtype=float)
    return dict(zip(rows[0], values.T, strict=True))


def test_every_frame_is_a_row_and_every_number_comes_back_exactly(run, columns):
    np.testing.assert_array_equal(columns["t_s"], run.t)
    for name, values, k in (
        ("x_m", run.pose[:, 0, 3], None),
        ("reference_z_m", run.reference_pose[:, 2, 3], None),
        ("lag_y_m", run.lag, 1),
        ("lag_rz_rad", run.lag, 5),
        ("command_Vx_m_per_s", run.command, 0),
        ("twist_Wz_rad_per_s", run.twist, 5),
        ("Y2_px", run.features, 3),
        ("reference_X1_px", run.reference, 0),
        ("error_X4_px", run.error, 6),
        ("measured_error_Y4_px", run.measured_error, 7),
        ("depth_3_m", run.depths, 2),
        ("visible_1", run.visible, 0),
        ("joint_1_m", run.joints, 0),
        ("joint_6_rad", run.joints, 5),
    ):
        np.testing.assert_array_equal(columns[name], values if k is None else values[:, k], name)


def test_rotations_are_vectors_along_the_axis_of_the_angle(run, columns):
    turn = np.column_stack([columns[f"r{axis}_rad"] for axis in "xyz"])
    np.testing.assert_allclose(
        Rotation.from_rotvec(turn).as_matrix(), run.pose[:, :3, :3], atol=1e-12
    )


def test_every_column_is_named_with_its_unit(columns):
    units = ("_s", "_m", "_rad", "_px", "_m_per_s", "_rad_per_s")
    assert [n for n in columns if not n.endswith(units)] == [f"visible_{i}" for i in (1, 2, 3, 4)]


def test_other_features_are_numbered(run):
    other = vs.simulate(vs.paper.sliding().with_(features="segments", duration=0.2))
    head = other.to_csv().split("\n", 1)[0].split(",")
    m = other.measured_error.shape[1]
    assert [f"measured_error_{i}" for i in range(1, m + 1)] == [
        n for n in head if n.startswith("measured_error")
    ]


def test_a_file_is_written_whole_or_not_at_all(run, tmp_path):
    path = tmp_path / "run.csv"
    assert run.to_csv(path) is None
    assert path.read_bytes().decode() == run.to_csv()
    assert [each.name for each in tmp_path.iterdir()] == ["run.csv"]
    with pytest.raises(InputError, match="the table of the run cannot be written"):
        run.to_csv(tmp_path / "nowhere" / "run.csv")
    with pytest.raises(InputError, match="path: 3 is no path"):
        run.to_csv(3)
