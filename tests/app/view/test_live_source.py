"""A session in its thread: readers, commands from other threads, and a clock that slows down."""

from threading import Thread
from time import sleep

import numpy as np
import pytest
from tests.waiting import until

from ftqp.app.view.live_source import LiveSource, arms_of
from ftqp.sim.session.live_session import Session
from ftqp.sim.session.session_arms import Choice
from ftqp.sim.session.session_commands import Break, Repair, Reset, Tell, Use


@pytest.fixture
def source():
    session = Session(
        lambda wish: arms_of(wish, rival=False), Choice(scenario="panda-y-line", overrides=("faults=",))
    )
    with LiveSource(session) as source:
        yield source


def test_clicks_of_two_threads_are_done_while_two_others_read(source):
    frames, failed = [], []

    def read():
        last = -1
        for _ in range(200):
            frame = source.frame()
            if frame.tick < last or len(frame.q) != len(frame.truth):
                failed.append(frame)
            last = frame.tick
            frames.append(frame)
            sleep(0.001)

    def click(joint):
        for k in range(50):
            source.put(Repair(joint) if k % 2 else Break(joint))
            sleep(0.01)  # a hundred commands a second from both together
        source.put(Break(joint))

    threads = [Thread(target=read) for _ in range(2)]
    threads += [Thread(target=click, args=(joint,)) for joint in (2, 5)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    until(lambda: source.frame().belief.tolist() == [0, 0, 1, 0, 0, 1, 0])
    assert not failed and len(frames) == 400
    np.testing.assert_array_equal(source.frame().truth, source.frame().belief)


def test_stage_follows_the_arm_and_what_is_told(source):
    assert source.stage().number == 0 and source.stage().tell == "at once"
    source.put(Tell("never"))
    until(lambda: source.stage().tell == "never")
    source.put(Use(robot="planar6"))
    until(lambda: source.frame().stage == 1)
    stage = source.stage()
    assert stage.number == 1 and stage.robot.name == "planar6" and stage.live and stage.duration is None
    assert {"panda", "planar6"} <= set(stage.robots) and "panda-circle" in stage.scenarios
    assert "active_set" in stage.backends and "mvn" in stage.schemes
    assert stage.path.shape == (121, 3)
    assert len(source.frame().q) == 6


def test_refusal_is_a_message_of_a_frame_and_reset_takes_it_away(source):
    source.put(Break("elbow"))
    until(lambda: "'elbow' is not a joint" in source.frame().message)
    source.put(Reset())
    until(lambda: source.frame().message == "")
