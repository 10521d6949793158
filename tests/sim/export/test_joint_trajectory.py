"""The motion of a run as a JointTrajectory, read back by mcap-ros2-support, and as CSV."""

import csv
import os

import numpy as np
import pytest
from tests.sim.export.conftest import COUNT, DT, NAMES, numbers, signals
from tests.sim.export.test_run_bag import joints, read, same_bits

from ftqp.core.errors import InputError
from ftqp.sim.export.ros_bag import TOPIC, write_trajectory
from ftqp.sim.log.log_file import open_log


def exported(file, folder):
    rows = open_log(file)
    return write_trajectory(rows, folder)


def test_one_message_holds_the_motion_bit_by_bit(write, tmp_path):
    table = numbers(signals())
    table[:, 0] += 3.0  # a run that does not begin at 0
    file, log = write(signals(), table)
    speed = exported(file, tmp_path / "bag")
    ((_, message),) = read(tmp_path / "bag")[TOPIC]
    assert list(message.joint_names) == list(NAMES)
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (0, 0)  # begin at once
    for field, group in (("positions", "q"), ("velocities", "v"), ("accelerations", "a")):
        same_bits([getattr(point, field) for point in message.points], joints(log, group))
    times = [point.time_from_start for point in message.points]
    assert [time.sec + 1e-9 * time.nanosec for time in times] == (DT * np.arange(COUNT)).tolist()
    assert speed == np.abs(joints(log, "v")[-1]).max()


def test_table_beside_it_is_the_same(write, tmp_path):
    file, log = write(signals(), numbers(signals()))
    exported(file, tmp_path / "bag")
    with (tmp_path / "bag" / "trajectory.csv").open(newline="", encoding="utf-8") as stream:
        head, *lines = csv.reader(stream)
    assert head == ["t", *(f"{group}.{name}" for group in "qva" for name in NAMES)]
    found = [[float(word) for word in line] for line in lines]
    same_bits(found, np.column_stack([log["t"], *(joints(log, group) for group in "qva")]))


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [
        ((7, 2), np.nan, "not finite at tick 7"),
    ],
)
def test_motion_that_no_controller_takes_is_refused(write, tmp_path, place, value, message):
    table = numbers(signals())
    table[place] = value
    file, _ = write(signals(), table)
    with pytest.raises(InputError, match=message):
        exported(file, tmp_path / "bag")
    assert set(os.listdir(tmp_path)) == {"log.npy", "log.json"}
