"""A scenario, resolved: the objects stand for what the tables say, and the bundled ones do what they tell."""

from functools import cache

import numpy as np
import pytest
from tests.app.conftest import setup_of

import ftqp
from ftqp.app.run import runs
from ftqp.app.scenario.document import bundled
from ftqp.app.scenario.setup import load
from ftqp.control import paths
from ftqp.model import catalog
from ftqp.model.payload import Payload

ENDINGS = {
    "canadarm2-wrist": (True, 2e-6),
    "dual-panda-bar": (True, 2e-5),
    "iiwa-line": (True, 5e-6),
    "iiwa-moving-base-locked": (True, 1e-5),
    "iiwa-out-of-reach": (True, 0.03),
    "iiwa-x-line": (True, 2e-6),
    "modular11-locked": (True, 2e-4),
    "modular11-singular": (True, 2e-3),
    "panda-circle": (True, 2e-6),
    "panda-degraded": (True, 3e-3),
    "panda-detected": (True, 4e-3),
    "panda-free-swinging": (True, 2e-6),
    "panda-glitches": (True, 1e-3),
    "panda-mujoco-brake": (True, 2e-3),
    "panda-mujoco-free": (True, 0.25),
    "panda-mujoco-payload": (True, 3e-3),
    "panda-unannounced": (True, 0.03),
    "panda-undetected": (True, 0.2),
    "panda-y-line": (True, 5e-3),
    "planar3-line": (False, 0.4),
    "planar3-unidentified": (False, 3.0),
    "planar6-square": (True, 4e-6),
    "planar6-stop": (False, 0.039),
    "puma-step-10": (True, 0.128),
    "puma-step-30": (True, 0.273),
    "zhang7-path": (False, 0.12),
    "zhang7-short": (True, 2e-4),
}
"""Whether each bundled scenario completes its task, and its largest position error [m]."""


RELAXED = (
    "iiwa-out-of-reach", "panda-degraded", "panda-mujoco-free", "iiwa-x-line",
    "panda-y-line", "zhang7-short", "panda-mujoco-brake", "panda-mujoco-payload",
    "panda-unannounced",
)  # fmt: skip
"""Those that complete their task though now and then a limit keeps them from it."""


def test_every_bundled_scenario_has_its_ending_told():
    assert set(bundled()) == set(ENDINGS)


@pytest.fixture(scope="module")
def summary_of(tmp_path_factory):
    """The summary of the run of a bundled scenario, which is run once and not drawn."""
    return cache(
        lambda name: runs.run(load(name), tmp_path_factory.mktemp("runs") / "out", drawn=False).summary
    )


LONG = ("panda-mujoco-free", "panda-mujoco-payload", "panda-unannounced", "panda-undetected")
"""Those that take two seconds or more beside a shorter one with the same kind of fault."""


@pytest.mark.long
@pytest.mark.parametrize(
    "name", [pytest.param(k, marks=[pytest.mark.slow] if k in LONG else []) for k in sorted(ENDINGS)]
)
def test_bundled_scenario_ends_as_it_tells(name, summary_of):
    completed, error = ENDINGS[name]
    summary = summary_of(name)
    assert summary["completed"] is completed
    assert summary["max_position_error"] <= error
    excess = dict(summary["max_limit_violation"])
    if summary.get("drive") is not None:  # what an arm in physics does may exceed its command a little
        assert excess.pop("v") <= 0.02
    assert max(excess.values()) <= 1e-9
    expected = {"OK"} if completed else {"OK", "RELAXED", "STOPPING", "STOPPED"}
    if name.startswith("puma-step"):  # the platform turns as fast as the arm's joints
        expected = {"OK", "RELAXED"}
        assert summary["inertial"]["final_position_error"] < 1e-9
    if name in RELAXED:
        expected = {"OK", "RELAXED"}
    if name == "panda-undetected":
        expected = {"OK", "LAGGING", "HELD"}
    if name == "planar3-unidentified":
        expected = {"OK", "RELAXED", "LAGGING", "HELD", "STOPPING", "STOPPED"}
    if name == "panda-glitches":
        expected = {"OK", "INVALID_INPUT"}
    if name.startswith(("dual", "modular11")):
        expected = set(summary["status_counts"]) & {"OK", "SCALED", "RELAXED"}
    assert set(summary["status_counts"]) == expected


def test_the_path_starts_where_the_arm_is_and_the_arm_at_rest_in_its_neutral_posture():
    neutral, q = setup_of(), [0.1, -0.7, 0.2, -2.2, 0.1, 1.6, 0.7]
    assert (neutral.q == neutral.robot.neutral).all() and (neutral.v == 0.0).all()
    made = setup_of(start={"q": q})
    assert np.abs(made.path.start - made.robot.pose(q)).max() < 1e-12


def test_limits_of_the_scenario_replace_those_of_the_robot():
    made = setup_of(robot={"name": "panda", "acceleration": 3.0, "limits": {"v_max": [0.1] * 7}})
    assert (made.robot.limits.v_max == 0.1).all()
    assert (made.robot.limits.a_max == 3.0).all()


def test_a_robot_may_be_a_table_of_denavit_and_hartenberg():
    made = setup_of(
        robot={
            "dh": [[0.0, 0.0, 0.5, 0.0], [0.0, 0.0, 0.5, 0.0], [0.0, 0.0, 0.5, 0.0]],
            "limits": {"q_min": -2.0, "q_max": 2.0, "v_max": 1.0, "a_max": 5.0},
        },
        planner={"task": {"rows": ["x", "y"]}},
        start={"q": [0.3, 0.5, 0.5]},
        path={"kind": "line", "displacement": [0.0, 0.1, 0.0], "duration": 1.0},
    )
    assert made.robot.nv == 3
    assert np.abs(made.path.start[2, 3]) < 1e-12


def test_a_robot_of_the_catalog_may_have_options():
    robot = {"name": "planar", "options": {"lengths": [1.0, 0.8, 0.5], "continuous": True}}
    line = {"kind": "line", "displacement": [0.0, 0.1, 0.0], "duration": 1.0}
    made = setup_of(robot=robot, planner={"task": {"rows": ["x", "y"]}}, path=line)
    assert made.robot.joints == ("j1", "j2", "j3")
    assert made.robot.continuous.all()


def test_every_drive_detects_failures_unless_the_scenario_says_false(drive):
    assert setup_of(planner={"drive": drive}).planner.diagnosis is not None
    assert setup_of(planner={"drive": drive, "detector": False}).planner.diagnosis is None


def test_a_setting_of_the_detector_before_warns():
    with pytest.warns(DeprecationWarning, match="patience of a detector: no effect any more"):
        setup_of(planner={"detector": {"patience": 0.03}})


def test_planner_is_made_as_the_scenario_says():
    made = setup_of(
        planner={
            "dt": 0.004,
            "level": "velocity",
            "scheme": {"name": "rmp", "mu": 2.0},
            "bounds": {"name": "jin", "margin": 0.05},
            "backend": {"name": "daqp"},
            "emergency": "off",
            "task": {"rows": "position", "mode": "hard", "kp": 7.0},
        }
    )
    planner = made.planner
    assert (planner.dt, planner.level, planner.backend) == (0.004, "velocity", "daqp")
    assert planner.scheme == ftqp.schemes.rmp(mu=2.0)
    assert planner.bounds == ftqp.Jin(margin=0.05)
    assert planner.emergency is None
    assert planner.task == ftqp.Task(rows="position", mode="hard", kp=7.0)


def test_a_scenario_may_name_a_closed_form():
    scheme = {"name": "singularity_robust", "rule": "exact_inf", "limit": 0.87}
    made = setup_of(planner={"dt": 0.004, "level": "velocity", "scheme": scheme})
    assert made.planner.scheme == ftqp.schemes.by_name(scheme)
    assert made.planner.backend == "active_set"
    assert "exact_inf" in made.toml


def test_faults_keep_their_announcements():
    made = setup_of(
        faults=[
            {"kind": "locked", "joint": "panda_joint4", "at": 0.5, "announced": "never"},
            {"kind": "degraded", "joint": 0, "at": 0.2, "announced": 0.3, "velocity": 0.5},
            {"kind": "free_swinging", "joint": 1, "at": 0.1, "damping": 2.0},
        ]
    )
    events = list(made.schedule)
    assert [event.at for event in events] == [0.1, 0.2, 0.5]
    assert [event.reported_at for event in events] == [0.1, 0.3, None]
    assert events[0].fault == ftqp.FreeSwinging(1, damping=2.0)
    assert events[1].fault == ftqp.Degraded(0, velocity=0.5)


@pytest.mark.parametrize(
    ("table", "kind"),
    [
        ({"kind": "square", "side": 0.1, "duration": 4.0}, paths.Square),
        ({"kind": "circle", "radius": 0.1, "duration": 4.0, "axes": ["y", [0, 0, 1]]}, paths.Circle),
        ({"kind": "lissajous", "amplitudes": [0.1, 0.05], "duration": 4.0}, paths.Lissajous),
        ({"kind": "line", "displacement": [0.1, 0, 0], "duration": 4.0, "law": "constant"}, paths.Line),
        (
            {
                "kind": "line",
                "displacement": [0.1, 0, 0],
                "duration": 4.0,
                "law": {"name": "trapezoid", "ramp": 0.1},
            },
            paths.Line,
        ),
        ({"kind": "point_to_point", "position": [0.4, 0.1, 0.4], "duration": 4.0}, paths.PointToPoint),
    ],
)
def test_every_kind_of_path_can_be_named(table, kind):
    made = setup_of(path=table)
    assert type(made.path) is kind
    assert made.duration == 4.0


def test_a_relative_goal_counts_from_the_start_pose():
    half = np.sqrt(0.5)
    made = setup_of(
        path={
            "kind": "point_to_point",
            "position": [0.0, 0.1, 0.0],
            "orientation": [0.0, 0.0, half, half],
            "relative": True,
            "duration": 1.0,
        }
    )
    start, end = made.path.start, made.path.sample(1.0).pose[0]
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert np.abs(end[:3, 3] - start[:3, 3] - [0.0, 0.1, 0.0]).max() < 1e-12
    assert np.abs(end[:3, :3] - quarter @ start[:3, :3]).max() < 1e-9


def test_waypoints_are_read_from_a_file_beside_the_scenario(tmp_path):
    (tmp_path / "points.csv").write_text("x,y,z\n0.05,0,0\n0.05,0.05,0\n")
    file = tmp_path / "points.toml"
    file.write_text(
        '[robot]\nname = "panda"\n'
        '[path]\nkind = "waypoints"\nfile = "points.csv"\nrelative = true\nduration = 2.0\n'
    )
    made = load(str(file))
    moved = made.path.sample(2.0).pose[0, :3, 3] - made.path.start[:3, 3]
    assert np.abs(moved - [0.05, 0.05, 0.0]).max() < 1e-12
    assert made.content["path"]["file"] == str(tmp_path / "points.csv")


@pytest.mark.long
def test_singular_scenario_finishes_on_its_line(summary_of, tmp_path):
    """The whole path with at most 0.05 in (1.27 mm) off it; by the clock the tool leaves it farther."""
    facts = summary_of("modular11-singular")
    assert facts["path_progress"] == 1.0 and facts["path_completed_at"] < 21.0
    assert facts["max_off_path"] <= 0.05 * 0.0254
    assert facts["blocked"] is None and facts["reference"] == "progress"
    assert set(facts["max_failed_joint_motion"].values()) == {0.0}
    slack = runs.run(
        load("modular11-singular", ["planner.task.mode=slack"]), tmp_path / "time", drawn=False
    ).summary
    assert slack["reference"] == "time" and slack["max_off_path"] > 5.0 * facts["max_off_path"]


@pytest.mark.parametrize(
    ("overrides", "led"),
    [
        ([], False),
        (["planner.task.mode=scaled"], True),
        (["planner.task.mode=scaled", "path.reference=time"], False),
        (["planner.task.mode=scaled", "path.reference=progress"], True),
    ],
)
def test_scaled_task_goes_by_progress_unless_told_otherwise(overrides, led):
    assert (load("panda-circle", overrides).follower is not None) is led


def test_stall_table_is_the_switch_of_the_escape():
    on = load("modular11-singular", ["planner.stall.patience=5.0", 'planner.stall.patterns=["random"]'])
    assert on.follower is not None and on.follower.stall == ftqp.StallEscape(
        patience=5.0, patterns=("random",)
    )
    off = load("modular11-singular", ["planner.stall=off"])
    assert off.follower is not None and off.follower.stall is None
    assert 'stall = "off"' in off.toml


def test_load_tool_and_friction_of_the_robot_are_the_planner_s_own():
    turned = [0.0, 0.0, 0.7071067811865476, 0.7071067811865476]
    made = setup_of(
        robot={
            "name": "panda",
            "payload": {"mass": 1.5, "com": [0.0, 0.0, 0.04]},
            "tool": {"position": [0.0, 0.0, 0.1], "orientation": turned},
            "viscous": 0.4,
            "coulomb": [0.1] * 7,
        }
    )
    bare = catalog.load("panda")
    T = np.array([[0.0, -1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.1], [0.0, 0.0, 0.0, 1.0]])
    loaded = bare.with_friction(viscous=0.4, coulomb=0.1).with_payload(Payload(1.5, (0.0, 0.0, 0.04)))
    q, v = bare.neutral, np.full(7, 0.2)
    np.testing.assert_allclose(made.robot.pose(q), bare.pose(q) @ T, atol=1e-12)
    np.testing.assert_allclose(made.robot.bias(q, v), loaded.bias(q, v), atol=1e-12)
    assert (made.planner.robot.coulomb == 0.1).all()
