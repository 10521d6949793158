"""The ways in: sizes are checked, and the batch does to every record what the loop does."""

import numpy as np
from records import inputs

import ftqp
from ftqp.kernel.entry import entries as entry
from ftqp.kernel.layout import enums as codes
from ftqp.kernel.layout.record import record

DT = 0.002


def panda_records(count, **options):
    """Planner records of a Panda, ready to step, and their start states."""
    robot, rng = ftqp.robots.load("panda"), np.random.default_rng(2)
    W, q = record(count), np.empty((count, 7))
    for r in range(count):
        q[r] = robot.neutral + rng.uniform(-0.05, 0.05, 7)
        planner = ftqp.Planner(robot, DT, **options)
        planner.reset(q[r])
        W[r] = planner._record[0]
    return robot, W, q


def test_batch_equals_the_loop_to_rounding_with_faults():
    """Not bit for bit: the compiler may contract the two entry points differently."""
    count, ticks = 6, 150
    robot, W, q = panda_records(count, scheme="dlsm")
    loop, ql, vl = W.copy(), q.copy(), np.zeros((count, 7))
    v, targets = np.zeros((count, 7)), np.empty((ticks, codes.TARGET_SIZE))
    aim = ftqp.Target(pose=robot.pose(robot.neutral))
    for k in range(ticks):
        aim.position[2] += 2e-4
        targets[k] = aim.packed
    events = np.array([[-1, 0, 0], [2, 40, codes.BRAKING], [0, 0, codes.BRAKING], [3, 80, codes.INSTANT],
                       [5, 60, codes.FREE], [6, 149, codes.BRAKING]])  # fmt: skip
    rates, worst, counts = np.full(count, 2.0), np.zeros((count, 2)), np.zeros((count, 7), dtype=np.int64)
    entry.batch(W, q, v, targets, events, rates, worst, counts)

    statuses = np.zeros((count, 7), dtype=np.int64)
    largest = np.zeros((count, 2))
    for r in range(count):
        one = loop[r : r + 1]
        for k in range(ticks):
            joint, at, fault = events[r]
            if joint >= 0 and at == k:
                one["fault"][0, joint], one["lock_rate"][0, joint] = fault, rates[r]
                one["lock_velocity"][0, joint], one["warm"] = 1e300, 0
            code = entry.step(*inputs(one, ql[r], vl[r], targets[k]))
            statuses[r, code] += 1
            largest[r] = np.maximum(largest[r], (one["position_error"][0], one["rotation_error"][0]))
            ql[r], vl[r] = one["q_command"][0, :7], one["v_command"][0, :7]
    assert np.abs(q - ql).max() < 1e-13 and np.abs(v - vl).max() < 1e-11
    assert np.abs(worst - largest).max() < 1e-12 and np.array_equal(counts, statuses)
    assert np.all(counts.sum(axis=1) == ticks)
    assert v[1, 2] == 0.0 and v[2, 0] == 0.0 and v[3, 3] == 0.0 and v[0].any()


def test_wrong_sizes_and_a_missing_reset_are_told_apart():
    robot, W, q = panda_records(1)
    aim, v, start = ftqp.Target(pose=robot.pose(q[0])).packed, np.zeros(7), q[0].copy()
    assert entry.step(*inputs(W, start, v, aim)) == codes.OK
    assert entry.step(*inputs(W, start, v, aim)[:4], 6) == codes.WRONG_SHAPE
    place = ftqp.Target(position=[0.3, 0.0, 0.5]).packed
    assert entry.step(*inputs(W, start, v, place)) == codes.NO_ROTATION
    W["is_reset"] = 0
    assert entry.step(*inputs(W, start, v, aim)) == codes.NOT_RESET
