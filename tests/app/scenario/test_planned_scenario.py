"""A scenario led by a plan begins where the plan does, goes its way, and refuses plans of something else."""

import json

import numpy as np
import pytest
from tests.app.conftest import invoke

import ftqp
from ftqp.app.commands.covering import healthy_motion, task_of
from ftqp.app.run import runs
from ftqp.app.scenario.setup import load
from ftqp.core.errors import ScenarioError

LINE = "planar3-line"


@pytest.fixture(scope="module")
def plan_file(tmp_path_factory):
    setup = load(LINE, ["faults="])
    knobs = ftqp.analysis.PlanSettings(waypoints=40, spacing=0.1)
    file = tmp_path_factory.mktemp("plans") / "line.npz"
    ftqp.analysis.plan(setup.robot, task_of(setup), settings=knobs).save(file)
    return file


@pytest.mark.long
def test_a_lock_that_ends_the_motion_of_least_speed_is_survived_on_the_plan(plan_file, tmp_path):
    without = runs.run(load(LINE), tmp_path / "without", drawn=False).summary
    planned = load(LINE, plan=plan_file)
    assert np.array_equal(planned.q, ftqp.analysis.load_plan(plan_file).q[0])
    led = runs.run(planned, tmp_path / "with", drawn=False).summary
    assert not without["completed"]
    assert led["completed"] and led["max_position_error"] < 1e-3


@pytest.mark.long
def test_the_healthy_run_on_a_plan_is_the_plan(plan_file):
    setup = load(LINE, ["faults="], plan=plan_file)
    task, q = healthy_motion(setup)
    plan = ftqp.analysis.load_plan(plan_file, setup.robot, task)
    assert np.abs(q - plan.q).max() < 0.01
    poses = np.stack([setup.robot.pose(row) for row in q])
    assert np.abs(poses[:, :2, 3] - task.goals[:, :2, 3]).max() < 1e-4


def test_the_resolved_scenario_names_its_plan_and_a_scheme_that_it_can_lead(plan_file):
    setup = load("zhang7-short", ["planner.dt=0.01"])
    assert setup.planner.scheme.name == "mvn"
    again = load(LINE, ["planner.scheme="], plan=plan_file)
    assert again.planner.scheme.name == "rmp"
    assert again.content["planner"]["plan"] == str(plan_file)


def test_a_plan_of_one_hand_is_made_and_leads_the_whole_robot(tmp_path):
    file, scenario = tmp_path / "hand.npz", tmp_path / "hands.toml"
    scenario.write_text(
        '[robot]\nname = "dual_panda"\n[planner]\ndt = 0.02\nscheme = "rmp"\n'
        '[path]\nkind = "line"\ndisplacement = [0.0, 0.03, 0.03]\nduration = 0.4\n'
    )
    made = ["plan", str(scenario), "-o", str(file), "--method", "constant", "--start", "given"]
    assert invoke(*made).exit_code == 0
    planned = ftqp.analysis.load_plan(file)
    assert planned.joints == tuple(f"left_joint{k}" for k in range(1, 8))
    setup = load(scenario, plan=file)
    assert setup.planner.plan is not None and setup.q.shape == (14,)
    assert np.array_equal(setup.q[:7], planned.q[0]) and np.array_equal(setup.q[7:], setup.robot.neutral[7:])
    summary = runs.run(setup, tmp_path / "run", drawn=False).summary
    assert summary["completed"] and summary["max_position_error"] < 5e-3


@pytest.mark.parametrize(
    ("scenario", "overrides", "said"),
    [
        ("panda-y-line", [], "the plan is for another robot"),
        (LINE, ["path.duration=5.0"], "the plan is for another path"),
        (LINE, ["planner.scheme=mvn"], "leads to no posture"),
    ],
)
def test_a_plan_of_something_else_is_refused(plan_file, scenario, overrides, said):
    with pytest.raises(ScenarioError) as raised:
        load(scenario, overrides, plan=plan_file)
    assert any(said in error for error in raised.value.errors)


@pytest.mark.long
def test_run_takes_a_plan_and_says_in_a_sentence_that_there_is_none(plan_file, tmp_path):
    done = invoke("run", "--no-figures", LINE, "--plan", plan_file, "--out", tmp_path / "a", "--json")
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["completed"]
    missing = invoke("run", "--no-figures", LINE, "--plan", "no.npz", "--out", tmp_path / "b")
    assert missing.exit_code == 2 and "does not exist" in missing.output
    assert not (tmp_path / "b").exists()
