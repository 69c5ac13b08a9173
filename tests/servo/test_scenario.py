"""Every way to describe an experiment wrongly has its sentence; every right one round-trips."""

import re
import subprocess
import sys
from pathlib import Path

import effort
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vsctrl import paper
from vsctrl.errors import InputError
from vsctrl.servo import Scenario, simulate
from vsctrl.servo.scenario import experiment
from vsctrl.servo.scenario import scenario as whole
from vsctrl.servo.scenario.links import KINDS
from vsctrl.servo.scenario.motions import ScrewMotion

BASE = paper.sliding()
TOML = BASE.to_toml()
LAM_LINE = TOML[: TOML.index("\nlam =")].count("\n") + 2


def refusal(action, *arguments, **keywords) -> str:
    with pytest.raises(InputError) as caught:
        action(*arguments, **keywords)
    message = str(caught.value)
    assert "pydantic" not in message
    assert "validation error" not in message
    assert "Input should" not in message
    assert message.endswith(".")
    return message


def edited(pattern, replacement):
    text, count = re.subn(pattern, replacement, TOML, count=1, flags=re.MULTILINE)
    assert count == 1
    return text


BAD_VALUES = [
    ("lam", -1, "law.lam: -1 is not positive; give a number above 0"),
    ("lam", 0, "law.lam: 0 is not positive"),
    ("lam", True, "law.lam: true is not a number"),
    ("lam", "2.5", "law.lam: '2.5' is not a number; write one without quotes"),
    ("lam", None, "law.lam: None is not a number"),
    ("lam", float("nan"), "law.lam: nan is not a finite number"),
    ("lam", 10**400, "is not a finite number"),
    ("lam", 10**5000, "is not a finite number"),
    ("lam", 1e12, "law.lam: 1e+12 is beyond ±1e+09; check the unit"),
    ("lam", 1e-12, "law.lam: 1e-12 is below 1e-09; check the unit"),
    ("k_ff", float("-inf"), "law.k_ff: -inf is not a finite number"),
    ("period", 0.0, "vision.period: 0 is not positive"),
    ("duration", -9, "motion.duration: -9 is not positive"),
    ("duration", 0.01, "motion.duration: 0.01 s is shorter than one video period of 0.04 s"),
    ("duration", 1e9, "25000000000 frames of 4 points; the limit is 1000000 frames"),
    ("latency", -0.08, "vision.latency: -0.08 is negative; give 0 or more"),
    ("noise_px", -1, "vision.noise_px: -1 is negative"),
    ("seed", 1.5, "vision.seed: 1.5 is not a whole number"),
    ("seed", True, "vision.seed: true is not a whole number"),
    ("seed", -1, "vision.seed: -1 is out of range"),
    ("depth_ratio", 0, "law.depth_ratio: 0 is not positive"),
    ("Fx", -700, "camera.Fx: -700 is not positive"),
    ("V", (0.04, 0.0), "motion.V: (0.04, 0.0) has 2 entries; give 3 numbers"),
    ("V", 0.04, "motion.V: 0.04 is not a list; write 3 numbers in brackets"),
    ("V", "abc", "motion.V: 'abc' is not a list"),
    ("V", [0, False, 0], "motion.V: entry 2: false is not a number"),
    ("V", [0, 0, float("inf")], "motion.V: entry 3: inf is not a finite number"),
    ("offset", [0] * 5, "start.offset: [0, 0, 0, 0, 0] has 5 entries; give 6 numbers"),
    ("points", [[0, 0, 0]] * 2, "target.points: too few points (2); give at least 3"),
    ("points", [[0, 0, 0], [1, 0], [0, 1, 0]], "target.points: point 2: [1, 0] has 2 entries"),
    ("points", 5, "target.points: 5 is not a list"),
    ("interaction", "curent", "choose one of these (did you mean 'current'?"),
    ("placement", 3, 'law.placement: 3 is not one of "measurement", "aligned", "actuator"'),
    ("name", 3, "name: 3 is not text; write it in quotes"),
    ("name", "\ud800", "cannot be written in UTF-8"),
    ("V", (0, 0, 0.4), "motion.V: at t = 1.64 s of the reference point 1 lies at depth"),
    ("offset", (0, 0, 1, 0, 0, 0), "start.offset: from the true start point 1 lies at depth"),
]


@pytest.mark.parametrize(
    ("leaf", "value", "sentence"), BAD_VALUES, ids=[sentence for *_, sentence in BAD_VALUES]
)
def test_a_bad_value_is_refused_in_a_sentence(leaf, value, sentence):
    assert sentence in refusal(BASE.with_, **{leaf: value})


BAD_TOML = [
    (edited("^lam = .*", "lamda = 2.5"), "law.lamda: unknown key with value 2.5 (did you mean"),
    (edited("^lam = .*", "lamda = 2.5"), "law.lam: missing; give it a value (gain λ, 1/s)"),
    (edited("^Fx", "lam = 2\nFx"), "camera.lam: unknown key with value 2; it belongs into [law]"),
    (edited("^name", "colour = 1\nname"), "colour: unknown key with value 1; it has name, "),
    (edited("^name", "self = 1\nname"), "self: unknown key with value 1"),
    (edited(r"^\[law\]", "[lwa]"), "lwa: unknown key with value"),
    (edited(r"^\[law\]", "[lwa]"), "did you mean 'law'?"),
    (edited(r"^\[law\]", "[lwa]"), "law: missing; give it a table [law]"),
    ("law = 3", "law: 3 is not a table; write its keys under [law]"),
    ("law = [1]", "law: [1] is not a table"),
    (edited("^lam = .*", "lam = = 2"), f"(at line {LAM_LINE}, column 7)"),
    (edited("^lam = .*", "lam = 2026-01-01"), "law.lam: datetime.date(2026, 1, 1) is not a nu"),
    (edited("^lam = .*", "lam = nan"), "law.lam: nan is not a finite number"),
    (edited("^lam = .*", "lam = " + "9" * 5000), "TOML: "),
    ("a = " + "[" * 100_000, "TOML: "),
]


@pytest.mark.parametrize(("text", "sentence"), BAD_TOML, ids=[sentence for _, sentence in BAD_TOML])
def test_bad_toml_is_refused_in_a_sentence(text, sentence):
    assert sentence in refusal(Scenario.from_toml, text)


def test_all_problems_come_in_one_message():
    text = edited("^lam = .*", "lam = -1").replace("period = 0.04", "period = 'a'")
    message = refusal(Scenario.from_toml, text.replace("[camera]", "[camera]\nfocal = 3"))
    assert message.startswith("3 problems:\n  camera.focal: unknown key with value 3")
    assert "\n  law.lam: -1 is not positive" in message
    assert "\n  vision.period: 'a' is not a number" in message


def test_the_start_printed_in_the_paper_is_refused_and_the_slip_found():
    message = refusal(BASE.with_, position=paper.PRINTED_START)
    # By hand, camera axes in the object frame from Rx(2°) Ry(4.2°): depth = ẑ · (P − t).
    a, b = np.deg2rad([2.0, 4.2])
    z_axis = [np.sin(b), -np.sin(a) * np.cos(b), np.cos(a) * np.cos(b)]
    depth = z_axis @ (np.array([-0.125, -0.075, -0.125]) - paper.PRINTED_START)
    assert f"point 1 lies at depth {depth:.3g} m" in message
    assert "(-0.174, 0.044, -0.077) m" in message
    assert "behind the camera; move the start back along the optical axis" in message
    assert "With z = -0.77 m instead of -0.077 m every point lies in front" in message


def test_a_start_with_no_slipped_decimal_gets_no_such_hint():
    message = refusal(BASE.with_, position=(0, 0, 1))
    assert "decimal" not in message


@pytest.mark.parametrize(
    ("latency", "frames"), [(0, 0), (0.04, 1), (0.08, 2), (0.12, 3), (40.0, 1000)]
)
def test_latency_in_frames(latency, frames):
    assert BASE.with_(latency=latency).latency_frames == frames


def test_a_latency_between_frames_is_simulated_but_is_no_number_of_frames():
    between = BASE.with_(latency=0.09)
    assert simulate(between).status.ok
    message = refusal(lambda: between.latency_frames)
    assert message.startswith("vision.latency: 0.09 s is 2.25 video periods of 0.04 s; ")
    assert "choose 0.08 or 0.12" in message


def test_frames_are_whole_periods_within_rounding():
    assert BASE.frames == 225  # 9/0.04 is 225.0, and 0.3/0.1 is 2.9999999999999996
    assert BASE.with_(duration=0.3, period=0.1, latency=0).frames == 3
    assert BASE.with_(duration=0.35, period=0.1, latency=0).frames == 3


def test_integers_and_numpy_numbers_are_numbers():
    same = BASE.with_(lam=np.float64(5), duration=9, V=np.array([0.04, 0, 0]), seed=np.int64(0))
    assert same == BASE.with_(lam=5)
    assert isinstance(same.law.lam, float)
    assert type(same.vision.seed) is int
    assert BASE.with_(k_ff=-0.0).digest == BASE.with_(k_ff=0).digest


def test_files_that_cannot_be_read(tmp_path):
    missing = tmp_path / "none.toml"
    assert refusal(Scenario.load, missing).startswith(f"{missing}: there is no such file")
    assert "this is a directory" in refusal(Scenario.load, tmp_path)
    latin = tmp_path / "latin.toml"
    latin.write_bytes("name = 'Gl\xfcck'".encode("latin-1"))
    assert "byte 10 is not UTF-8; save the file as UTF-8" in refusal(Scenario.load, latin)
    broken = tmp_path / "broken.toml"
    broken.write_text("name = 'x'\nlam 3\n")
    message = refusal(Scenario.load, str(broken))
    assert message.startswith(f"{broken}: TOML: ")
    assert "line 2" in message
    assert "cannot be read" in refusal(Scenario.load, "a\0b")
    assert "decode it as UTF-8" in refusal(Scenario.from_toml, TOML.encode())


def test_files_round_trip_with_or_without_a_byte_order_mark(tmp_path):
    path = tmp_path / "s.toml"
    BASE.save(path)
    assert Scenario.load(path) == BASE
    assert [p.name for p in tmp_path.iterdir()] == ["s.toml"]
    path.write_bytes(b"\xef\xbb\xbf" + TOML.replace("\n", "\r\n").encode())
    assert Scenario.load(path) == BASE


def test_a_failed_save_leaves_everything_as_it_was(tmp_path, monkeypatch):
    path = tmp_path / "s.toml"
    path.write_text("old")
    missing = tmp_path / "no" / "s.toml"
    assert refusal(BASE.save, missing).startswith(f"{missing}: the scenario cannot be written")
    assert "cannot be written" in refusal(BASE.save, tmp_path)

    def full(self, target):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    assert "No space left on device" in refusal(BASE.save, path)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["s.toml"]


def test_fields_vary_by_their_own_names():
    varied = BASE.with_(lam=5, k_ff=0.5, latency=0.04, placement="aligned", name="x")
    assert (varied.law.lam, varied.law.k_ff, varied.law.placement) == (5.0, 0.5, "aligned")
    assert (varied.vision.latency, varied.name) == (0.04, "x")
    assert BASE.law.lam == 2.5
    message = refusal(BASE.with_, lamb=3, foo=1)
    assert "lamb: no field of a scenario has this name (did you mean 'lam'?" in message
    assert "foo: " in message


def test_comments_say_what_is_done_by_default_and_where_nature_has_ends():
    # A Smith predictor that is told no latency believes in the dead time too.
    late = {"dead_time": 0.03, "predictor": "smith", "duration": 1.0}
    scenario = paper.sliding().with_(**late)
    told = scenario.with_(tau_hat=scenario.vision.latency + 0.03)
    short = scenario.with_(tau_hat=scenario.vision.latency)
    np.testing.assert_array_equal(simulate(scenario).command, simulate(told).command)
    assert not np.array_equal(simulate(scenario).command, simulate(short).command)
    assert "with smith robot.dead_time on top" in whole.COMMENTS["predictor.tau_hat"]
    assert "ages below 0 are cut to 0" in whole.COMMENTS["vision.jitter"]


def test_leaf_names_are_unique_and_all_have_comments():
    leaves = [n for table in whole.TABLES.values() for n in table.model_fields]
    leaves += {n for kind in KINDS.values() for n in kind.model_fields}
    assert len(whole.TABLE_OF) == len(set(leaves)) + 2 == len(leaves) + 2
    for name in whole.COMMENTS:
        assert whole.COMMENTS[name]
        assert TOML.count(whole.COMMENTS[name]) == 1
    for kind in KINDS.values():
        assert all(field.description for field in kind.model_fields.values())


def test_digest_is_stable_and_sensitive():
    assert BASE.digest == "8e0fb3c64de7"  # files and reports hold it: new options must not move it
    assert Scenario.from_toml(TOML).digest == BASE.digest
    code = "from vsctrl import paper; print(paper.sliding().digest)"
    other = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.strip()
    assert other == BASE.digest
    changes = {
        "lam": np.nextafter(2.5, 3), "k_ff": 0, "latency": 0, "placement": "aligned",
        "interaction": "mean", "depth_ratio": 1.1, "noise_px": 1, "seed": 1, "Fx": 701,
        "Fy": 701, "V": (0.03, 0, 0), "Omega": (0, 0.01, 0), "duration": 8, "period": 0.02,
        "offset": (0.01, 0, 0, 0, 0, 0), "position": (0, 0, -1), "euler_xyz_deg": (0, 0, 0),
        "name": "x", "description": "x", "points": [[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]],
        "size_px": (900, 700), "k1": 0.1, "drift": (0.01, 0, 0, 0, 0, 0), "scheme": "pose",
        "features": "polar", "depth": "constant", "smooth": 3, "T_i": 5, "preview": 0.1,
        "preview_ff": 0.1, "jitter": 0.01, "missed": 0.1, "quantum_px": 1, "outliers": 0.1,
        "outlier_px": 5, "focal_ratio": 1.1, "centre_px": (1, 0), "depth_ratios": (1, 1, 1, 2),
        "hand_eye": (0, 0, 0, 0, 0, 0.1), "reference_depth_ratio": 1.1,
        "reference_focal_ratio": 1.1, "reference_centre_px": (1, 0), "reference_k1": 0.1,
        "reference_hand_eye": (0, 0, 0, 0, 0, 0.1), "predictor": "smith", "process": 3,
        "measurement_px": 3, "dead_time": 0.01, "speed_limit": 1, "rate_limit": 1,
        "acceleration_limit": 1, "angular_acceleration_limit": 1, "time_constant": 0.1,
        "on_behind": "continue", "on_lost": "continue", "on_rank_loss": "continue",
        "on_joint_limit": "continue",
    }  # fmt: skip
    together = [
        {"drift": (0.01, 0, 0, 0, 0, 0), "sway": 2.0},
        {"lam_zero": 4.0, "lam_slope": 1.0},
        {"predictor": "smith", "tau_hat": 0.1},
        {"carrier": "gantry", "joints": (0, 0, 0, 0, 0.5, 0)},
        {"carrier": "gantry", "joints": (0, 0, 0, 0, 0.5, 0), "avoidance": True},
    ]
    motion = set(ScrewMotion.model_fields) - {"kind"}
    leaves = {n for n, table in whole.TABLE_OF.items() if table != "motion"} | motion
    assert {*changes, *(name for several in together for name in several)} == leaves
    variants = [{leaf: value} for leaf, value in changes.items()] + together
    digests = {BASE.with_(**variant).digest for variant in variants}
    assert len(digests | {BASE.digest}) == len(variants) + 1


def test_a_scenario_cannot_be_changed_in_place():
    for action in (lambda: setattr(BASE, "name", "x"), lambda: setattr(BASE.law, "lam", 1.0)):
        assert "make another one with scenario.with_(" in refusal(action)


def test_tables_speak_in_sentences_too():
    assert refusal(experiment.LawTable, lam=-1).startswith("lam: -1 is not positive")


finite = st.floats(-1e3, 1e3, allow_nan=False)


@settings(max_examples=effort.share(60), deadline=None)
@given(
    name=st.text(st.characters(codec="utf-8")),
    description=st.text(st.sampled_from("\"\\\n\r\t\b\f\0\x7f'#é€𝔸")),
    lam=st.floats(1e-9, 1e9),
    k_ff=finite,
    offset=st.tuples(*[st.floats(-0.2, 0.2)] * 6),
    noise_px=st.floats(0, 1e9),
    seed=st.integers(0, 2**63 - 1),
    points=st.lists(st.tuples(*[st.floats(-0.2, 0.2)] * 3), min_size=3, max_size=6),
)
def test_toml_gives_back_exactly_the_same_scenario(**changes):
    try:
        varied = BASE.with_(position=(0, 0, -2), euler_xyz_deg=(0, 0, 0), **changes)
    except InputError as error:
        assert "behind the camera" in str(error)
        return
    again = Scenario.from_toml(varied.to_toml())
    assert again == varied
    assert again.digest == varied.digest
    assert again.to_toml() == varied.to_toml()


@settings(max_examples=effort.share(150), deadline=None)
@given(st.integers(0, len(TOML) - 1), st.integers(0, 12), st.text(max_size=3))
def test_a_mistyped_file_is_a_scenario_or_a_sentence(start, length, inserted):
    text = TOML[:start] + inserted + TOML[start + length :]
    try:
        assert Scenario.from_toml(text).frames >= 1
    except InputError as error:
        assert str(error).endswith(".")
        assert "pydantic" not in str(error)
