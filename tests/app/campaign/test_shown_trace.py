"""What the checker is shown of a run: the rows of the task by name, and a tip that is off its target."""

import numpy as np
import pytest
from tests.judged import broken_laws
from tests.telescope import telescope

from ftqp.app.campaign.shown_trace import failures, model_file, trace
from ftqp.app.scenario.setup import load
from ftqp.checker.checked_run import verdict
from ftqp.checker.claim_laws import errors, task_errors
from ftqp.model.payload import Payload
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.loop import MEMORY, Simulation

POSE = ("x", "y", "z", "rx", "ry", "rz")


@pytest.mark.parametrize(
    ("rows", "names"),
    [
        ("pose", POSE),
        ("position", POSE[:3]),
        ("position_axis", POSE[:5]),
        (["x", "z"], ("x", "z")),
        (None, POSE),
    ],
)
def test_tip_that_is_off_is_seen_whatever_rows_the_task_has(rows, names):
    chosen = [] if rows is None else [f"planner.task.rows={rows!r}".replace("'", '"')]
    setup = load("panda-circle", ["faults=", "path.duration=0.4", "planner.dt=0.01", *chosen])
    simulation = Simulation(
        setup.planner, setup.path, q=setup.q, plant=setup.plant, duration=setup.duration, log=MEMORY
    )
    log = simulation.run().log
    seen, arm = trace(setup, log), model_file(setup)
    assert tuple(seen.rows) == names
    distance, angle = errors(arm, seen)
    measured = log["position_error"][:-1], log["rotation_error"][:-1]
    np.testing.assert_allclose(distance, measured[0], atol=1e-9)
    np.testing.assert_allclose(angle, measured[1], atol=1e-7)
    seen.target[:, :3, 3] += 0.05
    errors.cache_clear()
    assert verdict(arm, seen).laws == {"honesty"}


PLANES = """
[robot]
name = "panda"
[planner]
dt = 0.002
emergency = "off"
[path]
kind = "line"
displacement = [0.0, 0.0, -0.15]
duration = 1.0
[simulation]
duration = 1.2
[[faults]]
kind = "locked"
joint = "panda_joint2"
at = 0.4
[[constraints]]
frame = "panda_hand_tcp"
above = [0.0, 0.0, 0.4]
name = "table"
[[constraints]]
frame = "panda_joint4"
point = [0.0, 0.05, 0.0]
above = [0.0, 0.3, 0.0]
normal = [0.0, -1.0, 0.0]
"""


def ran(file, text):
    """What a scenario stands for, and the log of its run."""
    file.write_text(text, encoding="utf-8")
    setup = load(str(file))
    return setup, setup.simulation(log=MEMORY).run().log


def judged(log, setup):
    errors.cache_clear()
    return verdict(model_file(setup), trace(setup, log))


def falsified(log, **signals):
    """The same log with other numbers."""
    (table,) = log.rows.blocks()
    table = table.copy()
    for name, values in signals.items():
        table[:, log.rows.groups()[name]] = values
    return Log.of_table(None, table, log.rows.columns, log.metadata)


def test_planes_are_judged_by_the_joints_and_a_falsified_log_is_found(tmp_path):
    setup, log = ran(tmp_path / "planes.toml", PLANES)
    assert log["distance.table"].min() == pytest.approx(0.0, abs=2e-5)
    arm, seen = model_file(setup), trace(setup, log)
    for plane, name in zip(seen.planes, ("table", "panda_joint4"), strict=True):
        far = arm.point(log["q"], plane.joint, plane.at_zero) @ plane.normal - plane.offset
        np.testing.assert_allclose(far, log[f"distance.{name}"], atol=1e-12)
    assert judged(log, setup).laws == set()
    # What the log says of distances is not believed: without the planes the arm goes through them.
    free = load(str(tmp_path / "planes.toml"), ["constraints="]).simulation(log=MEMORY).run().log
    lying = falsified(log, q=free["q"], v=free["v"], a=free["a"])
    assert lying["distance.table"].min() > -2e-5
    (found,) = [one for one in judged(lying, setup).breaches if one.law == "plane"]
    assert found.joint == "panda_joint7" and found.size > 0.01
    assert broken_laws(PLANES) == {}


def test_judge_knows_what_is_true_of_the_arm_and_not_told_to_the_planner():
    pytest.importorskip("mujoco", reason='needs the extra "sim": pip install -e ".[sim]"')
    true = [
        "simulation.plant=mujoco",
        "simulation.mujoco.rotors=0.2",
        "simulation.mujoco.mass_scale=1.1",
        "simulation.mujoco.payload={mass=1.0, com=[0.0, 0.0, 0.1]}",
        "simulation.mujoco.viscous=0.4",
        "simulation.mujoco.coulomb={panda_joint2=0.3}",
        "simulation.mujoco.brake_delay=0.03",
        "simulation.mujoco.brake={panda_joint2=20.0, panda_joint1=100.0}",
    ]
    lock = 'faults=[{kind="locked", joint=%d, at=0.1, mode="%s"}]'
    setup = load("panda-circle", [*true, lock % (1, "ramp")])
    robot, arm = setup.robot, model_file(setup)
    q = robot.neutral
    known = robot.with_payload(Payload(1.0 / 1.1, (0.0, 0.0, 0.1))).mass_matrix(q)
    np.testing.assert_allclose(arm.dynamics(q, 0.0 * q)[0], 1.1 * known + 0.2 * np.eye(7), atol=1e-9)
    np.testing.assert_allclose(arm.tips(q[None])[0], robot.pose(q), atol=1e-12)
    np.testing.assert_allclose(arm.friction, robot.viscous + 0.4)
    np.testing.assert_allclose(arm.dry_friction, robot.coulomb + 0.3 * (np.arange(7) == 1))
    (slipping,) = failures(setup)
    assert slipping.closes == 0.03 and slipping.slips
    (holding,) = failures(load("panda-circle", [*true, lock % (0, "ramp")]))
    assert holding.closes == 0.03 and not holding.slips
    (fixed,) = failures(load("panda-circle", [*true, lock % (1, "instant")]))
    assert fixed.closes == 0.0 and not fixed.slips
    (exact,) = failures(load("panda-circle", [lock % (1, "ramp")]))
    assert exact.closes == 0.0 and not exact.slips


SHAPES = (
    PLANES[: PLANES.index("[[constraints]]")]
    + """
[[constraints]]
frame = "panda_hand_tcp"
inside = [[-inf, -1.0, 0.42], [inf, 1.0, inf]]
name = "cell"
[[constraints]]
frame = "panda_joint4"
axis = [-1.0, 0.0, 0.0]
along = [0.0, 0.0, 1.0]
within = 1.0
name = "cup"
"""
)


def test_boxes_and_cones_are_judged_by_the_joints_and_a_falsified_log_is_found(tmp_path):
    setup, log = ran(tmp_path / "shapes.toml", SHAPES)
    arm, seen = model_file(setup), trace(setup, log)
    assert [plane.offset for plane in seen.planes] == [-1.0, 0.42, -1.0]
    far = [arm.point(log["q"], one.joint, one.at_zero) @ one.normal - one.offset for one in seen.planes]
    np.testing.assert_allclose(np.min(far, axis=0), log["distance.cell"], atol=1e-12)
    (one,) = seen.cones
    foot, head = (
        arm.point(log["q"], one.joint, one.at_zero + k * np.array(one.axis_at_zero)) for k in (0, 1)
    )
    np.testing.assert_allclose(
        one.within - np.arccos((head - foot) @ one.along), log["distance.cup"], atol=1e-7
    )
    assert judged(log, setup).laws == set() and broken_laws(SHAPES) == {}
    angle, height = 1.0 - log["distance.cup"], 0.42 + log["distance.cell"]
    assert angle.max() > angle[0] + 0.01 and height[0] > height.min() + 0.01
    for place, changed, law in (
        (0, {"inside": [[None, None, 0.5 * (height[0] + height.min())], [None] * 3]}, "plane"),
        (1, {"within": 0.5 * (angle[0] + angle.max())}, "cone"),
    ):
        kept = list(log.metadata["constraints"])
        kept[place] = kept[place] | changed
        (table,) = log.rows.blocks()
        lying = Log.of_table(None, table, log.rows.columns, log.metadata | {"constraints": kept})
        (found,) = judged(lying, setup).breaches
        assert found.law == law and found.size > 0.004


HELD = """
[robot]
name = "dual_panda"
[planner]
dt = 0.002
task = { rows = "position" }
[path]
kind = "line"
displacement = [0.0, 0.05, -0.05]
duration = 0.5
[[tasks]]
kind = "relative"
frame = "right_hand"
to = "left_hand"
level = 0
name = "grip"
[[tasks]]
kind = "position"
frame = "left_joint4"
point = [0.0, 0.1, 0.0]
rows = "z"
level = 0
name = "elbow"
[[tasks]]
kind = "axis"
frame = "right_joint4"
axis = [0.0, 1.0, 0.0]
towards = [3.0, 0.0, 9.0]
name = "look"
"""


def test_tasks_before_the_tip_are_judged_by_the_joints_and_a_falsified_log_is_found(tmp_path):
    setup, log = ran(tmp_path / "held.toml", HELD)
    arm, seen = model_file(setup), trace(setup, log)
    assert [one.name for one in seen.held] == ["grip", "elbow"]
    for one in seen.held:
        position, rotation = task_errors(arm, log["q"], one)
        np.testing.assert_allclose(position, log[f"task_error.{one.name}"], atol=1e-9)
        assert rotation.max() < 5e-5
    assert judged(log, setup).laws == set()
    q = log["q"].copy()
    q[100:, 13] += 0.2  # the right hand turns about its own axis in the left one
    (found,) = [one for one in judged(falsified(log, q=q), setup).breaches if one.law == "tasks"]
    assert found.size == pytest.approx(0.2 / 0.05 - 1.0, rel=0.01) and found.tick >= 100
    assert "OK was claimed although a further task that counts is farther than the tolerance" in str(found)
    alone = Log.of_table(
        None, *log.rows.blocks(), log.rows.columns, log.metadata | {"tasks": log.metadata["tasks"][1:]}
    )
    assert judged(falsified(alone, q=q), setup).laws & {"tasks"} == set()
    q = log["q"].copy()
    q[100:, 1] -= 0.6  # the left elbow goes down
    assert "tasks" in judged(falsified(alone, q=q), setup).laws


SCENARIO = """
[robot]
urdf = "{file}"
tip = "tool"
[planner]
dt = 0.001
task = {{ rows = "position" }}
[start]
q = [0.3, 0.2, 0.12, 0.5, -0.05, 0.2, 0.9, 0.3]
[path]
kind = "circle"
radius = 0.05
duration = 3.0
[[faults]]
kind = "locked"
joint = "elbow"
at = 1.0
"""


def test_an_arm_with_mimic_joints_breaks_no_law_when_one_locks(tmp_path):
    file = tmp_path / "telescope.urdf"
    file.write_text(telescope(), encoding="utf-8")
    assert broken_laws(SCENARIO.format(file=file)) == {}
