"""A log of random numbers with every signal there can be, of joints with awkward names, and its arm."""

from functools import partial

import numpy as np
import pytest

from ftqp.control.planner.status import STATUSES
from ftqp.model.robot import Robot
from ftqp.sim.log.log_writer import LogWriter
from ftqp.sim.log.signals import Column, base_columns, columns, sensed_columns

NAMES = ("<script>alert(1)</script>", "a\"b'c, d", "Gelenk ä 手")
PRISMATIC = np.array([False, True, False])
SENSED = ("q_measured", "v_measured", "q_command", "v_command", "q_reference", "v_reference", "tau_measured")
DT = 0.125
COUNT = 700


@pytest.fixture(scope="session")
def arm():
    table = [[0.3, 0.1, 0.2, 0.5], [0.0, 0.3, 0.1, -1.2], [0.1, 0.0, 0.3, 0.4]]
    return Robot.from_dh(table, joints=NAMES, limits={"v_max": 1.0}, prismatic=[1], name="odd")


def signals(*, sensed=SENSED, base=("track", "roll"), level="acceleration"):
    found = columns(NAMES, PRISMATIC, level)
    further = (
        Column("task_error.look at <b>", "rad", ""), Column("task_error.elbow.z", "m", ""),
        Column("distance.Tisch ä", "m", ""),
    )  # fmt: skip
    base = base_columns(base) if base else ()
    return (*found, *base, *sensed_columns(sensed, NAMES, PRISMATIC), *further)


def numbers(signals, count=COUNT):
    """Times that rise, codes, unit quaternions, and numbers of all sizes with NaN among them."""
    rng = np.random.default_rng(5)
    result = rng.normal(size=(count, len(signals)))
    result[:, 0] = DT * np.arange(count)
    for k, column in enumerate(signals):
        if column.integer:
            result[:, k] = np.repeat(rng.integers(0, len(STATUSES), count // 50 + 1), 50)[:count]
        elif column.name in ("kappa", "sigma_min") or column.name.startswith("tau"):
            result[:: 3 + k % 2, k] = np.nan
        elif not column.name.startswith(("t", "base")):
            result[:, k] *= 10.0 ** rng.integers(-8, 1, count)
    places = [k for k, column in enumerate(signals) if column.name in [f"base.q{x}" for x in "xyzw"]]
    if places:
        result[:, places] /= np.linalg.norm(result[:, places], axis=1, keepdims=True)
    return result


@pytest.fixture(scope="session")
def write_to():
    """Writes a log in blocks of 100 rows into a folder; returns its file and its numbers by column."""

    def write(folder, signals, table, **metadata):
        file = folder / "log.npy"
        with LogWriter(
            file, signals, {"dt": DT, "level": "acceleration", "joints": list(NAMES)} | metadata
        ) as log:
            for first in range(0, len(table), 100):
                log.write(first, table[first : first + 100])
        return file, {column.name: table[:, k] for k, column in enumerate(signals)}

    return write


@pytest.fixture
def write(write_to, tmp_path):
    return partial(write_to, tmp_path)
