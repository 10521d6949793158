"""A session: commands between ticks, truth and belief, the rival, and a clock that skips nothing."""

import numpy as np
import pytest

from ftqp.app.view.live_source import arms_of
from ftqp.faults.kinds import KINDS
from ftqp.model import catalog
from ftqp.sim.log.signals import HEALTHY
from ftqp.sim.session.live_session import Session
from ftqp.sim.session.session_arms import Choice
from ftqp.sim.session.session_commands import (
    Aim,
    Break,
    LookForWays,
    Pause,
    Play,
    Repair,
    Reset,
    Seek,
    Speed,
    TakeWay,
    Tell,
    Use,
)

Y_LINE = Choice(scenario="panda-y-line", overrides=("faults=",))
CIRCLE = Choice(scenario="panda-circle", overrides=("faults=",))


def made(choice=Y_LINE, *, rival=False):
    return Session(lambda wish: arms_of(wish, rival=rival), choice)


def after(session, *commands, seconds=0.004):
    for command in commands:
        session.put(command)
    session.advance(seconds)
    return session.frame


@pytest.mark.parametrize("name", catalog.names())
def test_every_joint_of_every_arm_locks_swings_weakens_and_is_repaired(name):
    session = Session(lambda wish: arms_of(wish, rival=False), Choice(scenario="panda-circle", robot=name))
    robot, dt = session.arms.robot, session.arms.arm.planner.dt
    swings = robot.has_inertia and robot.is_serial
    assert robot.nv >= 4
    for i, joint in enumerate(robot.joints):
        for kind in ("locked", "free_swinging", "degraded"):
            facts = after(session, Break(joint, kind), seconds=dt)
            if kind == "free_swinging" and not swings:
                assert ("needs one serial arm" if robot.has_inertia else "has no inertia") in facts.message
                assert not facts.truth.any() and not facts.belief.any()
                continue
            expected = np.full(robot.nv, HEALTHY)
            expected[i] = KINDS[kind].number
            np.testing.assert_array_equal(facts.truth, expected)
            np.testing.assert_array_equal(facts.belief, expected)
            assert facts.message.startswith(f"{joint} " if kind == "free_swinging" else "")
            assert kind == "free_swinging" or facts.message == ""
            assert facts.status in ("OK", "RELAXED", "STOPPING")
            facts = after(session, Repair(joint), seconds=dt)
            assert not facts.truth.any() and not facts.belief.any()
    assert session.frame.tick == robot.nv * (6 if swings else 5)


def test_locked_joint_stands_and_goes_on_after_its_repair():
    session = made()
    after(session, seconds=1.0)
    facts = after(session, Break("panda_joint6"), seconds=0.5)
    assert facts.v[5] == 0.0 and facts.status == "OK"
    assert after(session, Repair(5), seconds=0.5).v[5] != 0.0


def test_planner_is_told_after_the_delay_and_not_before():
    session = made()
    after(session, Tell("after", 0.1), Break(2), seconds=0.1)
    assert not session.frame.belief.any()
    assert after(session, seconds=0.002).belief[2] == 1


def test_telling_at_once_tells_of_what_was_kept_secret():
    session = made()
    assert not after(session, Tell("never"), Break(2), Break(4, "degraded"), seconds=0.5).belief.any()
    facts = after(session, Tell("at once"))
    np.testing.assert_array_equal(facts.belief, facts.truth)
    assert facts.truth[2] == 1 and facts.truth[4] == 3


def test_repair_before_the_delay_is_over_leaves_nothing_to_tell():
    session = made()
    after(session, Tell("after", 0.1), Break(2))
    assert not after(session, Repair(2), seconds=0.3).belief.any()


def test_arm_that_was_repaired_behind_its_planners_back_does_not_jump():
    session = made(CIRCLE)
    after(session, seconds=2.0)
    before = after(session, Tell("never"), Break(1), seconds=0.3)
    repaired = after(session, Repair(1), seconds=0.001)
    assert np.abs(repaired.q - before.q).max() < 2e-3
    assert "Back to the path" in repaired.message
    goes_on = after(session, seconds=6.0)
    assert goes_on.message == "" and goes_on.status == "OK" and goes_on.position_error < 1e-4


def test_detector_finds_what_nobody_tells():
    session = made(CIRCLE)
    facts = after(session, Tell("detector"))
    assert "begins anew" in facts.message and session.tell == "detector"
    after(session, seconds=3.0)
    facts = after(session, Break(1), seconds=1.0)
    assert facts.belief[1] == 1
    assert "without a detector" in after(session, Tell("at once")).message


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (Break("elbow"), "'elbow' is not a joint of panda"),
        (Break(2, "tired"), "'tired' is not a kind of fault of ftqp; it has locked, free_swinging, degraded"),
        (Break(2, "locked", {"glue": 1.0}), "no such setting"),
        (Break(2, "degraded", {"velocity": 2.0}), "expected a share"),
        (Repair(99), "99"),
        (Speed(0.0), "expected a factor above 0"),
        (Speed(float("nan")), "expected a factor above 0"),
        (Tell("maybe"), "'maybe' is no way to tell the planner"),
        (Tell("after", -1.0), "expected a number of seconds"),
        (Seek(1.0), "Only a replay"),
        (Play(2, -1.0), "ime of the fault"),
        (TakeWay(0), "0 are known"),
        (TakeWay(-1), "there is no way out -1"),
        (Use(robot="hal9000"), "hal9000"),
        (Use(scenario="/nowhere.toml"), "neither a file nor a bundled scenario"),
        (Use(backend="abacus"), "abacus"),
        (Use(scheme="pseudoinverse", robot="iiwa14"), "level"),
        (Use(scenario="iiwa-moving-base-locked"), "has a moving base"),
        (Use(robot="zhang7", scheme="mtn"), "inertia"),
    ],
)  # fmt: skip
def test_order_that_cannot_be_done_is_answered_in_a_sentence_and_changes_nothing(command, said):
    session, quiet = made(), made()
    facts, expected = after(session, command, seconds=0.02), after(quiet, seconds=0.02)
    assert said in facts.message and facts.message.endswith((".", ")"))
    assert session.stage == 0 and facts.tick == expected.tick
    np.testing.assert_array_equal(facts.q, expected.q)
    np.testing.assert_array_equal(facts.truth, expected.truth)


def test_another_arm_begins_at_tick_zero_with_another_stage():
    session = made()
    after(session, Break(3), seconds=0.1)
    facts = after(session, Use(robot="planar6"), seconds=0.0)
    assert (facts.stage, facts.tick, len(facts.q), facts.message) == (1, 0, 6, "")
    assert not facts.truth.any()
    facts = after(session, Use(scheme="mke"), seconds=0.01)
    assert session.arms.arm.planner.scheme.name == "mke" and session.arms.robot.name == "planar6"
    assert after(session, Use(scenario="iiwa-line"), seconds=0.0).stage == 3
    assert session.choice == Choice(scenario="iiwa-line")


def test_scenarios_own_fault_happens_and_reset_brings_it_again():
    session = made(Choice(scenario="panda-circle", overrides=("faults.0.at=0.1",)))
    assert after(session, seconds=0.2).truth[2] == 1
    assert not after(session, Reset(), seconds=0.0).truth.any()
    facts = after(session, seconds=0.2)
    assert facts.truth[2] == facts.belief[2] == 1


def test_pause_makes_no_tick_and_reset_shows_the_same_first_frame():
    session = made(rival=True)
    first = session.frame
    after(session, Break(3, "degraded"), seconds=0.1)
    paused = after(session, Pause(True), seconds=1.0)
    assert (paused.tick, paused.paused) == (50, True)
    assert session.advance(5.0) == 0
    again = after(session, Reset(), Pause(False), seconds=0.0)
    assert again.tick == 0 and not again.truth.any() and not again.belief.any()
    for name in ("q", "v", "target", "status", "position_error"):
        np.testing.assert_array_equal(getattr(again, name), getattr(first, name))
    np.testing.assert_array_equal(again.rival.q, first.rival.q)


def test_parts_of_ticks_are_kept_and_no_tick_is_lost():
    session = made()
    made_ticks = sum(session.advance(1.0 / 30.0) for _ in range(30))
    assert made_ticks == session.frame.tick == round(1.0 / session.arms.arm.planner.dt)


def test_rehearsed_failure_happens_at_its_time_and_is_the_only_one():
    session = made(Choice(scenario="panda-y-line"))
    facts = after(session, Play("panda_joint6", 0.2), seconds=0.198)
    assert facts.tick == 99 and not facts.truth.any()
    facts = after(session, seconds=1.5)
    assert facts.truth.tolist() == facts.belief.tolist() == [0, 0, 0, 0, 0, 1, 0]
    facts = after(session, Play("panda_joint1+panda_joint2", 0.0), seconds=0.01)
    assert facts.truth.tolist() == [1, 1, 0, 0, 0, 0, 0]


@pytest.mark.long
def test_hand_leads_the_tip_and_gives_the_path_back():
    session = made(CIRCLE)
    after(session, seconds=0.5)
    pose = session.arms.robot.pose(session.frame.q)
    pose[:3, 3] += (0.0, 0.1, 0.05)
    facts = after(session, Aim(pose), seconds=3.0)
    np.testing.assert_allclose(session.arms.robot.pose(facts.q), pose, atol=2e-3)
    np.testing.assert_array_equal(facts.target[:3, 3], pose[:3, 3])
    assert "Moved by hand" in facts.message
    facts = after(session, Aim(None), seconds=0.1)
    assert "Back to the path" in facts.message
    facts = after(session, seconds=5.0)
    assert facts.message == "" and facts.status == "OK"
    on_circle = facts.target[:3, 3] - session.arms.path.start[:3, 3]
    assert 1e-4 < np.linalg.norm(on_circle) < 0.2


@pytest.mark.long
def test_hand_that_points_out_of_reach_is_no_end():
    session = made(CIRCLE)
    pose = session.arms.robot.pose(session.frame.q)
    pose[:3, 3] += (3.0, 0.0, 0.0)
    facts = after(session, Aim(pose), seconds=3.0)
    assert "behind" in facts.message and np.isfinite(facts.q).all()
    facts = after(session, Aim(None), seconds=6.0)
    assert facts.status == "OK" and facts.message == ""


def test_nan_in_the_state_is_said_in_words_and_reset_recovers():
    session = made(rival=True)
    after(session, Break(3), seconds=0.1)
    session.arms.arm.plant._q[3] = np.nan
    facts = after(session, seconds=0.1)
    said = facts.message
    assert "cannot go on" in said and "panda_joint4" in said and "Reset" in said
    assert np.isfinite(facts.q).all()
    assert session.advance(1.0) == 0 and session.frame.message == said
    facts = after(session, Reset(), seconds=0.1)
    assert facts.tick == 50 and facts.status == "OK" and facts.message == ""


def test_stopped_arm_goes_on_when_it_is_resumed():
    session = made(CIRCLE, rival=True)
    after(session, seconds=2.0)
    session.arms.arm.planner.stop()
    stopped = after(session, seconds=1.0)
    assert stopped.status == "STOPPED" and "Resume tries again" in stopped.message
    still = after(session, Pause(True), seconds=1.0)
    assert still.paused and still.tick == stopped.tick
    began = after(session, Pause(False), seconds=0.01)
    assert began.status != "STOPPED" and not began.paused and "Back to the path" in began.message
    assert np.abs(began.q - stopped.q).max() < 1e-3
    later = after(session, seconds=3.0)
    assert later.status == "OK" and later.message == "" and later.rival.error < 1e-3


def test_arm_whose_failure_lasts_rests_as_near_as_it_gets_after_it_is_resumed():
    session = made(Choice(scenario="planar6-stop"))
    assert "the task error was beyond its threshold" in after(session, seconds=30.0).message
    session.put(Pause(False))
    assert "another one is looked for" in after(session, seconds=0.05).message
    rests = after(session, seconds=3.0)
    assert rests.status == "OK" and "rests as near to its goal as it gets" in rests.message
    later = after(session, seconds=1.0)
    assert later.message == rests.message and np.abs(later.q - rests.q).max() < 1e-6
    assert after(session, Reset(), seconds=0.1).status == "OK"


def test_resume_that_a_lost_sensor_forbids_says_so():
    dropped = ("faults=", "planner.detector=false", 'sensors.faults=[{kind="dropped", joint=2, at=0.1}]')
    session = made(Choice(scenario="panda-detected", overrides=dropped))
    assert after(session, seconds=0.5).status == "STOPPED"
    facts = after(session, Pause(False), seconds=0.1)
    assert facts.status == "STOPPED" and "The arm does not go on: " in facts.message
    assert "panda_joint3" in facts.message


def test_rival_is_broken_with_the_arm_and_told_what_a_person_tells():
    session = made(CIRCLE, rival=True)
    after(session, seconds=4.0)
    assert session.frame.rival.error < 1e-4 and not session.frame.rival.reported
    unreported = after(session, Tell("never"), Break(2), seconds=1.0)
    assert unreported.rival.error > 1e-5 and not unreported.rival.reported
    assert unreported.rival.q[2] == pytest.approx(unreported.q[2], abs=1e-2)
    reported = after(session, Tell("at once"), seconds=1.0)
    assert reported.rival.reported and reported.rival.error < 0.1 * unreported.rival.error
    assert not after(session, Repair(2), seconds=0.5).rival.reported


def test_rival_waits_while_a_hand_leads_and_begins_anew_beside_the_arm():
    session = made(CIRCLE, rival=True)
    after(session, Break(2), seconds=1.0)
    pose = session.arms.robot.pose(session.frame.q)
    pose[2, 3] += 0.02
    assert after(session, Aim(pose), seconds=0.5).rival is None
    back = after(session, Aim(None), seconds=4.0)
    assert "Back to the path" not in back.message
    assert back.rival is not None and back.rival.error < 5e-3


def test_rival_is_left_out_where_it_cannot_lead():
    assert made(Choice(scenario="panda-mujoco-payload"), rival=True).frame.rival is None  # it takes torques
    planar = after(made(Choice(scenario="planar6-square"), rival=True), seconds=0.5)
    assert planar.rival.error < 1e-3  # x and y only


@pytest.mark.parametrize("scenario", ["panda-mujoco-brake", "panda-mujoco-free", "modular11-locked"])
def test_every_kind_of_arm_and_leader_plays(scenario):
    session = made(Choice(scenario=scenario), rival=True)
    facts = after(session, Break(1), seconds=0.1)
    assert facts.truth[1] == facts.belief[1] == 1
    facts = after(session, Repair(1), seconds=0.1)
    assert facts.message == "" and np.isfinite(facts.q).all()
    assert (facts.rival is None) == (session.arms.arm.plant.drive == "torque")


@pytest.mark.long
def test_path_with_progress_goes_there_and_back_without_end():
    session = made(Choice(scenario="modular11-locked", overrides=("path.duration=2.0",)))
    start, end = session.arms.path.start[:3, 3], session.arms.path.sample(2.0).pose[0, :3, 3]
    reached = ["start"]
    for _ in range(400):
        at = after(session, seconds=0.1).target[:3, 3]
        for name, place in (("start", start), ("end", end)):
            if np.linalg.norm(at - place) < 1e-3 and reached[-1] != name:
                reached.append(name)
    assert reached[:4] == ["start", "end", "start", "end"]
    assert session.frame.status in ("OK", "SCALED")


def test_ways_out_are_shown_with_what_they_take_and_one_is_taken():
    session = made()
    after(session, Break(3, "locked"), seconds=1.0)
    facts = after(session, LookForWays())
    kinds = [way.kind for way in facts.ways]
    assert {"back", "home", "halt", "stop"} <= set(kinds) and "ways out are clear" in facts.message
    home = facts.ways[kinds.index("home")]
    assert home.clear and " s, motors " in home.price and home.sentence.startswith("go home")
    facts = after(session, TakeWay(kinds.index("home")), seconds=0.004)
    assert not facts.ways and "On a way out" in facts.message
    facts = after(session, seconds=8.0)
    np.testing.assert_allclose(np.delete(facts.q, 3), np.delete(home.q[-1], 3), atol=2e-3)
    facts = after(session, Aim(None), seconds=0.1)
    assert "Back to the path" in facts.message


def test_a_stopped_arm_takes_a_way_out():
    session = made()
    after(session, seconds=0.5)
    session.arms.arm.planner.stop()
    assert after(session, seconds=1.0).status == "STOPPED"
    ways = after(session, LookForWays()).ways
    after(session, TakeWay([way.kind for way in ways].index("halt")), seconds=0.02)
    assert session.frame.status not in ("STOPPED", "STOPPING")
    assert session.arms.arm.planner.stopped_because is None
