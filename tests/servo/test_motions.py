"""[motion] in all its kinds: files, refusals, variations, and the schema for editors."""

import json
import math
import re

import effort
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vsctrl import paper
from vsctrl.errors import InputError
from vsctrl.servo import Scenario, schema, simulate

BASE = paper.sliding().with_(position=(0, 0, -2), euler_xyz_deg=(0, 0, 0))
HEAD, REST = BASE.to_toml().split("[motion]")
TAIL = "[law]" + REST.split("[law]")[1]

FAST = {**BASE.model_dump(), "vision": {"period": 0.01, "latency": 0}}

SCREW = {"V": (0.02, 0, 0), "duration": 1.0}
MOTIONS = {
    "screw": {"kind": "screw", **SCREW},
    "screw without kind": SCREW,
    "hold": {"kind": "hold", "duration": 2.0},
    "rotation": {
        "kind": "rotation", "axis": (0, 1, 0), "arm": (0, 0, 2), "speed": -0.1, "duration": 2.0,
    },
    "oscillation by cycle": {
        "kind": "oscillation", "direction": (0, 1, 0, 0, 0, 0), "amplitude": 0.1, "cycle": 2.0,
        "duration": 2.0,
    },
    "oscillation by speed": {
        "kind": "oscillation", "waveform": "triangle", "direction": (0, 0, 0, 0, 0, 1),
        "amplitude": 0.1, "speed": 0.4, "duration": 2.0,
    },
    "path": {
        "kind": "path", "times": (1.0, 2.0), "positions": ((0, 0.1, -2), (0.1, 0.1, -1.9)),
        "angles_xyz_deg": ((5, 0, 0), (5, 5, 0)), "ends": "free",
    },
    "linked": {
        "kind": "linked", "max_acceleration": (0.1, 0.5), "to_rest": True,
        "parts": [SCREW, {"kind": "hold", "duration": 0.5},
                  {"kind": "path", "frame": "start", "times": [1.0], "positions": [[0, 0.1, 0]],
                   "angles_xyz_deg": [[0, 0, 5]]}],
    },
    "linked without blends": {"kind": "linked", "blend": "none", "parts": [SCREW, SCREW]},
}  # fmt: skip


def scenario(motion):
    return Scenario(**{**BASE.model_dump(), "motion": motion})


def from_toml(text):
    return Scenario.from_toml(f"{HEAD}[motion]\n{text}\n{TAIL}")


def test_the_speed_of_a_scenario_is_the_greatest_one_not_that_of_the_greatest_component():
    parts = [{"V": V, "duration": 1.0} for V in ((0.05, 0, 0), (-0.045, 0.045, 0))]
    motion = {"kind": "linked", "blend": "none", "parts": parts}
    assert scenario(motion).speed == pytest.approx(0.045 * math.sqrt(2), rel=1e-14)  # 0.06364
    # Squares of these are no numbers any more.
    tiny = {"V": (3e-200, 4e-200, 0), "duration": 1.0}
    assert scenario(tiny).speed == pytest.approx(5e-200, rel=1e-14)
    assert scenario({"kind": "hold", "duration": 1.0}).speed == 0


@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS)
def test_every_kind_runs_and_round_trips(motion):
    found = scenario(motion)
    run = simulate(found)
    assert run.status.ok
    assert len(run.t) == math.floor(found.motion.duration / 0.04 + 1e-6) + 1
    text = found.to_toml()
    again = Scenario.from_toml(text)
    assert again == found
    assert (again.digest, again.to_toml()) == (found.digest, text)
    assert "None" not in text
    for line in text.splitlines():
        assert not line.strip() or line[0] in "[ ]" or "  # " in line
    np.testing.assert_array_equal(again.reference.pose(run.t), run.reference_pose)


def test_kinds_have_digests_of_their_own_which_survive_json():
    for motion in MOTIONS.values():
        found = scenario(motion)
        data = json.loads(json.dumps(found.model_dump(mode="json")))
        assert Scenario(**data) == found and Scenario(**data).digest == found.digest
    digests = {scenario(motion).digest for motion in MOTIONS.values()}
    assert len(digests) == len(MOTIONS) - 1  # a screw with and without its kind is the same


def test_the_numbers_of_an_oscillation_follow_from_each_other():
    for waveform, way in (("sine", 2 * math.pi), ("triangle", 4)):
        by_speed = {**MOTIONS["oscillation by speed"], "waveform": waveform}
        by_cycle = {**by_speed, "speed": None, "cycle": way * 0.1 / 0.4}
        t = np.linspace(0, 2, 50)
        poses = [scenario(motion).reference.pose(t) for motion in (by_speed, by_cycle)]
        np.testing.assert_allclose(*poses, atol=1e-14)
        assert np.abs(scenario(by_speed).reference.twist(t)).max() == pytest.approx(0.4, rel=1e-2)


def test_a_path_starts_at_the_start_and_passes_through_its_poses():
    reference = scenario(MOTIONS["path"]).reference
    np.testing.assert_allclose(reference.pose(0.0)[:3, 3], [0, 0, -2], atol=1e-15)
    for t, position in zip((1.0, 2.0), MOTIONS["path"]["positions"], strict=True):
        np.testing.assert_allclose(reference.pose(t)[:3, 3], position, atol=1e-14)
    relative = {**MOTIONS["path"], "frame": "start", "positions": ((0, 0.1, 0), (0.1, 0.1, 0.1))}
    moved = scenario(relative).with_(position=(0.5, 0, -3), euler_xyz_deg=(0, 0, 90)).reference
    # A start turned by 90° about z has its y axis along −x of the object.
    np.testing.assert_allclose(moved.pose(1.0)[:3, 3], [0.4, 0, -3], atol=1e-14)


REFUSALS = [
    ("kind = 'rotaton'", 'motion.kind: \'rotaton\' is not one of "screw", "hold", "rotation"'),
    ("kind = 'rotaton'", "did you mean 'rotation'?"),
    ("kind = 3", "motion.kind: 3 is not one of"),
    ("V = [1, 0, 0]", "motion.duration: missing; give it a value (length of the run or part, s)"),
    ("axis = 1", 'a motion of kind "screw" has no such key, only kind "rotation"'),
    ("cycle = 1\nlam = 2", "motion.lam: unknown key with value 2; it belongs into [law]"),
    ("kind = 'hold'\nVV = 1", "motion.VV: unknown key with value 1; it has kind, duration"),
    ("kind = 'rotation'\naxis = [0, 0, 0]", "motion.axis: [0, 0, 0] points nowhere"),
    ("kind = 'rotation'\nspeed = 'x'", "motion.speed: 'x' is not a number"),
    ("kind = 'oscillation'\nwaveform = 'sinus'", "(did you mean 'sine'?)"),
    ("kind = 'oscillation'\ncycle = -1", "motion.cycle: -1 is not positive"),
    (
        "kind = 'oscillation'\ndirection = [1, 0, 0, 0, 0, 0]\namplitude = 1\nduration = 1",
        "motion.cycle, speed: with the amplitude each follows from the other; give one of the two",
    ),
    (
        "kind = 'oscillation'\ndirection = [1, 0, 0, 0, 0, 0]\namplitude = 1\nduration = 1\n"
        "cycle = 1\nspeed = 1",
        "give one of the two",
    ),
    ("kind = 'path'\ntimes = [1, 3, 2]", "motion.times: entry 3: 2 s does not come after 3 s"),
    ("kind = 'path'\ntimes = [0, 1]", "motion.times: entry 1: 0 is not positive"),
    ("kind = 'path'\ntimes = []", "motion.times: no times; give at least one"),
    ("kind = 'path'\npositions = [[0, 0]]", "motion.positions: row 1: [0, 0] has 2 entries"),
    ("kind = 'path'\npositions = []", "motion.positions: no rows; give at least one"),
    (
        "kind = 'path'\ntimes = [1, 2]\npositions = [[0, 0, 0]]\nangles_xyz_deg = [[0, 0, 0]]",
        "motion.positions: 1 rows for 2 times; give one row for every time",
    ),
    (
        "kind = 'path'\ntimes = [1]\npositions = [[0, 0, -2]]\nangles_xyz_deg = [[0, 0, 180]]",
        "motion: poses: from t = 0 s to 1 s the camera turns by 180°",
    ),
    ("kind = 'path'\nduration = 1", 'a motion of kind "path" has no such key, only kind "screw"'),
    (
        "kind = 'path'\ntimes = [4]\npositions = [[0, 0, 2]]\nangles_xyz_deg = [[0, 0, 0]]",
        "motion: at t = 1.92 s of the reference point 1 lies at depth -0.005",
    ),
    (
        "kind = 'path'\ntimes = [0.01]\npositions = [[0, 0, -2]]\nangles_xyz_deg = [[0, 0, 0]]",
        "motion: 0.01 s is shorter than one video period of 0.04 s; lengthen the motion or shorten",
    ),
    ("kind = 'linked'\nparts = 3", "motion.parts: 3 is no list of motions; write one table [[mot"),
    ("kind = 'linked'\nparts = []", "motion.parts: [] is no list of motions"),
    ("kind = 'linked'\nparts = [3]", "motion.parts: part 1: 3 is not a table; write its keys under "
     "[[motion.parts]]"),
    ("kind = 'linked'\nfrom_rest = 1", "motion.from_rest: 1 is neither true nor false"),
    (
        "kind = 'linked'\n[[motion.parts]]\nkind = 'linked'",
        "motion.parts: part 1, kind: a linked motion cannot be a part",
    ),
    (
        "kind = 'linked'\n[[motion.parts]]\nkind = 'path'\ntimes = [1]\npositions = [[0, 0, 0]]\n"
        "angles_xyz_deg = [[0, 0, 0]]",
        'part 1, frame: a part begins where the one before it ends; give its poses from there',
    ),
    (
        "kind = 'linked'\n[[motion.parts]]\nkind = 'hold'\nduration = 1",
        "motion.max_acceleration: missing; give the limits of the blends, such as [0.1, 0.5]",
    ),
    (
        "kind = 'linked'\nmax_acceleration = [0.1, 0]\n[[motion.parts]]",
        "motion.max_acceleration: entry 2: 0 is not positive",
    ),
    (
        "kind = 'linked'\nmax_acceleration = [1e-9, 1]\n[[motion.parts]]\nV = [0, 0.1, 0]\n"
        "Omega = [0, 0, 1]\nduration = 1\n[[motion.parts]]\nkind = 'hold'\nduration = 1",
        "raise the acceleration limit",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("text", "sentence"), REFUSALS, ids=[s for _, s in REFUSALS])
def test_a_wrong_motion_is_refused_in_a_sentence(text, sentence):
    with pytest.raises(InputError) as caught:
        from_toml(text)
    message = str(caught.value)
    assert sentence in message
    assert message.endswith(".") and ".." not in message
    assert "pydantic" not in message and "Input should" not in message


def test_all_problems_of_all_parts_come_in_one_message():
    with pytest.raises(InputError) as caught:
        from_toml(
            "kind = 'linked'\nblend = 'none'\nto_rest = 2\n[[motion.parts]]\nV = [0, 0]\n"
            "duration = -1\n[[motion.parts]]\nkind = 'hold'\n"
        )
    lines = str(caught.value).splitlines()
    assert lines[0] == "4 problems:"
    assert "motion.to_rest: 2 is neither" in lines[1]
    assert "motion.parts: part 1, V: [0, 0] has 2 entries" in lines[2]
    assert "motion.parts: part 1, duration: -1 is not positive" in lines[3]
    assert "motion.parts: part 2, duration: missing" in lines[4]
    with pytest.raises(
        InputError, match=r"2 problems:\n.*max_acceleration: belongs.*\n.*to_rest: b"
    ):
        scenario({**MOTIONS["linked without blends"], "max_acceleration": (1, 1), "to_rest": True})


def test_fields_of_a_motion_vary_by_name_and_another_kind_starts_afresh():
    turning = scenario(MOTIONS["rotation"])
    assert turning.with_(speed=0.05).motion.speed == 0.05
    assert turning.with_(lam=3).motion == turning.motion
    still = turning.with_(kind="hold")
    assert still.motion.model_dump() == {"kind": "hold", "duration": 2.0}
    assert still.with_(kind="screw", V=(0.02, 0, 0), duration=1) == scenario(MOTIONS["screw"])
    by_cycle = scenario(MOTIONS["oscillation by speed"]).with_(cycle=3, speed=None)
    assert (by_cycle.motion.cycle, by_cycle.motion.speed) == (3.0, None)
    linked = scenario(MOTIONS["linked"])
    assert linked.with_(lam=3).motion == linked.motion
    with pytest.raises(InputError, match=r'motion\.V: .* kind "hold" has no such key'):
        still.with_(V=(1, 0, 0))
    with pytest.raises(InputError, match=r"motion\.kind: 'slide' is not one of"):
        still.with_(kind="slide")


def test_the_schema_accepts_what_a_scenario_accepts():
    import jsonschema  # seconds, for the grammar of addresses

    validator = jsonschema.Draft202012Validator(json.loads(schema()))
    validator.check_schema(validator.schema)
    for motion in MOTIONS.values():
        data = scenario(motion).model_dump(mode="json", exclude_none=True)  # TOML has no null
        assert list(validator.iter_errors(data)) == []
    good = BASE.model_dump(mode="json", exclude_none=True)
    for wrong in (
        {"law": {"lam": -1}},
        {"law": {"lam": 1, "colour": 1}},
        {"motion": {"kind": "hold", "duration": 1, "V": [0, 0, 0]}},
        {"motion": {"kind": "slide"}},
        {"motion": {"duration": 1}},
        {"target": {"points": [[0, 0, 0]]}},
    ):
        assert list(validator.iter_errors({**good, **wrong}))


coordinate = st.floats(-0.1, 0.1, allow_nan=False)
vector3 = st.tuples(coordinate, coordinate, coordinate)
seconds = st.floats(0.05, 3.0)
some = st.tuples(*[st.floats(0.1, 1.0)] * 3)
screws = st.fixed_dictionaries({"V": vector3, "Omega": vector3, "duration": seconds})
holds = st.fixed_dictionaries({"kind": st.just("hold"), "duration": seconds})
rotations = st.fixed_dictionaries(
    {"kind": st.just("rotation"), "axis": some, "arm": vector3, "speed": coordinate,
     "duration": seconds}
)  # fmt: skip
oscillations = st.fixed_dictionaries(
    {"kind": st.just("oscillation"), "waveform": st.sampled_from(["sine", "triangle"]),
     "direction": st.tuples(*[st.floats(-1, 1)] * 5, st.floats(0.1, 1)),
     "amplitude": st.floats(0.01, 0.05), "duration": seconds}
).flatmap(
    # Slow enough to be followed by the fine steps of the test below.
    lambda motion: st.sampled_from([("cycle", 3.0), ("speed", 0.1)]).flatmap(
        lambda row: st.floats(row[1] / 5, row[1]).map(lambda value: {**motion, row[0]: value})
    )
)  # fmt: skip


def paths(frame, away):
    return st.lists(st.tuples(st.floats(0.01, 1), vector3, vector3), min_size=1, max_size=4).map(
        lambda rows: {
            "kind": "path",
            "times": [sum(row[0] for row in rows[: k + 1]) for k in range(len(rows))],
            "positions": [(x, y, z - away) for _, (x, y, z), _ in rows],
            "angles_xyz_deg": [[100 * c for c in angles] for *_, angles in rows],
            "frame": frame,
            "ends": "rest",
        }
    )


elementary = st.one_of(screws, holds, rotations, oscillations, paths("start", 0.0))
links = st.one_of(
    st.fixed_dictionaries(
        {"kind": st.just("linked"), "blend": st.sampled_from(["linear", "smooth"]),
         "max_acceleration": st.tuples(*[st.floats(0.05, 5.0)] * 2), "from_rest": st.booleans(),
         "to_rest": st.booleans(), "parts": st.lists(elementary, min_size=1, max_size=3)}
    ),
    st.fixed_dictionaries(
        {"kind": st.just("linked"), "blend": st.just("none"),
         "parts": st.lists(elementary, min_size=1, max_size=3)}
    ),
)  # fmt: skip


REFUSED = re.compile("the camera turns by|is rounding; set it to 0")


@settings(max_examples=effort.share(120), deadline=None)
@given(st.one_of(elementary, paths("object", 2.0), links))
def test_any_motion_round_trips_exactly_and_its_twist_is_its_pose_s(motion):
    try:
        found = Scenario(**{**FAST, "motion": motion})
    except InputError as error:
        assert "behind the camera" in str(error) or REFUSED.search(str(error))
        return
    again = Scenario.from_toml(found.to_toml())
    assert again == found
    assert (again.digest, again.to_toml()) == (found.digest, found.to_toml())
    # The frames' poses follow from the twists between them, by the trapezoid rule, jumps aside.
    reference = again.reference
    t = again.t
    fine = np.linspace(t[0], t[-1], 20 * len(t))
    twist, pose = reference.twist(fine), reference.pose(fine)
    rate = np.diff(pose[:, :3, 3], axis=0) / (fine[1] - fine[0])
    V = np.einsum("nij,nj->ni", pose[:, :3, :3], twist[:, :3])
    jump = max((np.abs(jump.size).max() for jump in reference.jumps), default=0.0)
    bound = np.abs(np.diff(V, axis=0)).max() + jump + 1e-9
    assert np.abs(rate - (V[1:] + V[:-1]) / 2).max() <= bound


LINKED = scenario(MOTIONS["linked"]).to_toml()
START_OF_MOTION = LINKED.index("[motion]")


@settings(max_examples=effort.share(150), deadline=None)
@given(st.integers(START_OF_MOTION, LINKED.index("[law]")), st.integers(0, 12), st.text(max_size=3))
def test_a_mistyped_motion_is_a_scenario_or_a_sentence(start, length, inserted):
    text = LINKED[:start] + inserted + LINKED[start + length :]
    try:
        assert Scenario.from_toml(text).frames >= 1
    except InputError as error:
        assert str(error).endswith(".")
        assert "pydantic" not in str(error) and "Input should" not in str(error)
