"""The arm of a run from its log, and when it is not believed."""

import numpy as np
import pytest

from ftqp.app.run.recorded_robot import recorded_robot
from ftqp.model import catalog
from ftqp.sim.log.log_rows import LogRows
from ftqp.sim.log.signals import columns

ARM = catalog.load("planar", count=3)


def rows(arm=ARM, base=None, **metadata):
    """The rows of a log whose first one is the arm at its neutral posture, on a base at ``base``."""
    signals = list(columns(ARM.joints, np.zeros(3, dtype=bool), "acceleration"))
    row = dict.fromkeys((column.name for column in signals), 0.0)
    row |= {f"q.{joint}": value for joint, value in zip(ARM.joints, arm.neutral, strict=True)}
    tip = arm.pose(arm.neutral)[:3, 3] + (0.0 if base is None else base)
    row |= {f"tip.{axis}": value for axis, value in zip("xyz", tip, strict=True)}
    if base is not None:
        from ftqp.sim.log.signals import base_columns

        signals += base_columns(("x",))
        row |= {column.name: 0.0 for column in base_columns(("x",))}
        row |= {f"base.{axis}": value for axis, value in zip("xyz", base, strict=True)}
    table = np.array([[row[column.name] for column in signals]])
    about = {"robot": "planar(3)", "joints": list(ARM.joints)} | metadata
    return LogRows(
        path=None, columns=tuple(signals), metadata=about, count=1, read=lambda first: iter([table[first:]])
    )


SCENARIO = '[robot]\nname = "planar"\noptions = {{ count = {} }}\n[later]\nunknown = 1\n'


@pytest.mark.parametrize("base", [None, np.array([0.3, -2.0, 1.0])])
@pytest.mark.parametrize("about", [{}, {"resolved": SCENARIO.format(3)}])
def test_arm_comes_from_the_scenario_or_the_catalog(about, base):
    robot, why = recorded_robot(rows(base=base, **about))
    assert why == "" and robot is not None and robot.joints == ARM.joints


@pytest.mark.parametrize(
    ("about", "message"),
    [
        ({"resolved": SCENARIO.format(4)}, "has others"),
        ({"resolved": "[robot]\nurdf = '/nowhere/x.urdf'\ntip = 'x'\n"}, "cannot be made"),
        ({"resolved": "[robot]\nname = 'panda'\nurdf = 'x'\n"}, "cannot be made"),
        ({"resolved": "[robot"}, "cannot be made"),
        ({"resolved": "robot = 3"}, "cannot be made"),
        ({"robot": "my arm"}, "does not say which arm"),
        ({"robot": None}, "does not say which arm"),
    ],
)
def test_run_of_an_unknown_arm_says_why(about, message):
    robot, why = recorded_robot(rows(**about))
    assert robot is None and message in why


def test_arm_that_has_changed_since_is_not_that_of_the_run():
    longer = catalog.load("planar", lengths=(0.4, 0.4, 0.4))
    robot, why = recorded_robot(rows(longer))
    assert robot is None and "has changed since the run" in why
