"""Soft tasks and kept points on a page: marks, planes, words, and the same from a log."""

import asyncio
from types import SimpleNamespace

import numpy as np
import pytest
from tests.viz.live.stepped_source import SteppedSource
from tests.viz.live.tape import messages_of
from tests.viz.live.test_live_page import controls, use

from ftqp.app.scenario.setup import load
from ftqp.app.view.replay_source import ReplaySource
from ftqp.sim.loop import MEMORY
from ftqp.sim.session.frame import FurtherFact
from ftqp.sim.session.session_commands import Place, Reset
from ftqp.viz.live.further_nodes import amount, further_table
from ftqp.viz.live.live_page import Page
from ftqp.viz.live.server import recording

SCENARIO = """
[robot]
name = "panda"
[path]
kind = "circle"
radius = 0.05
duration = 1.0
[[tasks]]
kind = "position"
frame = "panda_joint4"
rows = "z"
target = [9.0, 9.0, 0.6]
name = "elbow"
[[tasks]]
kind = "axis"
frame = "panda_hand_tcp"
towards = [0.6, 0.1, 0.0]
name = "look"
[[tasks]]
kind = "posture"
[[constraints]]
frame = "panda_joint4"
above = [0.0, 0.2, 0.0]
normal = [0.0, -1.0, 0.0]
name = "wall"
[[constraints]]
frame = "panda_joint4"
inside = [[-0.5, -0.4, -inf], [0.7, inf, 1.2]]
name = "cell"
[[constraints]]
frame = "panda_joint4"
along = [0.0, 0.0, 1.0]
within = 3.0
name = "cup"
"""


@pytest.fixture
def scenario(tmp_path):
    file = tmp_path / "several.toml"
    file.write_text(SCENARIO, encoding="utf-8")
    return str(file)


def test_targets_of_tasks_have_handles_that_move_them_until_reset(scenario):
    source = SteppedSource(scenario)
    with Page(source, port=0) as page:
        box = controls(page)["drag tasks and things"]
        assert box.value and len(page._scene.handles.marks) == 2
        use(box, False)
        use(box, True)
        handles = page._scene.handles.marks
        moved = SimpleNamespace(position=np.array([0.5, -0.2, 0.1]), wxyz=np.eye(4)[0])
        asyncio.run(handles[1].control._impl_aux.update_cb[0](SimpleNamespace(target=moved, phase="update")))
        order = source.orders[-1]
        assert order.name == "look" and order.position.tolist() == [0.5, -0.2, 0.1]
        assert source.frame().further[1].place == (0.5, -0.2, 0.1)
        use(box, False)
        assert page._scene.handles.marks == {}
        assert source.frame().further[1].place == (0.5, -0.2, 0.1)
        source.put(Reset())
        assert source.frame().further[1].place == (0.6, 0.1, 0.0)
        for wrong in (
            Place("lok", np.zeros(3)),
            Place("look", np.full(3, np.nan)),
            Place("look", np.zeros(2)),
        ):
            source.put(wrong)
            message = source.frame().message
            assert "look" in message and source.frame().further[1].place == (0.6, 0.1, 0.0)


def test_targets_of_poses_are_dragged_as_they_are_turned_also_those_in_another_frame(tmp_path):
    file = tmp_path / "two.toml"
    file.write_text(
        '[robot]\nname = "dual_panda"\n[path]\nkind = "hold"\nduration = 4.0\n'
        '[[tasks]]\nkind = "pose"\nframe = "right_hand"\nlevel = 0\nname = "right"\n'
        '[[tasks]]\nkind = "relative"\nframe = "left_joint4"\nto = "right_hand"\nrows = "position"\n'
    )
    source = SteppedSource(str(file))
    planner = source.session.arms.arm.planner
    before = planner.tasks["right"].target
    place = before[:3, 3] + [0.0, 0.0, 0.05]
    source.put(Place("right", place))
    frame = source.frame()
    assert frame.message == "" and frame.further[0].place == pytest.approx(place)
    assert planner.tasks["right"].target[:3, :3] == pytest.approx(before[:3, :3])
    other = next(one for one in frame.further if one.name == "left_joint4 to right_hand")
    there = np.add(other.place, [0.0, 0.02, 0.0])
    source.session.paused = True
    source.put(Place("left_joint4 to right_hand", there))
    T = planner.robot.pose(source.session.frame.q, "right_hand")
    source.frame()
    assert (T @ planner.tasks["left_joint4 to right_hand"].target)[:3, 3] == pytest.approx(there, abs=2e-3)


def test_replay_and_recording_show_what_the_session_showed(scenario):
    setup = load(scenario)
    log = setup.simulation(log=MEMORY, metadata={"resolved": setup.toml}).run().log
    frame = ReplaySource(log, "run", clock=lambda: 0.0).frame()
    live = SteppedSource(scenario, seconds=0.0).session.frame.further
    for shown, expected in zip(frame.further, live, strict=True):
        assert shown._replace(value=0.0, place=None) == expected._replace(value=0.0, place=None)
        assert shown.value == pytest.approx(expected.value, abs=1e-9)
        assert (shown.place is None) == (expected.place is None)
        if shown.place is not None:
            np.testing.assert_allclose(shown.place, expected.place, atol=1e-9)
    page = recording([frame, frame], setup.robot)
    names = {message.get("name", "") for _, message in messages_of(page)[1]}
    assert {"/arm-1/task0", "/arm-1/plane3", "/arm-1/plane3_normal", "/arm-1/box4"} <= names
    assert "target of a soft task" in page


def test_a_box_is_put_in_the_way_and_dragged_until_reset(scenario):
    source = SteppedSource(scenario)
    with Page(source, port=0) as page:
        use(controls(page)["a box in the way"], True)
        page.refresh()
        shown = source.frame().further
        k = next(k for k, one in enumerate(shown) if one.solid)
        assert shown[k].name == "box" and shown[k].value > 0.05 and source.stage().box
        assert controls(page)["drag tasks and things"].value
        first = np.array(shown[k].solid.pose).reshape(4, 4)[:3, 3]
        handle = page._scene.handles.marks[k]
        np.testing.assert_allclose(handle.control.position, first)
        moved = SimpleNamespace(position=first + np.array((0.0, 0.0, 0.05)), wxyz=np.eye(4)[0])
        asyncio.run(handle.control._impl_aux.update_cb[0](SimpleNamespace(target=moved, phase="update")))
        for _ in range(20):
            frame = source.frame()
        there = np.array(frame.further[k].solid.pose).reshape(4, 4)[:3, 3]
        np.testing.assert_allclose(there, first + np.array((0.0, 0.0, 0.05)))
        source.put(Reset())
        back = np.array(source.frame().further[k].solid.pose).reshape(4, 4)[:3, 3]
        np.testing.assert_allclose(back, first)
        handle.held_until = 0.0  # as a second after it was let go
        page._scene.show(source.frame())
        np.testing.assert_allclose(handle.control.position, first)
        use(controls(page)["a box in the way"], False)
        page.refresh()
        assert not any(one.solid for one in source.frame().further)


@pytest.mark.parametrize(("fact", "words"), [
    (FurtherFact("elbow", 0.0123, "m", (0, 0, 0)), "12.3 mm off"),
    (FurtherFact("look", np.pi / 6, "rad"), "30.0 deg off"),
    (FurtherFact("both", 0.5, "rad or m"), "0.5 off"),
    (FurtherFact("table", 0.002, "m", (0, 0, 0), (0, 0, 1), "plane"), "2.0 mm from the plane"),
    (FurtherFact("table", -1e-6, "m", (0, 0, 0), (0, 0, 1), "plane"), "0.0 mm from the plane"),
    (FurtherFact("table", -0.003, "m", (0, 0, 0), (0, 0, 1), "plane"), "3 mm beyond the plane"),
    (FurtherFact("cell", 0.02, "m", shape="box"), "20.0 mm from the sides of the box"),
    (FurtherFact("cell", -0.02, "m", shape="box"), "20 mm outside the box"),
    (FurtherFact("cup", 0.1, "rad", shape="cone"), "5.7 deg from the cone"),
    (FurtherFact("cup", -0.1, "rad", shape="cone"), "5.73 deg outside the cone"),
    (FurtherFact("post", 0.0123, "m", shape="body"), "12.3 mm clear"),
    (FurtherFact("post", -0.0123, "m", shape="body"), "12.3 mm inside"),
    (FurtherFact("table", np.nan, "m", (0, 0, 0), (0, 0, 1), "plane"), "unknown"),
])  # fmt: skip
def test_amounts_are_words(fact, words):
    assert amount(fact) == words
    assert words in further_table([fact])
