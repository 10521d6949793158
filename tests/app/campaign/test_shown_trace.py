"""What the checker is shown of a run: the rows of the task by name, and a tip that is off its target."""

import numpy as np
import pytest

from ftqp.app.campaign.shown_trace import model_file, trace
from ftqp.app.scenario.setup import load
from ftqp.checker.checked_run import verdict
from ftqp.checker.run_laws import errors
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
