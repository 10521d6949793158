"""What is handed out can be looked at and not be written, and nobody's arithmetic moves the arm."""

import numpy as np
import pytest

import ftqp

PANDA = ftqp.robots.load("panda")
DT = 1e-3
HIDDEN = {"jacobian", "slack", "brakes", "disturbance"}
"""Computed when they are read: arrays of the reader's own."""


def ride(drive="position", **settings):
    planner = ftqp.Planner(PANDA, DT, drive=drive, **settings)
    planner.reset(PANDA.neutral)
    return planner, ftqp.Target(pose=PANDA.pose(PANDA.neutral))


def arrays(thing, name, seen=None, depth=0):
    """(dotted name, array) of every array that can be reached by public attributes."""
    seen = {} if seen is None else seen  # kept alive, so that no two have one id
    if isinstance(thing, np.ndarray):
        yield name, thing
        return
    if id(thing) in seen or depth > 4 or isinstance(thing, type) or callable(thing):
        return
    seen[id(thing)] = thing
    if isinstance(thing, dict):
        for key, value in thing.items():
            yield from arrays(value, f"{name}[{key}]", seen, depth + 1)
    elif isinstance(thing, list | tuple) and not hasattr(thing, "_fields"):
        for k, value in enumerate(thing):
            yield from arrays(value, f"{name}[{k}]", seen, depth + 1)
    elif type(thing).__module__.startswith("ftqp"):
        for attribute in dir(thing):
            if not attribute.startswith("_") and attribute not in HIDDEN:
                try:
                    value = getattr(thing, attribute)
                except (ftqp.FtqpError, AttributeError):
                    continue
                yield from arrays(value, f"{name}.{attribute}", seen, depth + 1)


def writable(thing, name):
    return sorted({where for where, array in arrays(thing, name) if array.flags.writeable})


def aliases(thing, memory):
    """Names of the arrays that are parts of a memory and can be written."""
    return [name for name, a in arrays(thing, "it") if a.flags.writeable and np.shares_memory(a, memory)]


@pytest.mark.parametrize("drive", ["position", "velocity", "torque"])
def test_nothing_of_a_step_can_be_written(drive):
    planner, target = ride(drive)
    step = planner.step(PANDA.neutral, None, target)
    for thing in (step, step.copy()):
        assert writable(thing, "step") == []
        assert len([*arrays(thing, "step")]) >= 12
    for name in ("q", "v", "a", "tau", "tau_brake", "tau_stop", "lower", "upper", "task_error"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(step, name)[0] += 0.01
    for part in step.reference:
        with pytest.raises(ValueError, match="read-only"):
            part *= 180.0 / np.pi


@pytest.mark.parametrize("name", ["q", "v", "a", "code", "status", "duration", "tau", "reference", "gain"])
def test_a_step_cannot_be_given_other_numbers(name):
    planner, target = ride()
    step = planner.step(PANDA.neutral, None, target)
    with pytest.raises(AttributeError, match=rf"step\.{name} cannot be set: .*step\.q\.copy\(\)"):
        setattr(step, name, np.ones(7))


def test_no_public_array_reaches_the_memory_of_a_planner():
    planner, target = ride(detector=ftqp.Detector())
    for _ in range(3):
        planner.step(PANDA.neutral, None, target)
    memory = planner._session._memory.view(np.uint8)
    assert aliases(planner, memory) == [] == aliases(planner._out, memory)
    path = ftqp.paths.Circle(PANDA.pose(PANDA.neutral), radius=0.05, duration=4.0)
    scaled = ftqp.Planner(PANDA, DT, task=ftqp.Task(mode="scaled"))
    follower = ftqp.PathFollower(scaled, path)
    follower.reset(PANDA.neutral)
    follower.step(PANDA.neutral, np.zeros(7))
    assert (
        writable(follower.target, "target") == [] == aliases(follower, scaled._session._memory.view(np.uint8))
    )
    slow = ftqp.Planner(PANDA, DT, level="velocity")
    task = ftqp.InertialTask(slow)
    assert not any(a.flags.writeable for a in (task.base_pose, task.error, task.setpoint))


@pytest.mark.parametrize("kind", ["planner", "scheme", "robot", "targets"])
def test_what_is_given_to_many_is_frozen(kind):
    planner, _ = ride(posture=PANDA.neutral)
    things = {
        "planner": planner.posture,
        "scheme": planner.scheme,
        "robot": [getattr(PANDA, name) for name in ("limits", "neutral", "coulomb", "continuous")],
        "targets": ftqp.Targets(np.stack([np.eye(4)] * 3)),
    }
    assert writable(things[kind], kind) == []
