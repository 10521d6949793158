"""The page of a playground: viser's client, its first picture, the kernel for browsers, and a script.

A page of a server hears from a worker of viser's client, which speaks with that server. Here the place of the
worker is taken by a script in which the planner itself runs, so that there is one way of drawing an arm.
"""

import json
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path as File
from typing import Any, Final

import numpy as np

from ftqp.control.paths.path import Path, Repeated
from ftqp.control.planner.planner import Planner
from ftqp.control.planner.status import StepStatus
from ftqp.core.checks import FloatArray
from ftqp.core.pose import quaternions
from ftqp.faults.kinds import Degraded, Locked
from ftqp.sim.log.signals import CONDITIONS
from ftqp.sim.session.frame import NEAR, DrawnArm, Frame, placed
from ftqp.sim.session.session_arms import path_points
from ftqp.sim.session.session_commands import WEAK
from ftqp.viz.live import colours
from ftqp.viz.live.drag_handles import wxyz
from ftqp.viz.live.live_page import CONTROLS
from ftqp.viz.live.panel import (
    FASTEST,
    INVITATION,
    NARROW,
    PAUSE,
    REPAIR,
    RESET,
    RESUME,
    ROWS,
    SIDE,
    short_names,
)  # fmt: skip
from ftqp.viz.live.panel import PATH as TO_PATH
from ftqp.viz.live.scene import RIVAL, SEGMENTS, STEP, Scene
from ftqp.viz.live.server import VERSION, client_page, close_server, first_messages, open_server

SCRIPT: Final = File(__file__).with_name("playground.mjs")
KNOTS: Final = 400
"""Samples of a lap; between them the script goes by polynomials of the fifth degree, through places, twists
and accelerations of both."""
LAP: Final = 20.0
"""A lap that takes longer is shown faster at first, so that it takes no longer than this [s]."""
HURRY: Final = 0.15
"""A dragged target goes at most as fast as a tip would whose every joint made this share of the slowest one's
speed, and gathers speed by the same share of the smallest acceleration: by eye, and far from any limit."""
WORDS = (Locked.button, Degraded.button, REPAIR)
"""Buttons of a joint: what a page without dynamics can show."""
LED = "same arm, same failure, same planner, to which it is never reported"
"""What the second arm is."""
NAMED = "never reported"
"""The same beside it."""
STUB: Final = """
class PlannerWorker {  // instead of the worker that speaks with a server
  static queue = [];
  constructor() { PlannerWorker.last = this; }
  postMessage(said) {
    if (PlannerWorker.heard) PlannerWorker.heard(said, this); else PlannerWorker.queue.push([said, this]);
  }
  terminate() {}
}
window.Worker = PlannerWorker;
"""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Played:
    """What a playground plays with: a healthy planner, and where the arm begins.

    Without a path the pose of the start is held. The kernel goes by the hash of its source and as the bytes
    for browsers, the arm as those of ``arm.ftqp``, and the loader is the text of ``ftqp.mjs``.
    """

    title: str
    planner: Planner
    q: FloatArray
    path: Path | None
    kernel: str
    wasm: bytes
    arm: bytes
    loader: str


def playground_page(played: Played) -> str:
    """The whole page, one file without an address in it."""
    robot = played.planner.robot
    robot.refuse_floating("a page without a server shows")
    speed = 1.0 if played.path is None else min(max(1.0, _lap(played.path).duration / LAP), FASTEST)
    server = open_server(port=0)
    try:
        server.scene.configure_default_lights(True, cast_shadow=False)
        server.gui.configure_theme(
            control_width="large", show_logo=False, show_share_button=False, brand_color=(46, 112, 184)
        )
        server.gui.main_panel.dock_right()
        server.gui.main_panel.set_width(CONTROLS)
        frame = _first(played)
        points = None if played.path is None else path_points(played.path)
        scene = Scene(server, robot, frame, path=points, hidden=("ellipsoid",))
        turns = any(row.startswith("r") for row in robot.default_rows)
        scene.handles.drag(lambda pose: None, frame.joints[-1], turns)
        controls = add_controls(server, scene, robot.joints, round(speed, 1), _about(played))
        messages, arrays = first_messages(server)
    finally:
        close_server(server)
    content = {
        "title": played.title, "joints": robot.joints, "short": short_names(robot.joints),
        "dt": played.planner.dt, "kernel": played.kernel, "speed": round(speed, 1), "size": scene.size,
        "turns": turns, **_arm(played, scene.size), "path": _knots(played.path),
        "nodes": {**scene.nodes(), "handle": f"{scene.name}/handle"}, "trail": [SEGMENTS, STEP * scene.size],
        "acts": controls.acts, "texts": controls.texts, "looks": looks(), "near": NEAR, "weak": dict(WEAK),
        "conditions": CONDITIONS, "statuses": [[status.name, status.value] for status in StepStatus],
        "messages": messages, "arrays": [_text(array) for array in arrays],
        "wasm": _text(played.wasm), "arm": _text(played.arm),
    }  # fmt: skip
    return _put_together(played, content)


def _put_together(played: Played, content: Mapping[str, Any]) -> str:
    """The client's page with the planner in it."""
    said = json.dumps(content, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    script = SCRIPT.read_text(encoding="utf-8").partition("\n// ---\n")[2]
    loader = played.loader.replace("export class", "class")
    head = (
        f"<title>{escape(played.title)} - ftqp</title>"
        f'<meta name="generator" content="ftqp, viser {escape(VERSION, quote=True)}">'
        f"<script>{STUB}</script>"
        f'<script id="ftqp-playground" type="application/json">{said}</script>'
        f'<script type="module">{loader}\n{script}</script>'
    )
    page = client_page().replace("<title>Viser</title>", "", 1)
    at = page.index("<meta charset") if "<meta charset" in page else page.index("</head>")
    return page[:at] + '<meta charset="utf-8" />' + head + page[at:]


def _about(played: Played) -> str:
    """What is at work, for people who want to know."""
    planner = played.planner
    return (
        '<div style="font:13px/1.5 system-ui,sans-serif;color:#222;padding:4px 10px">'
        "<p>This page holds ftqp's planner itself: the kernel that Python and C call, compiled for browsers "
        f"({len(played.wasm) / 1e3:.0f} kB). No server is asked. It plans every {1e3 * planner.dt:g} ms, and "
        "the arm follows its commands exactly, apart from what you break; there is no gravity in it.</p>"
        "<p>Twice: for the grey arm what you break is reported at once. The purple one has the same planner, "
        "to which nothing is reported: it detects failures from the encoders alone.</p>"
        f"<p>Kernel <code>{escape(played.kernel)}</code>; <code>bill.json</code> of a library of the same "
        "kernel says the same.</p></div>"
    )


def _first(played: Played) -> Frame:
    """The picture at the start."""
    robot = played.planner.robot
    drawn, still = DrawnArm(robot), np.zeros(robot.nv)
    codes, target = drawn.codes({}), placed(robot.pose(played.q))
    return drawn.frame(tick=0, t=0.0, q=played.q, v=still, truth=codes, belief=codes, target=target)


def _arm(played: Played, size: float) -> dict[str, Any]:
    """What the script must know of an arm to draw it and to let it fail."""
    robot, chain = played.planner.robot, played.planner.robot.chain
    limits, pose = robot.limits, robot.pose(played.q)
    v_max, a_max = (np.where(np.isfinite(x), x, 1.0) for x in (limits.v_max, limits.a_max))
    least_of_both = float(v_max.min()), float(a_max.min())
    return {
        "q": played.q.tolist(), "parent": chain.parent.tolist(),
        "prismatic": chain.prismatic.astype(int).tolist(),
        "home": [[*wxyz(R), *t] for R, t in zip(chain.rotation, chain.translation, strict=True)],
        "tip": [*wxyz(chain.tip_rotation), *chain.tip_translation], "tip_joint": int(chain.tip_joint),
        "pose": [*wxyz(pose[:3, :3]), *pose[:3, 3]],
        "low": [_finite(x) for x in limits.q_min], "high": [_finite(x) for x in limits.q_max],
        "v_max": [_finite(x) for x in limits.v_max], "a_max": a_max.tolist(),
        "hurry": [[HURRY * least * scale for least in least_of_both] for scale in (size, 1.0)],
    }  # fmt: skip


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _lap(path: Path) -> Path:
    """Once round, or there and back."""
    return Repeated(path, 1)


def _knots(path: Path | None) -> dict[str, Any] | None:
    """Places, turns w, x, y, z, twists and accelerations along a lap, (KNOTS + 1, 19)."""
    if path is None:
        return None
    lap = _lap(path)
    samples = lap.sample(np.linspace(0.0, lap.duration, KNOTS + 1))
    turns = np.roll(quaternions(samples.pose[:, :3, :3]), 1, axis=1)
    rows = np.hstack([samples.pose[:, :3, 3], turns, samples.twist, samples.acceleration])
    return {"lap": lap.duration, "rows": _text(rows.astype("<f8").tobytes())}


def _text(content: bytes) -> str:
    return b64encode(content).decode("ascii")


@dataclass(frozen=True, slots=True, kw_only=True)
class Controls:
    """What can be clicked, acts by name and number, and what is written anew: head, table, curve."""

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
