"""Each law on a run made by hand: a sound one breaks none, and a single wrong number breaks its law alone."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from tests.checker.panda_runs import ARM, ROBOT, places_of, trace_of

from ftqp.checker.checked_run import verdict
from ftqp.checker.claim_laws import rotation_vectors
from ftqp.checker.model_file import ModelFile
from ftqp.checker.trace import PHYSICS, Failure, Plane
from ftqp.core.errors import InputError
from ftqp.model import catalog

DT, TICKS, JOINT = 0.01, 400, 3
NEVER = float("inf")


def run(amplitude=0.02, **changes):
    """Every joint swings gently for two seconds and then rests, the target being where the tip is."""
    t = DT * np.arange(TICKS + 1)
    w = 2.0 * np.pi
    v = amplitude * w * np.outer(np.where(t < 2.0, np.sin(w * t), 0.0), np.ones(ROBOT.nv))
    q = places_of(v, DT)
    trace = trace_of(
        q,
        v,
        DT,
        status=["OK"] * TICKS,
        target=ARM.tips(q[:-1]),
        rows=("x", "y", "z", "rx", "ry", "rz"),
        tolerance=(1e-3, 1e-2),
    )
    return replace(trace, **changes)


def changed(array, tick, joint, value):
    result = array.copy()
    result[tick, joint] = value
    return result


def test_sound_run_breaks_no_law():
    seen = verdict(ARM, run(can_be_followed=True))
    assert seen.breaches == ()
    assert seen.largest_error < 1e-12 and seen.rms_error <= seen.largest_error


def test_arm_of_the_file_is_the_robot():
    assert ARM.names == ROBOT.joints
    for name in ("q_min", "q_max", "v_max", "a_max", "tau_max"):
        np.testing.assert_array_equal(getattr(ARM, name), getattr(ROBOT.limits, name))
    q, v = ROBOT.neutral, np.linspace(-0.5, 0.5, ROBOT.nv)
    np.testing.assert_allclose(ARM.tips(q[None])[0], ROBOT.pose(q), atol=1e-12)
    tau = ROBOT.mass_matrix(q) @ (2.0 * v) + ROBOT.bias(q, v)
    np.testing.assert_allclose(ARM.torques(q[None], v[None], 2.0 * v[None])[0], tau, atol=1e-9)


def test_joint_without_end_has_no_limits_and_the_right_tip():
    robot = catalog.load("planar", count=3, continuous=True)
    arm = ModelFile.read(robot.to_urdf(), robot.tip, gravity=robot.chain.gravity)
    assert np.isinf(arm.q_max).all()
    q = np.array([[4.0, -5.0, 6.0]])
    np.testing.assert_allclose(arm.tips(q)[0], robot.pose(q[0]), atol=1e-12)


@pytest.mark.parametrize(
    "source", ["<robot", "<mujoco/>", ROBOT.to_urdf().replace("panda_hand_tcp", "other")]
)
def test_file_that_is_no_such_arm_is_refused(source):
    with pytest.raises(InputError, match="the model file is"):
        ModelFile.read(source, ROBOT.tip)


TOP = float(ROBOT.limits.v_max[JOINT])
END = float(ROBOT.limits.q_max[JOINT])


@pytest.mark.parametrize(
    ("law", "change"),
    [
        ("speed", lambda r: {"v": changed(r.v, 100, JOINT, TOP * (1.0 + 1e-8))}),
        (
            "acceleration",
            lambda r: {"v": changed(r.v, 100, JOINT, r.v[99, JOINT] + 1.1 * DT * ARM.a_max[JOINT])},
        ),
        ("position", lambda r: {"q": changed(r.q, 100, JOINT, END + 1e-8)}),
        ("braking", lambda r: {"q": changed(r.q, 30, JOINT, END - 1e-6)}),
        ("inside", lambda r: {"q": changed(r.q, 100, JOINT, END + 1e-8)}),
        ("honesty", lambda r: {"target": r.target + 0.01 * np.eye(4, k=3)}),
        ("tracking", lambda r: {"target": r.target + 0.01 * np.eye(4, k=3), "can_be_followed": True}),
        ("obedience", lambda r: {"sent_q": r.sent_q + 0.05}),
        ("rest", lambda r: {"q": r.q + 0.01 * np.sin(20.0 * DT * np.arange(TICKS + 1))[:, None]}),
        ("finite", lambda r: {"sent_v": changed(r.sent_v, 7, JOINT, np.nan)}),
        ("finite", lambda r: {"q": changed(r.q, 7, JOINT, np.inf)}),
    ],
)
def test_wrong_number_breaks_its_law(law, change):
    trace = run()
    seen = verdict(ARM, replace(trace, **change(trace)))
    assert law in seen.laws
    assert law in str(seen.breaches[0]) or len(seen.breaches) > 1


def test_rotation_vectors_are_those_of_pinocchio_up_to_half_a_turn():
    axes = np.random.default_rng(1).normal(size=(60, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    angles = np.concatenate([np.logspace(-12, 0.49, 55), np.pi - np.logspace(-9, -1, 5)])
    R = np.array([pin.exp3(angle * axis) for angle, axis in zip(angles, axes, strict=True)])
    np.testing.assert_allclose(rotation_vectors(R), [pin.log3(one) for one in R], rtol=1e-9, atol=1e-15)
    assert (rotation_vectors(np.eye(3)[None]) == 0.0).all()


def test_of_a_tool_axis_its_direction_alone_counts():
    trace = run(axis=(0.0, 0.0, 1.0), rows=("x", "y", "z", "rx", "ry"))
    for turned, laws in (([0.0, 0.0, 0.5], set()), ([0.02, 0.0, 0.5], {"honesty"})):
        turn = np.eye(4)
        turn[:3, :3] = pin.exp3(np.array(turned))
        assert verdict(ARM, replace(trace, target=trace.target @ turn)).laws == laws


def test_target_counts_for_tracking_as_long_as_it_is_known_to_be_followable():
    trace = run()
    target = trace.target.copy()
    target[150:, 0, 3] += 0.01
    for until, laws in ((1.5, set()), (1.6, {"tracking"})):
        late = replace(trace, target=target, status=["RELAXED"] * TICKS, can_be_followed=True, until=until)
        assert verdict(ARM, late).laws == laws


def turning(drift):
    """While the target rests, two joints move on and a third turns half-way, by 0.3 rad/s at most."""
    trace = run()
    t = DT * np.arange(TICKS + 1)
    q = trace.q.copy()
    q[:, :2] += drift * t[:, None]
    q[:, JOINT] += 0.3 / np.pi * np.sin(np.pi * t)
    target = np.repeat(trace.target[:1], TICKS, axis=0)
    return verdict(ARM, replace(trace, q=q, target=target), PHYSICS).laws


def test_joint_that_turns_on_the_way_of_an_arm_does_not_swing_and_one_that_turns_alone_does():
    assert "rest" not in turning(0.5)
    assert "rest" in turning(0.02)


def test_torque_that_nothing_keeps_within_its_limit_breaks_the_law_under_ok_alone():
    weak = ModelFile.read(ROBOT.with_limits(tau_max=5.0).to_urdf(), ROBOT.tip)
    assert verdict(weak, run()).laws == {"torque"}
    assert verdict(weak, run(status=["RELAXED"] * TICKS)).laws == set()


@pytest.mark.parametrize("which", ["q", "sent_v"])
def test_locked_joint_that_moves_or_is_sent_to_move_is_found(which):
    trace = run()
    t = DT * np.arange(TICKS + 1)
    still = {name: getattr(trace, name).copy() for name in ("q", "v", "sent_q", "sent_v")}
    still["q"][t >= 1.0, JOINT], still["v"][t >= 1.0, JOINT] = still["q"][100, JOINT], 0.0
    still["sent_q"][99:, JOINT], still["sent_v"][99:, JOINT] = still["q"][100, JOINT], 0.0
    lock = Failure(joint=JOINT, kind="locked", since=1.0, reported_at=1.0, jumps=True)
    sound = replace(trace, **still, failures=[lock], target=ARM.tips(still["q"][:-1]))
    assert verdict(ARM, sound).laws == set()
    moved = getattr(sound, which).copy()
    moved[150:, JOINT] += 1e-9
    assert verdict(ARM, replace(sound, **{which: moved})).laws == {"failed"}


@pytest.mark.parametrize(("kind", "outside", "laws"), [("free", True, set()), ("free", False, {"speed"})])
def test_blow_of_a_free_joint_on_its_end_stop_is_not_the_other_joints_doing(kind, outside, laws):
    trace = run()
    q, v = trace.q.copy(), trace.v.copy()
    fallen = ARM.q_max[1] + (0.05 if outside else -0.5)
    q[100:, 1], v[100:151, 1], v[151:, 1] = fallen, 2.0, 0.0
    v[151, JOINT] = 3.0 * TOP
    swings = Failure(joint=1, kind=kind, since=0.9, reported_at=1.0)
    shaken = replace(trace, q=q, v=v, failures=[swings], status=["STOPPED"] * TICKS)
    assert verdict(ARM, shaken, PHYSICS).laws - {"braking"} == laws


def lock_with(sent, **changes):
    """A joint that locks at 1 s, of which the planner is told at 2 s; what it is sent from then on."""
    t = DT * np.arange(TICKS + 1)
    trace = run()
    still = {name: getattr(trace, name).copy() for name in ("q", "v", "sent_q", "sent_v")}
    still["q"][t >= 1.0, JOINT], still["v"][t >= 1.0, JOINT] = still["q"][100, JOINT], 0.0
    still["sent_v"][99:199, JOINT] = 0.03
    still["sent_v"][199:, JOINT] = sent
    lock = Failure(joint=JOINT, kind="locked", since=1.0, reported_at=2.0, **changes)
    return replace(trace, **still, failures=[lock], status=["LAGGING"] * TICKS)


def test_planner_that_is_told_late_may_bring_its_command_to_rest_as_the_fault_says():
    ramp = np.maximum(0.03 - 0.5 * DT * np.arange(TICKS - 199), 0.0)
    assert verdict(ARM, lock_with(ramp, deceleration=0.5)).laws == set()
    assert verdict(ARM, lock_with(ramp + 1e-6, deceleration=0.5)).laws == {"failed"}
    assert verdict(ARM, lock_with(ramp)).laws == {"failed"}


def test_lock_that_another_failure_replaces_is_over():
    trace = lock_with(0.0, deceleration=0.5, until=3.0)
    moved = trace.q.copy()
    moved[350:, JOINT] += 1e-9
    assert verdict(ARM, replace(trace, q=moved)).laws <= {"obedience"}
    moved[250:, JOINT] += 1e-9
    assert "failed" in verdict(ARM, replace(trace, q=moved)).laws


def test_weakened_joint_has_its_lower_limits_once_the_planner_knows():
    fast = float(np.abs(run().v).max())
    share = {"v_max": 0.9 * fast / TOP}
    late = Failure(joint=JOINT, kind="degraded", since=0.0, reported_at=0.0, shares=share)
    assert verdict(ARM, run(failures=[late])).laws == {"speed"}
    never = Failure(joint=JOINT, kind="degraded", since=0.0, reported_at=NEVER, shares=share)
    assert verdict(ARM, run(failures=[never])).laws == set()


def test_error_band_is_as_wide_as_the_noise_of_the_encoders_makes_it():
    trace = run(sent_q=run().q[1:] + 0.023)
    assert verdict(ARM, trace, PHYSICS).laws == {"obedience"}
    assert verdict(ARM, trace, replace(PHYSICS, noise=1e-3)).laws == set()


def test_claim_may_be_wrong_for_the_time_that_is_let_pass():
    trace = run()
    for ticks, laws in ((8, set()), (20, {"honesty"})):
        target = trace.target.copy()
        target[100 : 100 + ticks, 0, 3] += 0.01
        assert verdict(ARM, replace(trace, target=target), PHYSICS).laws == laws


@pytest.mark.parametrize(("share", "laws"), [(1.0, set()), (0.8, {"position"})])
def test_joint_whose_limits_have_shrunk_may_pass_its_end_while_it_brakes_fully(share, laws):
    """Also in the tick in which it comes to rest and turns."""
    weak = Failure(
        joint=JOINT, kind="degraded", since=0.0, reported_at=0.0, shares={"v_max": 1.0, "a_max": 0.5}
    )
    step = DT * 0.5 * ROBOT.limits.a_max[JOINT] * share
    t = np.arange(TICKS + 1)
    speed = np.maximum((20.8 - t) * step, -0.2 * step)
    trace = run(amplitude=0.0, failures=[weak], status=["RELAXED"] * TICKS)
    v, q = trace.v.copy(), trace.q.copy()
    v[:, JOINT] = speed
    q[:, JOINT] = (
        END - 10.0 * DT * step + np.concatenate([[0.0], np.cumsum(0.5 * DT * (speed[1:] + speed[:-1]))])
    )
    assert q[:, JOINT].max() > END
    seen = verdict(ARM, replace(trace, q=q, v=v, sent_q=q[1:], sent_v=v[1:]))
    assert seen.laws & {"position", "acceleration", "speed"} == laws


def elbow(room, joint=JOINT, trace=None):
    """A plane that the origin of a joint's frame keeps a distance from in the sound run, at the nearest."""
    q = run().q if trace is None else trace.q
    at_zero = pin_place(np.zeros(ROBOT.nv), joint)
    nearest = min(pin_place(one, joint)[2] for one in q)
    return Plane(joint=joint, at_zero=at_zero, normal=(0.0, 0.0, 1.0), offset=nearest - room)


def pin_place(q, joint):
    data = ROBOT.model.createData()
    pin.forwardKinematics(ROBOT.model, data, q)
    return data.oMi[joint + 1].translation.copy()


def test_point_on_its_side_of_a_plane_is_let_pass_and_one_beyond_is_found():
    assert verdict(ARM, run(planes=[elbow(0.0), elbow(0.1)])).laws == set()
    seen = verdict(ARM, run(planes=[elbow(0.1), elbow(-0.001)]))
    assert seen.laws == {"plane"}
    (breach,) = seen.breaches
    assert breach.joint == ROBOT.joints[JOINT] and breach.size == pytest.approx(0.001 - 2e-5, abs=1e-6)
    assert "a point that it moves is beyond its plane" in str(breach)


def test_point_that_begins_beyond_its_plane_may_come_back_but_not_go_on():
    whole, half = run(), 40  # every joint turns one way until then
    trace = replace(
        whole,
        **{name: getattr(whole, name)[: half + 1] for name in ("q", "v")},
        **{name: getattr(whole, name)[:half] for name in ("sent_q", "sent_v", "status", "target")},
    )
    first, last = pin_place(trace.q[0], JOINT), pin_place(trace.q[-1], JOINT)
    way = (last - first) / np.linalg.norm(last - first)
    back = Plane(joint=JOINT, at_zero=elbow(0.0).at_zero, normal=way, offset=way @ first + 0.5)
    assert verdict(ARM, replace(trace, planes=[back])).laws == set()
    away = replace(back, normal=-way, offset=-way @ first + 0.5)
    assert verdict(ARM, replace(trace, planes=[away])).laws == {"plane"}
    there_and_back = replace(back, offset=way @ last - 1e-4)
    assert verdict(ARM, replace(whole, planes=[there_and_back])).laws == {"plane"}


@pytest.mark.parametrize(("joint", "laws"), [(JOINT - 1, set()), (JOINT + 1, {"plane"})])
def test_point_that_a_freely_swinging_joint_moves_is_not_judged(joint, laws):
    free = Failure(joint=joint, kind="free", since=0.0, reported_at=NEVER)
    assert verdict(ARM, run(planes=[elbow(-0.001)], failures=[free])).laws == laws


def test_points_are_where_pinocchio_says_also_beyond_a_joint_without_end():
    robot = catalog.load("planar", count=3, continuous=True)
    arm = ModelFile.read(robot.to_urdf(), robot.tip, gravity=robot.chain.gravity)
    zero = robot.pose(np.zeros(3))[:3, 3]
    q = np.random.default_rng(1).uniform(-9.0, 9.0, (5, 3))
    expected = [robot.pose(one)[:3, 3] for one in q]
    np.testing.assert_allclose(arm.point(q, 2, zero), expected, atol=1e-12)
    assert arm.moves_with(1) == (0, 1)
