"""The motion of a run as a trajectory that a joint trajectory controller of ros2_control executes.

The points are those of the simulated arm: q and v at each tick and the acceleration that was commanded then,
which is what the controller's quintic splines take. It wants the names of its own joints, times that rise,
and a last point at rest.
"""

import csv
from pathlib import Path

import numpy as np

from ftqp.core.errors import InputError
from ftqp.sim.export.ros_bag import NANOSECONDS, RosBag, Ticks
from ftqp.sim.log.log_rows import LogRows
from ftqp.sim.log.table_files import Told, silent, whole_folder

TOPIC = "/joint_trajectory_controller/joint_trajectory"
"""Where the controller listens under its usual name."""
KIND = "trajectory_msgs/msg/JointTrajectory"
CSV_FILE = "trajectory.csv"
MOST_POINTS = 1_000_000
"""Points of a trajectory: one message holds all of them."""
AT_REST = 1e-6
"""A joint slower than this stands [rad/s or m/s]."""


def write_trajectory(rows: LogRows, folder: str | Path, notify: Told = silent) -> float:
    """The motion of a run in a new bag with one message, and beside it as ``trajectory.csv``: t, q, v, a."""
    ticks = Ticks(rows)
    if rows.count > MOST_POINTS:
        raise InputError(
            f"{rows.title} has {rows.count} ticks, expected at most {MOST_POINTS} for a trajectory, which is "
            "one message; write CSV"
        )
    times, points = [], []
    for block in rows.blocks():
        now = ticks.of(block)
        times.append(now.nanoseconds)
        points.append(np.ascontiguousarray(np.stack([now["q"], now["v"], now["a"]], axis=1)))
    moments, motion = np.concatenate(times), np.concatenate(points)
    if not np.isfinite(motion).all():
        first = int(np.argmin(np.isfinite(motion).all(axis=(1, 2))))
        raise InputError(
            f"{rows.title} has a position, velocity or acceleration that is not finite at tick {first}; no "
            "controller takes that"
        )
    if (np.diff(moments) <= 0).any():
        raise InputError(f"{rows.title} has times that do not rise, which no controller takes")
    with whole_folder(folder) as part:
        with RosBag(part, {}) as bag:
            make = bag.message
            after = [
                make("builtin_interfaces/msg/Duration", sec=int(s), nanosec=int(ns))
                for s, ns in zip(*np.divmod(moments - moments[0], NANOSECONDS), strict=True)
            ]
            message = make(
                KIND,
                header=make(
                    "std_msgs/msg/Header",
                    stamp=make("builtin_interfaces/msg/Time", sec=0, nanosec=0),
                    frame_id="",
                ),
                joint_names=list(ticks.joints),
                points=[
                    make(
                        "trajectory_msgs/msg/JointTrajectoryPoint",
                        positions=q,
                        velocities=v,
                        accelerations=a,
                        effort=np.empty(0),
                        time_from_start=time,
                    )
                    for time, (q, v, a) in zip(after, motion, strict=True)
                ],
            )
            bag.write(bag.topic(TOPIC, KIND), 0, bag.serialised(message))
        notify(0.5)
        with (part / CSV_FILE).open("x", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(["t", *(f"{group}.{joint}" for group in "qva" for joint in ticks.joints)])
            seconds = ((moments - moments[0]) / NANOSECONDS).tolist()
            writer.writerows(
                [t, *row] for t, row in zip(seconds, motion.reshape(len(motion), -1).tolist(), strict=True)
            )
        notify(1.0)
    return float(np.abs(motion[-1, 1]).max())
