"""Pages in a real browser: clicks reach the arm, and what happens is seen."""

from threading import Event, Thread
from time import monotonic, sleep

import numpy as np
import pytest
from tests.viz.live.stepped_source import SteppedSource
from tests.viz.live.still_source import StillSource

import ftqp
from ftqp.sim.session.session_commands import Break, Play, TakeWay
from ftqp.viz.live.live_page import Page
from ftqp.viz.live.server import recording
from ftqp.viz.live.stage import HeatMap

pytestmark = pytest.mark.slow
PATIENCE = 120.0
"""How long anything may take on a busy machine [s]."""


@pytest.fixture(scope="module")
def source():
    return SteppedSource(seconds=0.02, overrides=["faults=[]", "path.duration=4"])


@pytest.fixture(scope="module")
def page(source):
    ended = Event()
    with Page(source, port=0) as page:
        thread = Thread(target=page.run, args=(ended, 5.0))
        thread.start()
        try:
            yield page
        finally:
            ended.set()
            thread.join()


@pytest.fixture(scope="module")
def tab(page, opened):
    tab = opened(page.url)
    tab.wait_for_selector("#ftqp-status")
    settle(tab)
    return tab


def comes(holds, seconds):
    """Whether something becomes true in so many seconds."""
    end = monotonic() + seconds
    while not holds():
        if monotonic() > end:
            return False
        sleep(0.05)
    return True


def until(holds, told=lambda: ""):
    """Wait until something is true."""
    assert comes(holds, PATIENCE), f"nothing happened {told()}"


def settle(tab):
    """Wait for a page that still loads, as it may lose a click."""
    for _ in range(3):
        now = tick(tab)
        shows(tab, f"+d.tick > {now}")


def head(condition):
    """JavaScript: the head of a page is there and says something of its data, ``d``."""
    return f"(e => e !== null && (d => {condition})(e.dataset))(document.querySelector('#ftqp-status'))"


def shows(tab, condition):
    """Wait until the head of a page says something of its data, ``d``."""
    tab.wait_for_function(head(condition))


def tick(tab):
    return int(tab.get_attribute("#ftqp-status", "data-tick"))


def click(tab, word, joint):
    tab.get_by_role("button", name=word, exact=True).nth(joint).click()


def press(tab, word, joint, condition):
    """Click a button until the head of the page says so."""
    insist(lambda: click(tab, word, joint), lambda: tab.evaluate(head(condition)))


def insist(act, holds):
    """Act until it has had its effect; again where a page that is drawn anew has lost the click."""
    for _ in range(3):
        act()
        if comes(holds, 0.25 * PATIENCE):
            return
    raise AssertionError("clicked, and nothing happened")


def planner(source):
    return source.session.arms.arm.planner


def test_a_click_locks_a_joint_and_another_one_repairs_it(source, tab):
    assert "Drag the arrows at the end effector" in tab.inner_text("body")
    press(
        tab, "lock", 1, "d.faults.includes('panda_joint2:locked') && d.belief.includes('panda_joint2:locked')"
    )
    assert "panda_joint2" in planner(source).faults
    assert "locked" in tab.inner_text("#ftqp-joints")
    press(tab, "repair", 1, "d.faults === '' && d.belief === ''")
    assert not planner(source).faults


def test_two_browsers_see_the_same_and_one_that_dies_stops_nothing(source, page, tab, opened):
    other = opened(page.url, size=(800, 300))
    other.wait_for_selector("#ftqp-status")
    settle(other)
    press(other, "lock", 3, "d.faults.includes('panda_joint4')")
    shows(tab, "d.faults.includes('panda_joint4')")
    press(tab, "repair", 3, "d.faults === ''")
    shows(other, "d.faults === ''")
    press(other, "lock", 6, "d.faults.includes('panda_joint7')")
    other.context.close()
    shows(tab, "d.faults.includes('panda_joint7')")
    until(lambda: page.browsers == 1)
    now = tick(tab)
    shows(tab, f"+d.tick > {now}")
    press(tab, "repair", 6, "d.faults === ''")


def test_ways_out_are_ghosts_with_a_price_and_a_click_on_one_takes_it(source, page, tab):
    tab.get_by_role("tab", name="Ways out").click()
    insist(lambda: click(tab, "look", 0), lambda: "go home" in tab.inner_text("#ftqp-ways"))
    ghosts = [name for name in page._server.scene._handle_from_node_name if "/ways/" in name]
    assert len({name.split("/ways/")[1].split("/")[0] for name in ghosts}) >= 3
    ways = source.session.frame.ways
    number = [way.kind for way in ways].index("home")
    source.orders.clear()
    tab.get_by_role("button", name=f"{number + 1} home").click()
    until(lambda: TakeWay(number) in source.orders)
    until(lambda: not source.session.frame.ways)
    until(lambda: not [name for name in page._server.scene._handle_from_node_name if "/ways/" in name])
    insist(
        tab.get_by_role("button", name="to path", exact=True).click,
        lambda: "Back to the path" in source.frame().message,
    )


def test_a_click_on_the_map_of_failures_plays_one(opened):
    robot = ftqp.robots.load("planar", lengths=(0.4, 0.3))
    heat = HeatMap(
        joints=robot.joints, times=np.arange(4.0), codes=np.array([[0, 0, 1, 1], [1, 0, 0, 0]]),
        words={0: "survived", 1: "lost"}, colours={0: "#DCEFE6", 1: "#E69F00"}, coverage=5 / 8,
    )  # fmt: skip
    still = StillSource(robot, heat=heat)
    with Page(still, port=0) as page:
        tab = opened(page.url, size=(900, 420))
        tab.wait_for_selector("#ftqp-status")
        tab.get_by_role("tab", name="Failures").click()
        tab.locator("#ftqp-failures").scroll_into_view_if_needed()
        box = tab.locator("#ftqp-failures").bounding_box()
        tab.mouse.click(box["x"] + 0.6 * box["width"], box["y"] + 0.25 * box["height"])
        until(lambda: still.orders)
        assert still.orders == [Play(robot.joints[0], 2.0)]
        tab.wait_for_function("document.body.innerText.includes('locks at 2.00 s')")
        tab.context.close()


def test_a_recording_opens_from_a_file_with_the_network_off_and_asks_for_nothing(tmp_path, opened):
    source = SteppedSource(seconds=0.1, overrides=["faults=[]", "path.duration=3"])
    frames = [source.frame() for _ in range(5)]
    source.put(Break("panda_joint4"))
    frames += [source.frame() for _ in range(5)]
    file = tmp_path / "recording.html"
    file.write_text(recording(frames, source.stage().robot), encoding="utf-8")
    tab = opened("about:blank", offline=True, size=(640, 400))
    asked = []
    tab.on("request", lambda request: asked.append(request.url))
    tab.goto(file.as_uri())
    tab.wait_for_selector("canvas")
    assert tab.get_by_text("locked joint").count() == 1
    assert asked == [file.as_uri()]
    tab.context.close()
