"""A scenario's text: found, overridden, written back, and its errors, all at once and with their places."""

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ftqp.app.scenario import document
from ftqp.app.scenario.setup import load
from ftqp.app.schema import Scenario
from ftqp.app.schema.reading import plain, read
from ftqp.core.errors import ScenarioError


def reported_at(**changes):
    """What is said of a valid scenario with changes."""
    content = {
        "robot": {"name": "panda"},
        "path": {"kind": "circle", "radius": 0.1, "duration": 1.0},
    }
    content |= changes
    try:
        read(Scenario, content, "it has errors:")
    except ScenarioError as error:
        return error.errors
    return ()


CIRCLE = {"kind": "circle", "duration": 1.0}
LOCK = {"kind": "locked", "joint": 0, "at": 2.0}
SENTENCES = [
    (
        {"path": CIRCLE | {"radius": 0.1, "turn": 2}},
        "path.turn is not a key of [path] (did you mean 'turns'?)",
    ),
    (
        {"faults": [{"joint": 0, "at": 1.0}]},
        "faults[0] is missing its kind, expected one of locked, free_swinging, degraded",
    ),
    ({"path": CIRCLE}, "path.radius is missing; it is the radius r, > 0 [m]"),
    (
        {"planner": {"level": "velocty"}},
        "planner.level is 'velocty', expected one of acceleration, velocity (did you mean 'velocity'?)",
    ),
    ({"planner": {"solver": "daqp"}}, "planner.solver is not a key of [planner] (did you mean 'backend'?)"),
    (
        {"faults": [LOCK | {"announced": "nevr"}]},
        "faults[0].announced is 'nevr'; it is when it is reported",
    ),
    ({"faults": [LOCK | {"announced": 1.0}]}, "faults[0] is announced at 1 s, before it happens at 2 s"),
    ({"robot": {}}, "robot names no robot, expected exactly one of name, urdf, mjcf, dh"),
    ({"robot": {"name": "panda", "urdf": "a.urdf"}}, "robot has name and urdf, expected exactly one of"),
    (
        {"planner": {"backend": "daqp", "profile": "x"}},
        "planner has backend and profile, expected one of them",
    ),
]


def test_a_valid_scenario_has_no_errors():
    assert reported_at() == ()


@pytest.mark.parametrize(("changes", "beginning"), SENTENCES, ids=[text for _, text in SENTENCES])
def test_what_is_wrong_is_one_sentence_with_its_place(changes, beginning):
    (sentence,) = reported_at(**changes)
    assert sentence.startswith(beginning)


def test_tables_given_as_values_are_refused():
    sentences = reported_at(robot=3, path="circle", planner=[], faults=3)
    assert [sentence.partition(" ")[0] for sentence in sentences] == ["robot", "planner", "path", "faults"]
    assert all("expected a table" in sentence or "expected a list" in sentence for sentence in sentences)


def test_all_errors_are_told_at_once():
    sentences = reported_at(
        robot={"name": "panda", "tipp": "x"},
        planner={"dt": 0, "level": "x"},
        start={"q": [0.0, "a"]},
        simulation={"seed": -1},
    )
    assert [sentence.partition(" ")[0] for sentence in sentences] == [
        "robot.tipp",
        "planner.dt",
        "planner.level",
        "start.q[1]",
        "simulation.seed",
    ]


def test_a_flood_of_errors_is_cut_short():
    sentences = reported_at(**{f"key{index}": 1 for index in range(1000)})
    assert len(sentences) == 101
    assert sentences[-1] == "and 900 more"


def test_bundled_scenarios_have_a_sentence_each_and_survive_being_written_as_toml():
    found = document.bundled()
    assert len(found) > 20 and all(len(story) > 30 for story in found.values())
    for name in found:
        scenario = read(Scenario, document.read(name).content, name)
        assert read(Scenario, tomllib.loads(document.toml(plain(scenario))), name) == scenario


LIMITS = "robot.limits={v_max={panda_joint2=0.5}, q_max=[2.8]}"


@pytest.mark.parametrize("override", [LIMITS, "planner.emergency=off"])
def test_what_is_a_table_or_none_survives_being_written_as_toml(override):
    scenario = read(Scenario, document.read("panda-circle", [override]).content, "panda-circle")
    assert (scenario.planner.emergency is None) == (override != LIMITS)
    assert read(Scenario, tomllib.loads(document.toml(plain(scenario))), "panda-circle") == scenario


def test_limits_of_joints_by_name_reach_the_arm():
    setup = load("panda-circle", ["robot.limits={v_max={panda_joint2=0.5}}"])
    assert setup.planner.robot.limits.v_max[1] == 0.5 and setup.planner.robot.limits.v_max[0] > 2.0
    with pytest.raises(ScenarioError, match="'panda_jint2' is not a joint of the limits v_max"):
        load("panda-circle", ["robot.limits={v_max={panda_jint2=0.5}}"])


values = st.recursive(
    st.booleans() | st.integers(-(2**60), 2**60) | st.floats(allow_nan=False) | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)
tables = st.dictionaries(st.text(max_size=5), values, max_size=3)


@pytest.mark.long
@given(st.dictionaries(st.text(max_size=5), tables, max_size=3), st.lists(tables, min_size=1, max_size=3))
def test_toml_reads_back_as_what_was_written(content, faults):
    content["faults"] = faults
    assert tomllib.loads(document.toml(content)) == content


@pytest.mark.parametrize(
    ("override", "keys", "value"),
    [
        ("planner.dt=0.002", ("planner", "dt"), 0.002),
        ("faults.0.at=5", ("faults", 0, "at"), 5),
        ("planner.scheme=rmp", ("planner", "scheme"), "rmp"),
        (
            'planner.scheme={name = "dlsm", alpha = 0.5}',
            ("planner", "scheme"),
            {"name": "dlsm", "alpha": 0.5},
        ),
        ("planner.scheme = 'man'", ("planner", "scheme"), "man"),
        ("planner.scheme=[1, 2]", ("planner", "scheme"), [1, 2]),
    ],
)
def test_override_is_a_toml_value_or_else_text_and_leaves_its_neighbours(override, keys, value):
    table = expected = document.read("panda-circle", []).content
    for key in keys[:-1]:
        table = table[key]
    assert table[keys[-1]] != value
    table[keys[-1]] = value
    assert document.read("panda-circle", [override]).content == expected


def test_a_part_of_an_override_in_quotes_may_have_dots():
    vary = document.read(
        "wrong-model", ['vary."robot.name"=', 'vary."path.radius"=[0.05]'], "campaign"
    ).content["vary"]
    assert "robot.name" not in vary and "robot" not in vary and vary["path.radius"] == [0.05]


def test_empty_override_takes_a_key_out():
    assert "faults" not in document.read("panda-circle", ["faults="]).content


@pytest.mark.parametrize(
    ("override", "said"),
    [
        *((override, r"a\.b=value") for override in ("dt", "=1", "planner..dt=1", "a\rb.c=1")),
        *(
            (override, "--set")
            for override in ("faults.3.at=1", "faults.x.at=1", "planner.dt.x=1", "faults.7=1")
        ),
    ],
)
def test_override_that_leads_nowhere_is_refused(override, said):
    with pytest.raises(ScenarioError, match=said):
        document.read("panda-circle", [override])


def test_paths_of_a_file_are_relative_to_its_folder(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text("[robot]\nname = 'panda'\n")
    found = document.read(str(file))
    assert (found.name, found.folder) == ("mine", tmp_path)
