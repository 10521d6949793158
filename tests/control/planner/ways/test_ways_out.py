"""Ways out: what is announced is what happens, and clear ways come first."""

import numpy as np
import pinocchio as pin
import pytest
from tests.going import closed_loop, go, started

import ftqp
from ftqp.core.errors import InputError

PANDA = ftqp.robots.load("panda")
HOME = PANDA.neutral
AWAY = np.array([0.6, -0.3, 0.4, 0.3, -0.4, 0.3, 0.2])
DT = 4e-3


def on_the_way(ticks, fault=None, at=None, joints=AWAY, **given):
    """A planner whose arm has come from home, healthy until ``at``, and where it is."""
    planner, q, v = started(PANDA, DT, remember=20.0, **given), HOME, np.zeros(7)
    fails = {at: lambda planner: planner.report(fault)}
    for step in closed_loop(ftqp.GoTo(planner, q=HOME + joints), None, ticks, events=fails, reset=False):
        q, v = step.q.copy(), step.v.copy()
    return planner, q, v


def by_kind(ways):
    return {way.kind: way for way in ways}


@pytest.mark.long
@pytest.mark.parametrize("ticks, mode", [(60, "instant"), (400, "instant"), (60, "ramp")])
def test_every_way_is_gone_as_it_was_announced_also_from_a_moving_arm(level, ticks, mode):
    fault = ftqp.Locked("panda_joint4", mode=mode)
    for kind in ("back", "back by the tip", "home", "halt", "stop"):
        planner, q, v = on_the_way(ticks, fault, at=50, level=level)
        assert (v[3] != 0.0) == (mode == "ramp")  # it still brakes
        ways = by_kind(planner.ways_out())
        assert set(ways) >= {"back", "home", "halt", "stop"}
        if kind not in ways:
            continue
        way, goto = ways[kind], ftqp.GoTo(planner, way=ways[kind])
        assert way.clear and way.arrives and way.clearance == np.inf
        steps = go(goto, q, v, longest=30.0)
        assert goto.status is ftqp.GoToStatus.REACHED
        assert np.abs(steps[-1].q - way.places[-1]).max() < 1e-3
        assert len(steps) == round(way.time / DT)
        assert not {s.status for s in steps} & {ftqp.StepStatus.STOPPING, ftqp.StepStatus.FALLBACK}


def test_way_back_passes_where_the_arm_has_come_by():
    planner, q, v = on_the_way(400)
    back = planner.ways_out()[0]
    assert back.kind == "back" and np.abs(back.places[-1] - HOME).max() < 1e-6
    steps = go(ftqp.GoTo(planner, way=back), q, v, longest=30.0)
    there = ftqp.GoTo(on_the_way(0)[0], q=HOME + AWAY)
    came = np.array([step.q.copy() for step in closed_loop(there, None, 400, reset=False)])
    off = max(np.abs(came - step.q).max(axis=1).min() for step in steps[::10])
    assert off < 0.035


def test_locked_joint_stays_where_it_is_on_every_way():
    planner, _, _ = on_the_way(200, ftqp.Locked(1, mode="instant"), at=60)
    for way in planner.ways_out():
        assert np.abs(way.places[:, 1] - planner.view().command.q[1]).max() < 1e-9
    assert planner.faults


def test_halt_posture_needs_less_of_the_motors_and_is_near():
    planner, _, _ = on_the_way(200, joints=np.array([0.0, 0.9, 0.0, 1.2, 0.0, 0.0, 0.0]))
    ways = by_kind(planner.ways_out())
    assert ways["halt"].effort < ways["stop"].effort
    assert np.abs(ways["halt"].places[-1] - ways["stop"].places[-1]).max() < 0.6 + 1e-9


def test_arm_that_stands_at_its_start_has_no_way_back_and_says_what_it_has():
    planner = started(PANDA, DT, remember=5.0, at=HOME)
    kinds = [way.kind for way in planner.ways_out()]
    assert kinds == ["home", "halt", "stop"]
    planner = started(PANDA, DT, at=HOME)
    assert [way.kind for way in planner.ways_out()] == kinds


def test_asking_changes_nothing():
    one, q, v = on_the_way(100)
    other, _, _ = on_the_way(100)
    one.ways_out()
    target = ftqp.Target(pose=PANDA.pose(q))
    a, b = one.step(q, v, target), other.step(q, v, target)
    assert np.array_equal(a.q, b.q) and np.array_equal(a.v, b.v)
    first, second = one.ways_out(), one.ways_out()
    assert all(np.array_equal(x.places, y.places) for x, y in zip(first, second, strict=True))


def test_kept_points_and_weak_motors_make_a_way_unclear_and_it_comes_last():
    table = ftqp.Keep("panda_hand_tcp", above=(0.0, 0.0, 0.3))
    planner = started(PANDA, DT, constraints=[table], at=HOME)
    down = HOME + np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    ways = planner.ways_out(home=down)
    assert ways[-1].kind == "home" and not ways[-1].clear
    weak = started(PANDA, DT, at=HOME)
    weak.report(ftqp.Degraded("panda_joint2", torque=0.3))
    stretched = np.array([0.0, 1.47, 0.0, -0.2, 0.0, 1.6, 0.8])
    ways = weak.ways_out(home=stretched)
    assert ways[-1].kind == "home" and not ways[-1].clear
    assert "does not arrive" in ways[-1].sentence or "not clear" in ways[-1].sentence


LAGS = ftqp.Drive(bandwidth=50.0, takes_velocity=False, latency=4e-3)


@pytest.mark.parametrize(("drive", "lag"), [(LAGS, 0.95), ("torque", 0.0), ("velocity", 0.0)])
def test_in_thought_an_arm_is_seen_as_its_drive_lets_it_be_seen(level, drive, lag):
    planner, q = ftqp.Planner(PANDA, 1e-3, remember=20.0, level=level, drive=drive), HOME.copy()
    planner.reset(q)
    goto = ftqp.GoTo(planner, q=HOME + AWAY)
    for k in range(400):
        if k == 250:
            planner.report(ftqp.Locked(3))
        step = goto.step(q)
        q = step.q + lag * (q - step.q)
    ways = planner.ways_out()
    assert {way.kind for way in ways} >= {"back", "home", "halt", "stop"}
    assert all(way.clear and 0.2 < way.time < 5.0 for way in ways)


def test_rows_of_ones_own_are_asked_in_thought_and_keep_the_arm_from_a_way():
    asked = []

    def fill(state, C, l, u):  # joint 1 may not go forwards
        asked.append(state.q[0])
        C[0, 0], u[0] = 1.0, 0.0

    planner = started(PANDA, DT, level="velocity", constraints=[ftqp.Rows(1, fill)], at=HOME)
    for joint, arrives in ((-0.3, True), (0.3, False)):
        asked.clear()
        home = by_kind(planner.ways_out(home=HOME + joint * np.eye(7)[0]))["home"]
        assert home.arrives is home.clear is arrives
        assert max(asked) < 1e-6 and (min(asked) < -0.29 or not arrives)
    assert planner.stopped_because is None and np.array_equal(planner.view().command.q, HOME)


def test_all_joints_locked_leave_standing_and_say_so():
    planner, _, _ = on_the_way(200)
    for joint in PANDA.joints:
        planner.report(ftqp.Locked(joint, mode="instant"))
    for way in planner.ways_out():
        assert np.abs(way.places[-1] - planner.view().command.q).max() < 1e-9
        assert way.still == "" and "nothing" in way.sentence


def test_joint_that_swings_freely_leaves_a_stop():
    planner, _, v = on_the_way(60)
    assert abs(v[5]) > 0.1
    planner.report(ftqp.FreeSwinging(5))
    assert [way.kind for way in planner.ways_out()] == ["stop"]


def test_joint_that_hangs_at_rest_is_braked_there_and_the_others_go():
    planner = started(PANDA, DT, remember=20.0, at=HOME + AWAY)
    planner.step(HOME + AWAY, None, ftqp.Target(pose=PANDA.pose(HOME + AWAY)))
    planner.report(ftqp.FreeSwinging(5))
    ways = planner.ways_out(home=HOME)
    home = by_kind(ways)["home"]
    assert home.clear and home.brakes == ("panda_joint6",)
    assert home.sentence.startswith("close the brake of panda_joint6, then go home")
    goto = ftqp.GoTo(planner, way=home)
    assert isinstance(planner.faults["panda_joint6"], ftqp.Locked)
    steps = go(goto, HOME + AWAY, np.zeros(7), longest=20.0)
    assert goto.status is ftqp.GoToStatus.REACHED and steps[0].brakes[5]
    assert np.abs(np.delete(steps[-1].q - HOME, 5)).max() < 1e-3
    assert steps[-1].q[5] == pytest.approx((HOME + AWAY)[5], abs=1e-6)


def test_an_arm_without_brakes_of_its_own_leaves_a_hanging_joint_alone():
    planner = started(PANDA, DT, drive=ftqp.Drive(kind="position", brakes="none"), at=HOME)
    planner.report(ftqp.FreeSwinging(5))
    assert [way.kind for way in planner.ways_out()] == ["stop"]
    with pytest.raises(InputError, match="is not believed to swing freely"):
        planner.brake(2)


def test_what_the_base_bears_on_a_way_is_its_weight_and_what_moves_it_and_a_halt_minds_it():
    planner, _, v = on_the_way(60, joints=np.array([0.0, 0.5, 0.0, 0.5, 0.0, 0.0, 0.0]))
    assert np.abs(v).max() > 0.2
    ways = by_kind(planner.ways_out())
    stop, halt = ways["stop"], ways["halt"]
    weight = 9.81 * sum(inertia.mass for inertia in PANDA.model.inertias)
    for way in ways.values():
        assert weight < way.force < 3.0 * weight and 0.0 < way.moment < 0.8 * way.force
        assert f"{way.force:.3g} N and {way.moment:.3g} N m" in way.sentence
    assert halt.effort < stop.effort and halt.moment < 1.2 * stop.moment


def test_base_bears_on_a_way_what_pinocchio_says_of_the_motion_that_is_made():
    planner = started(PANDA, 8e-3, at=HOME + AWAY)  # a tick of which each is looked at
    home = by_kind(planner.ways_out(home=HOME))["home"]
    goto, q, borne = ftqp.GoTo(planner, way=home), HOME + AWAY, []
    model, data = PANDA.model, PANDA.model.createData()
    while not goto.done:
        step = goto.step(q)
        q = step.q.copy()
        pin.rnea(model, data, step.q, step.v, step.a)
        wrench = data.liMi[1].act(data.f[1])
        borne.append([np.linalg.norm(wrench.linear), np.linalg.norm(wrench.angular)])
    assert len(borne) == round(home.time / 8e-3)
    assert np.max(borne, axis=0) == pytest.approx([home.force, home.moment], rel=1e-9)


def test_options_without_a_plan_are_the_clear_ways_and_a_stop():
    planner, _, _ = on_the_way(200, ftqp.Locked(3, mode="instant"), at=60)
    options = planner.options()
    assert options[0].kind == "retreat" and options[-1].kind == "stop"
    assert {one.kind for one in options} <= {"retreat", "halt", "stop"}
    assert all(one.q.shape[1] == 7 and one.sentence for one in options)


def test_bad_input_gets_a_sentence():
    planner = ftqp.Planner(PANDA, DT)
    with pytest.raises(ftqp.InputError, match=r"call planner\.reset"):
        planner.ways_out()
    planner.reset(HOME)
    with pytest.raises(ftqp.InputError, match="shape"):
        planner.ways_out(home=np.zeros(3))
    with pytest.raises(ftqp.InputError, match="remember"):
        ftqp.Planner(PANDA, DT, remember=0.0)
    with pytest.raises(ftqp.InputError, match="exactly one of pose, q and way"):
        ftqp.GoTo(planner, q=HOME, way=planner.ways_out()[0])
    with pytest.raises(ftqp.InputError, match="ways_out"):
        ftqp.GoTo(planner, way="back")
    with pytest.raises(ftqp.InputError, match="shape"):
        ftqp.GoTo(planner, HOME)
    with pytest.raises(ftqp.InputError, match=r"'solver' is not a keyword .*did you mean 'backend'"):
        ftqp.Planner(PANDA, DT, solver="osqp")


def test_a_way_of_eight_times_what_is_remembered_leads_back():
    planner, target = ftqp.Planner(PANDA, DT, remember=1.0), ftqp.Target(pose=PANDA.pose(HOME))
    for k, _ in enumerate(closed_loop(planner, target, 2000)):
        target.pose[1, 3] = 0.2 * np.sin(2e-3 * (k + 1))
    assert planner.ways_out()[0].kind == "back"


def test_way_that_comes_too_near_to_the_scene_is_not_clear_and_the_others_are_tried_in_it():
    scene = ftqp.Scene()
    beyond = HOME + np.array([1.4, 0.3, 0.0, 0.6, 0.0, 0.0, 0.0])
    scene.add("ball", ftqp.Sphere(radius=0.1, place=tuple(PANDA.pose(beyond)[:3, 3])))
    planner = started(PANDA, DT, scene=scene, remember=5.0, at=HOME)
    ways = planner.ways_out(home=beyond)
    home = by_kind(ways)["home"]
    assert ways[-1] is home and not home.clear and ways[0].clear
    assert 0.015 < home.clearance < 1.0 or home.near
    assert all(0.0 < way.clearance < 1.0 for way in ways if way.clear)


def test_way_home_leads_round_a_wall_and_is_gone_without_touching_it():
    here, home = (
        np.array([0.9, 0.3, 0.0, -1.8, 0.0, 2.1, 0.8]),
        np.array([-0.9, 0.3, 0.0, -1.8, 0.0, 2.1, 0.8]),
    )
    scene = ftqp.Scene()
    scene.add("wall", ftqp.Box(size=(0.6, 0.04, 0.9), place=(0.6, 0.0, 0.45)))
    planner = started(PANDA, DT, scene=scene, at=here)
    way = by_kind(planner.ways_out(home=home))["home"]
    assert way.clear and len(way.places) > 1 and np.abs(way.places[-1] - home).max() < 1e-9
    goto = ftqp.GoTo(planner, way=way)
    steps = go(goto, here, longest=40.0)
    assert goto.status is ftqp.GoToStatus.REACHED
    rows = np.array([step.q for step in steps])
    assert min(float(d.min()) for d in planner.distances(rows).values()) > 0.015


def test_way_is_reached_though_the_failed_joint_came_to_rest_somewhat_beside_where_it_was_foretold():
    planner, q, v = on_the_way(200, ftqp.Locked(3, mode="instant"), at=60)
    goto = ftqp.GoTo(planner, way=by_kind(planner.ways_out())["home"])
    stands = q[3] + 3e-3
    for _ in range(3000):
        q[3] = stands
        step = goto.step(q, v)
        q, v = step.q.copy(), step.v.copy()
        if goto.done:
            break
    assert goto.status is ftqp.GoToStatus.REACHED


def test_way_that_is_gone_after_another_failure_is_missed_where_that_joint_stands_off():
    """The way was tried with the joint: whoever goes it all the same is told what is missing."""
    planner, q, v = on_the_way(400, ftqp.Locked(3, mode="instant"), at=50)
    way = by_kind(planner.ways_out())["home"]
    assert way.failed == ("panda_joint4",)
    planner.report(ftqp.Locked(0, mode="instant"))
    goto = ftqp.GoTo(planner, way=way)
    go(goto, q, v)
    assert goto.status is ftqp.GoToStatus.UNREACHABLE
    assert "off their goal are panda_joint1 (locked) by 0.6 rad" in goto.sentence


def test_a_planner_of_a_class_of_ones_own_has_ways_out():
    class Mine(ftqp.Planner):
        def __init__(self, robot):
            super().__init__(robot, 1e-3)

    robot = ftqp.robots.load("panda")
    planner = Mine(robot)
    planner.reset(robot.neutral)
    assert [way.kind for way in planner.ways_out()] == ["home", "halt", "stop"]
