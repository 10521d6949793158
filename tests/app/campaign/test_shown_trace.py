"""What the checker is shown of a run: the rows of the task by name, and a tip that is off its target."""

import numpy as np
import pytest

from ftqp.app.campaign.judged_scenario import broken_laws
from ftqp.app.campaign.shown_trace import failures, model_file, trace
from ftqp.app.scenario.setup import load
from ftqp.checker.checked_run import verdict
from ftqp.checker.tip_errors import errors
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
    file = tmp_path / "planes.toml"
    file.write_text(PLANES, encoding="utf-8")
    setup = load(str(file))
    log = setup.simulation(log=MEMORY).run().log
    assert log["distance.table"].min() == pytest.approx(0.0, abs=2e-5)
    arm, seen = model_file(setup), trace(setup, log)
    for plane, name in zip(seen.planes, ("table", "panda_joint4"), strict=True):
        far = arm.point(log["q"], plane.joint, plane.at_zero) @ plane.normal - plane.offset
        np.testing.assert_allclose(far, log[f"distance.{name}"], atol=1e-12)
    assert judged(log, setup).laws == set()
    # What the log says of distances is not believed: without the planes the arm goes through them.
    free = load(str(file), ["constraints="]).simulation(log=MEMORY).run().log
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
