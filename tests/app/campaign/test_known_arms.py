"""Arms of a campaign are read once, and a copy for another process begins without any."""

import pickle
from pathlib import Path

from ftqp.app.campaign.episode_study import KnownArms
from ftqp.app.schema.reading import read
from ftqp.app.schema.robot_section import RobotTable


def table(**keys):
    return read(RobotTable, {"name": "planar"} | keys, "the robot has errors:")


def test_same_table_gives_the_same_arm_and_another_one_another():
    arms = KnownArms()
    first = arms(table(), Path())
    assert arms(table(), Path()) is first
    assert arms(table(acceleration=3.0), Path()) is not first
    assert pickle.loads(pickle.dumps(arms))(table(), Path()) is not first
