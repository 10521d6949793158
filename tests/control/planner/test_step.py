"""What a step hands out and certifies; nothing of it can be written."""

import pickle
from copy import copy, deepcopy

import numpy as np
import pytest
from tests.arm_at import arm_at
from tests.going import closed_loop, started

import ftqp
from ftqp.control.planner.planner_view import row_labels, variable_labels
from ftqp.qp import Recorder

DT = 2e-3


@pytest.fixture
def planner(panda, level):
    planner = started(panda, DT, level=level, emergency=None)
    return planner


def moving(home, speed=0.05):
    return ftqp.Target(pose=home, twist=[speed, 0, 0, 0, 0, 0])


def test_limits_that_hold_the_command_back_are_named(panda, level, home):
    """Joint 1 alone can turn the tip about the base axis; ask it for more than its velocity."""
    planner = ftqp.Planner(panda, DT, level=level, task=ftqp.Task(rows=("x", "y")), emergency=None)
    radius = float(np.hypot(*home[:2, 3]))
    *_, last = closed_loop(planner, moving(home, 0.0), 5)
    assert last.limits_active == ()
    target = ftqp.Target(pose=home)
    target.twist[1] = 20.0 * radius
    target.acceleration[1] = 2000.0 if level == "acceleration" else 0.0
    planner.reset(panda.neutral)
    step = planner.step(panda.neutral, np.zeros(7), target)
    assert "panda_joint1 upper acceleration" in step.limits_active
    v = np.zeros(7)
    v[0] = panda.limits.v_max[0]
    planner.reset(panda.neutral, v)
    step = planner.step(panda.neutral, v, target)
    assert "panda_joint1 upper velocity" in step.limits_active


def test_joint_at_its_end_names_its_position(panda, level, home):
    q = panda.neutral.copy()
    q[0] = panda.limits.q_max[0]
    target = ftqp.Target(pose=panda.pose(q))
    z = panda.pose(q)[:3, 3]
    target.twist[:2] = 0.1 * np.array([-z[1], z[0]])
    planner = started(panda, DT, level=level, emergency=None, at=q)
    step = planner.step(q, np.zeros(7), target)
    assert "panda_joint1 upper position" in step.limits_active


def test_torques_are_those_of_inverse_dynamics(planner, panda, home):
    pinocchio = pytest.importorskip("pinocchio")
    v = np.linspace(-0.2, 0.2, 7)
    planner.reset(panda.neutral, v)
    step = planner.step(panda.neutral, v, moving(home))
    expected = pinocchio.rnea(panda.model, panda.model.createData(), panda.neutral, v, step.a.copy())
    np.testing.assert_allclose(step.tau, expected, atol=1e-9 * np.abs(expected).max())


def test_torques_of_a_robot_without_inertia_are_not_numbers(srs7, level):
    planner = started(srs7, DT, level=level)
    step = planner.step(srs7.neutral, np.zeros(7), ftqp.Target(pose=srs7.pose(srs7.neutral)))
    assert np.isnan(step.tau).all() and np.isnan(step.tau_brake).all()


def test_singularity_measures_are_those_of_the_healthy_joints_and_survive_a_copy(panda, home):
    planner = started(panda, 0.001)
    planner.report(ftqp.Locked(2))
    step = planner.step(panda.neutral, np.zeros(7), ftqp.Target(pose=home))
    J = arm_at(panda, panda.neutral).J
    J[:3] /= panda.length
    s = np.linalg.svd(np.delete(J, 2, axis=1))[1]
    for one in (step, step.copy()):
        assert one.sigma_min == pytest.approx(s[-1], rel=1e-9)
        assert one.manipulability == pytest.approx(np.prod(s), rel=1e-9)
        assert one.condition == pytest.approx(s[0] / s[-1], rel=1e-9)
        assert one.kappa == 0.0
    kept = step.copy()
    before = kept.measures
    q = panda.neutral + 0.3
    planner.step(q, np.zeros(7), ftqp.Target(pose=panda.pose(q)))
    assert kept.measures == before != step.measures


def test_measures_are_those_of_the_task_rows_even_while_the_arm_stops(panda, home):
    planner = started(panda, 0.001, task=ftqp.Task(rows="position_axis"))
    running = planner.step(panda.neutral, np.zeros(7), ftqp.Target(pose=home)).measures
    bad = ftqp.Target(pose=home)
    bad.twist[0] = np.nan
    step = planner.step(panda.neutral, np.zeros(7), bad)
    assert step.status is ftqp.StepStatus.INVALID_INPUT and step.measures == running
    J = arm_at(panda, panda.neutral).J
    J[:3] /= panda.length
    J[3:] = panda.pose(panda.neutral)[:3, :3].T @ J[3:]
    assert running.sigma_min == pytest.approx(np.linalg.svd(J[:5])[1][-1], rel=1e-9)


SAID = ("q", "v", "a", "tau", "tau_brake", "task_error", "slack", "lower", "upper", "status", "code", "scale",
        "position_error", "rotation_error", "measures", "sigma_min", "manipulability", "condition", "kappa",
        "torque_excess", "certificate", "limits_active", "qp")  # fmt: skip
"""All that a step tells."""
AGAIN = [ftqp.Step.copy, copy, deepcopy, lambda step: pickle.loads(pickle.dumps(step))]


def told(step):
    return {name: np.array(x) if isinstance(x := getattr(step, name), np.ndarray) else x for name in SAID}


def on_its_way(panda, home, level):
    """A planner with a locked joint and its state, beyond what the limits allow."""
    planner = ftqp.Planner(panda, DT, level=level, emergency=None)
    planner.report(ftqp.Locked(1))
    *_, step = closed_loop(planner, moving(home, 3.0), 15)
    return planner, step.q.copy(), step.v.copy()


@pytest.mark.parametrize("again", AGAIN, ids=["method", "copy", "deepcopy", "pickle"])
def test_kept_step_tells_what_the_live_one_told_however_late_it_is_asked(panda, home, level, again):
    planner, q, v = on_its_way(panda, home, level)
    live = told(planner.step(q, v, moving(home, 3.0)))
    assert live["certificate"] is not None and live["limits_active"] and live["tau_brake"].any()
    planner, q, v = on_its_way(panda, home, level)
    kept = again(planner.step(q, v, moving(home, 3.0)))
    planner.withdraw(1)
    planner.report(ftqp.Locked(4))
    planner.report(ftqp.FreeSwinging(6))
    for k in range(3):
        assert planner.step(q + 0.1 * k, np.full(7, 0.1), ftqp.Target(pose=home)).condition > 1.0
    found = told(kept)
    for name in SAID:
        np.testing.assert_array_equal(found[name], live[name], err_msg=name)
    assert all((told(kept)[name] == live[name]).all() for name in ("tau", "tau_brake"))


@pytest.mark.parametrize("again", AGAIN[1:], ids=["copy", "deepcopy", "pickle"])
def test_planner_refuses_to_be_copied_with_one_sentence(planner, again):
    with pytest.raises(TypeError, match=r"neither copied nor pickled; make another .* step\.copy\(\)"):
        again(planner)


SLACKS = tuple(f"slack {row}" for row in ("x", "y", "z"))
EXTRA = {"hard": (), "slack": SLACKS, "lexicographic": SLACKS, "scaled": ("scale", *SLACKS)}


@pytest.mark.parametrize("mode", EXTRA)
@pytest.mark.parametrize("keeps", [False, True])
@pytest.mark.parametrize("name", ["panda", "srs7"])
def test_every_variable_and_row_has_a_name(name, keeps, mode):
    robot = ftqp.robots.load(name)
    recorder = Recorder("active_set")
    kept = [ftqp.Keep(robot.tip, above=(0.0, 0.0, -5.0), name="floor")] if keeps else None
    task = ftqp.Task(rows="position", mode=mode)
    planner = started(robot, 2e-3, task=task, backend=recorder, constraints=kept)
    planner.step(robot.neutral, np.zeros(7), ftqp.Target(pose=robot.pose(robot.neutral)))
    variables, rows = variable_labels(planner), row_labels(planner)
    recording = recorder.recording(dt=2e-3, variables=variables, rows=rows)
    assert recording.variables == (*robot.joints, *EXTRA[mode])
    torques = tuple(f"torque {joint}" for joint in robot.joints)
    rows_of_C = (torques if name == "panda" else ()) + (("keep floor",) if keeps else ())
    assert recording.rows == ("x", "y", "z", *rows_of_C)


def test_planner_counts_its_steps_from_zero(planar6):
    planner = ftqp.Planner(planar6, 0.01)
    target = ftqp.Target(pose=planar6.pose(planar6.neutral))
    assert planner.tick == -1
    for _ in range(2):
        planner.reset(planar6.neutral)
        for k in range(3):
            planner.step(planar6.neutral, np.zeros(6), target)
            assert planner.tick == k


PANDA = ftqp.robots.load("panda")
MILLISECOND = 1e-3
HIDDEN = {"jacobian", "slack", "brakes", "disturbance"}
"""Computed when they are read: arrays of the reader's own."""


def ride(drive="position", **settings):
    planner = started(PANDA, MILLISECOND, drive=drive, **settings)
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


@pytest.mark.parametrize("side", ["upper", "lower"])
@pytest.mark.parametrize("what", ["position", "velocity"])
@pytest.mark.parametrize("fault", [None, ftqp.Locked(4), ftqp.FreeSwinging(4, 2.0)])
def test_ok_is_not_said_while_a_joint_is_outside_its_limits(level, side, what, fault):
    panda, sign = ftqp.robots.load("panda"), 1.0 if side == "upper" else -1.0
    planner = ftqp.Planner(panda, 2e-3, level=level)
    if fault is not None:
        planner.report(fault)
    q, v = panda.neutral.copy(), np.zeros(7)
    if what == "position":
        q[4] = sign * (panda.limits.q_max[4] if side == "upper" else -panda.limits.q_min[4]) + sign * 0.03
    else:
        v[4] = sign * (panda.limits.v_max[4] + 0.2)
    planner.reset(q, v)
    step = planner.step(q, v, ftqp.Target(pose=panda.pose(q))).copy()
    if what == "velocity" and fault is not None:
        assert step.outside == ()  # the speed of a failed joint is nobody's command
        return
    assert step.outside == ("panda_joint5",) and step.status is ftqp.StepStatus.RELAXED
    (found,) = step.certificate.outside
    assert (found.joint, found.limit) == ("panda_joint5", f"{side} {what}")
    assert found.amount == pytest.approx(0.03 if what == "position" else 0.2)


def far_target(robot, q):
    pose = robot.pose(q).copy()
    pose[:3, 3] += (0.3, 0.1, -0.2)
    return ftqp.Target(pose=pose)


@pytest.mark.parametrize(("level", "per"), [("acceleration", "s2"), ("velocity", "s")])
def test_calm_is_not_called_singular_and_amounts_have_the_units_of_the_level(level, per):
    panda = ftqp.robots.load("panda")
    planner, said = ftqp.Planner(panda, 2e-3, level=level), []
    for step in closed_loop(planner, far_target(panda, panda.neutral), 500):
        found = step.certificate
        if found is not None and found.unreached and not found.obstacles and step.sigma_min > 0.3:
            said.append(found)
            for missing in found.unreached:
                unit = "rad" if missing.direction.startswith("r") else "m"
                assert missing.unit == f"{unit}/{per}" and f"{missing.amount:+.3g} {unit}/{per}" in str(found)
    assert said and all(found.without_bound == "calm" for found in said)
    assert "no limit, but the damping with which the arm comes to rest" in str(said[0])


@pytest.mark.parametrize(("q", "cause"), [(np.zeros(4), "singular"), (np.full(4, 0.5), "objective")])
def test_singular_is_said_of_the_direction_that_the_arm_cannot_move_in(level, q, cause):
    robot = ftqp.robots.load("planar(4)")
    planner = started(robot, 2e-3, level=level, task=ftqp.Task(rows=("x", "y"), slack=1.0, calm=False), at=q)
    twist = np.array([1e-3, 0.0, 0.0, 0.0, 0.0, 0.0])  # a straight arm cannot move along itself
    found = planner.step(q, None, ftqp.Target(pose=robot.pose(q), twist=twist)).certificate
    assert found.unreached[0].direction == "x" and not found.obstacles
    assert found.without_bound == cause
    assert ("singular" in str(found)) == (cause == "singular")


def test_joint_that_slides_is_outside_by_metres():
    table = [[0.0, 0.0, 0.4, 0.0], [0.0, 0.0, 0.3, np.pi], [0.0, 0.0, 0.0, 0.0]]  # a SCARA
    limits = {"q_min": [-2, -2, 0], "q_max": [2, 2, 0.2], "v_max": 1.0, "a_max": 5.0}
    robot = ftqp.Robot.from_dh(table, limits=limits, prismatic=[2])
    q = np.array([0.3, 0.4, 0.25])
    planner = started(robot, 2e-3, task=ftqp.Task(rows="position"), at=q)
    step = planner.step(q, None, ftqp.Target(pose=robot.pose(q)))
    (found,) = step.certificate.outside
    assert (found.joint, found.unit) == (robot.joints[2], "m") and "by 0.05 m" in str(step.certificate)


def test_relaxed_beside_a_free_swinging_joint_says_what_is_done_instead_of_the_task():
    panda = ftqp.robots.load("panda")
    planner = started(panda, 2e-3)
    planner.report(ftqp.FreeSwinging(3))
    step = planner.step(panda.neutral, None, ftqp.Target(pose=panda.pose(panda.neutral)))
    assert step.status is ftqp.StepStatus.RELAXED
    assert step.certificate.instead == (step.notice,)
    assert str(step.certificate).startswith("panda_joint4 swings freely: ")


JOINT, NOISE = 1, 1e-4


def seen_beyond(amount, sigma=0.0, *, seed=None):
    """The steps of an arm whose joint stands at its upper limit and is measured beyond it by ``amount``."""
    panda = ftqp.robots.load("panda")
    planner = ftqp.Planner(panda, MILLISECOND, noise=ftqp.Noise(q=sigma))
    q = panda.neutral.copy()
    q[JOINT] = panda.limits.q_max[JOINT]
    planner.reset(q)
    target, random = ftqp.Target(pose=panda.pose(q)), np.random.default_rng(seed)
    place, steps = q, []
    for _ in range(100):
        measured = place.copy()
        measured[JOINT] += amount
        if seed is not None:
            measured += sigma * random.standard_normal(7)
        steps.append(planner.step(measured, np.zeros(7), target).copy())
        place = steps[-1].q
    return steps


@pytest.mark.parametrize("amount", [1e-5, 1e-4, 1e-3])
def test_a_joint_measured_beyond_its_range_is_named_and_nothing_is_ok(amount):
    for step in seen_beyond(amount):
        assert step.outside == ("panda_joint2",)
        assert step.status is not ftqp.StepStatus.OK
        if step.certificate is not None:
            (found,) = step.certificate.outside
            assert found.limit == "upper position" and found.amount > 0.5 * amount


def test_noise_that_the_planner_knows_puts_no_joint_outside():
    assert not any(step.outside for step in seen_beyond(0.0, NOISE, seed=1))
    assert all(step.outside for step in seen_beyond(12.0 * NOISE, NOISE, seed=1)[:20])
