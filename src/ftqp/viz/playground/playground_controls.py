"""The controls of a playground: what can be clicked on it, by names that its script is given."""

from dataclasses import dataclass
from typing import Any

from ftqp.faults.kinds import Degraded, Locked
from ftqp.viz.live import colours
from ftqp.viz.live.panel import INVITATION, NARROW, PAUSE, REPAIR, RESET, RESUME, ROWS, SIDE, short_names
from ftqp.viz.live.panel import PATH as TO_PATH
from ftqp.viz.live.scene import RIVAL, Scene

WORDS = (Locked.button, Degraded.button, REPAIR)
"""Buttons of a joint: what a page without dynamics can show."""
LED = "same arm, same failure, led by the same planner, which is never told"
"""What the second arm is."""
NAMED = "never told"
"""The same beside it."""
FASTEST = 5.0
"""Highest speed that the slider offers, simulated seconds a second."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Controls:
    """Names of what can be clicked, and of what is written anew.

    Attributes:
        acts: What a control does by its name: ``time``, ``speed``, ``joint`` with its number, ``chosen``,
            ``overlay`` with its own, or ``drag``.
        texts: Names of the texts that the script writes: ``head``, ``table`` and ``curve``.
    """

    acts: dict[str, list[Any]]
    texts: dict[str, str]


def add_controls(server: Any, scene: Scene, joints: tuple[str, ...], speed: float, about: str) -> Controls:
    """Put the controls on a page."""
    gui = server.gui
    acts: dict[str, list[Any]] = {}
    gui.add_html(NARROW)
    gui.add_html(INVITATION.format(further=""))
    texts = {"head": uuid(gui.add_html(""))}
    acts[uuid(gui.add_button_group("time", (PAUSE, RESUME, RESET, TO_PATH)))] = ["time"]
    slider = gui.add_slider("speed", min=0.1, max=FASTEST, step=0.1, initial_value=speed)
    acts[uuid(slider)] = ["speed"]
    tabs = gui.add_tab_group()
    with tabs.add_tab("Joints"):
        if len(joints) <= ROWS:
            for i, label in enumerate(short_names(joints)):
                acts[uuid(gui.add_button_group(label, WORDS))] = ["joint", i]
        else:
            acts[uuid(gui.add_dropdown("joint", joints, initial_value=joints[0]))] = ["chosen"]
            acts[uuid(gui.add_button_group("break it", WORDS))] = ["joint", None]
        texts["table"] = uuid(gui.add_html(""))
    with tabs.add_tab("Show"):
        acts[uuid(gui.add_checkbox("drag the target", True))] = ["drag"]
        for overlay in scene.overlays:
            if overlay != "ellipsoid":
                acts[uuid(gui.add_checkbox(overlay, overlay not in scene.hidden))] = ["overlay", overlay]
    with tabs.add_tab("About"):
        gui.add_html(about)
    side = gui.add_panel()
    with side.add_tab("What you see"):
        texts["curve"] = uuid(gui.add_html(""))
        gui.add_html(colours.legend(rival=LED, ellipsoid=False))
    side.dock_left()
    side.set_width(SIDE)
    return Controls(acts=acts, texts=texts)


def uuid(control: Any) -> str:
    """How a page knows a control."""
    return str(control._impl.uuid)


def looks() -> dict[str, Any]:
    """Colours and words that the script paints and writes with."""
    return {
        "condition": {str(code): colour for code, colour in colours.CONDITION.items()},
        "braking": colours.BRAKING, "near": colours.NEAR_LIMIT, "link": colours.LINK,
        "trail": colours.hexadecimal(colours.TRAIL), "rival": colours.hexadecimal(colours.RIVAL),
        "status": {name: colours.hexadecimal(colour) for name, colour in colours.STATUS.items()},
        "buttons": {Locked.button: Locked.number, Degraded.button: Degraded.number},
        "named": NAMED, "overlay": RIVAL,
    }  # fmt: skip
