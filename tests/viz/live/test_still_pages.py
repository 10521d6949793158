"""Pages in a real browser that need no running arm: a recording, a map of failures, names that are traps."""

from time import monotonic, sleep

import numpy as np
from tests.viz.live.stepped_source import SteppedSource
from tests.viz.live.still_source import StillSource

import ftqp
from ftqp.sim.session.session_commands import Break, Play
from ftqp.viz.live.live_page import Page
from ftqp.viz.live.recording import recording
from ftqp.viz.live.stage import HeatMap

PATIENCE = 120.0
"""How long anything may take on a busy machine [s]."""


def until(holds):
    """Wait until something is true."""
    end = monotonic() + PATIENCE
    while not holds():
        assert monotonic() < end, "nothing happened"
        sleep(0.05)


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


def test_a_click_on_the_map_of_failures_plays_one_and_no_name_is_more_than_text(opened):
    names = ("<script>window.hacked = 1</script>", '"><img src=x onerror="window.hacked = 2">')
    robot = ftqp.Robot.from_dh([[0, 0.1, 0.4, 0], [0, 0, 0.3, 0]], joints=list(names), acceleration=5.0)
    codes = np.array([[0, 0, 1, 1], [1, 0, 0, 0]])
    heat = HeatMap(
        joints=names, times=np.array([0.0, 1.0, 2.0, 3.0]), codes=codes, words={0: "survived", 1: names[1]},
        colours={0: "#DCEFE6", 1: "#E69F00"}, coverage=5 / 8,
    )  # fmt: skip
    still = StillSource(robot, heat=heat, title=names[1], robots=names, schemes=names)
    still.facts |= {"message": names[1], "truth": np.array([1, 2]), "belief": np.array([1, 2])}
    with Page(still, port=0) as page:
        tab = opened(page.url, size=(900, 420))
        tab.wait_for_selector("#ftqp-status")
        tab.get_by_role("tab", name="Failures").click()
        tab.locator("#ftqp-failures").scroll_into_view_if_needed()
        box = tab.locator("#ftqp-failures").bounding_box()
        tab.mouse.click(box["x"] + 0.6 * box["width"], box["y"] + 0.25 * box["height"])
        until(lambda: still.orders)
        assert still.orders == [Play(names[0], 2.0)]
        tab.wait_for_function("document.body.innerText.includes('locks at 2.00 s')")
        for name in ("Setup", "Show", "Joints"):
            tab.get_by_role("tab", name=name).click()
        assert tab.get_by_role("button", name="lock", exact=True).count() == 2
        assert tab.evaluate("typeof window.hacked") == "undefined"
        tab.context.close()
