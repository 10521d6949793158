"""The controls of a page: every click becomes an command, and nothing here touches a planner."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, final

from ftqp.core.checks import FloatArray
from ftqp.faults.kinds import KINDS
from ftqp.sim.session import session_commands as commands
from ftqp.sim.session.frame import Frame
from ftqp.sim.session.session_commands import TELLS, Command
from ftqp.viz.live.colours import legend
from ftqp.viz.live.further_nodes import further_table
from ftqp.viz.live.ghosts import WaysTab
from ftqp.viz.live.plots import FailureMap, History, Plots, joint_table, status_head
from ftqp.viz.live.scene import Scene
from ftqp.viz.live.stage import Stage

ACTIONS = {kind.button: name for name, kind in KINDS.items()}
"""Words on the buttons of a joint, and the kinds of fault that they make; the last button repairs."""
REPAIR = "repair"
ROWS = 12
"""Joints up to which each has a row of buttons of its own."""
PAUSE, RESUME, RESET, PATH = "pause", "resume", "reset", "to path"
SIDE = 230
"""Width of the panel with plots [px]: with that of the controls, half of a window of 1100 px is the arm's."""
NARROW = (
    "<style>.mantine-Flex-root>div:first-child:has(>p>label){width:5.4em!important}"
    ".mantine-Flex-root button.mantine-Button-root{padding:0 3px}</style>"
)
"""Labels and buttons leave room for four buttons in a row of a narrow panel."""
INVITATION = (
    '<div style="font:13px/1.45 system-ui,sans-serif;color:#1b4f72;background:#eaf3fb;padding:4px 10px">'
    "<b>Drag the arrows at the end effector</b>, and the arm follows; <b>to path</b> gives it its path back. "
    "Click <b>lock</b> next to a joint: nothing fails but what you break.{further}</div>"
)
"""What a visitor reads first, and what a page has beside that."""
BOX = " Put <b>a box in the way</b> and drag it."
"""The same of a page with a box."""
FASTEST = 5.0
"""Highest speed that the slider offers, simulated seconds a second."""


@final
class Panel:
    """Controls and plots for one stage."""

    def __init__(
        self, server: Any, stage: Stage, scene: Scene, frame: Frame, put: Callable[[Command], None]
    ) -> None:
        self._gui, self._stage, self._scene, self._put = server.gui, stage, scene, put
        self._latest, self._history, self._answer = frame, History(frame), frame.message
        self._parts: list[Any] = []
        self._dropdowns: dict[str, Any] = {}
        self._slider: Any = None
        names = stage.robot.joints
        self._kept(self._gui.add_html(NARROW))
        if stage.live:
            self._kept(self._gui.add_html(INVITATION.format(further=BOX)))
        self._head = self._kept(self._gui.add_html(""))
        if stage.live:
            self._clock((PAUSE, RESUME, RESET, PATH))
        elif stage.duration is not None:
            self._clock((PAUSE, RESUME))
            self._time_slider(stage.duration)
        self._tabs = self._kept(self._gui.add_tab_group())
        if stage.heat is not None:
            with self._tabs.add_tab("Failures"):
                FailureMap(self._gui, stage.heat, put)
        with self._tabs.add_tab("Joints"):
            if stage.live:
                self._tell(stage)
                box = self._gui.add_checkbox("a box in the way", stage.box)
                self._on_update(box, lambda value: commands.Use(box=bool(value)))
                self._breakers(names)
            self._table = self._gui.add_html("")
        self._ways: WaysTab | None = None
        if stage.live:
            with self._tabs.add_tab("Ways out"):
                self._ways = WaysTab(self._gui, put)
            scene.ghosts.taken = self._ways.take
        self._further: Any = None
        if frame.further:
            with self._tabs.add_tab("Tasks"):
                self._further = self._gui.add_html("")
        if stage.live:
            with self._tabs.add_tab("Setup"):
                self._setup(stage)
        with self._tabs.add_tab("Show"):
            self._overlays(stage)
        self._side = self._gui.add_panel()
        with self._side.add_tab("What you see"):
            self._plots = Plots(self._gui, names, self._history)
            self._gui.add_html(legend(further=bool(frame.further)))
        self._side.dock_left()
        self._side.set_width(SIDE)
        self.show(frame)

    def follow(self, frame: Frame) -> None:
        """Keep what the plots will need of a frame that is not plotted itself."""
        self._latest = frame
        self._history.add(frame)

    def show(self, frame: Frame) -> None:
        """Status, joints and slider; often enough ten times a second."""
        self.follow(frame)
        names = self._stage.robot.joints
        self._head.content = status_head(frame, self._stage.title, names, self._history.ribbon())
        self._table.content = joint_table(frame, names)
        if self._ways is not None:
            self._ways.show(frame.ways)
        if self._further is not None:
            self._further.content = further_table(frame.further)
        if frame.message != self._answer:  # a refusal, perhaps: what is chosen is what there is
            self._answer = frame.message
            self._choose()
        if self._slider is not None:
            self._slider.value = min(max(frame.t, self._slider.min), self._slider.max)

    def plot(self) -> None:
        """Draw the plots anew."""
        self._plots.show(self._history)

    def keep(self, stage: Stage, frame: Frame) -> bool:
        """Go on with another stage of an arm with the same joints; whether these controls can serve it."""
        same = ("live", "duration", "heat", "box", "robots", "scenarios", "schemes", "backends")
        further = [[(one.name, one.shape) for one in of.further] for of in (frame, self._latest)]
        if (
            stage.robot.joints != self._stage.robot.joints
            or any(getattr(stage, name) != getattr(self._stage, name) for name in same)
            or further[0] != further[1]
        ):
            return False
        self._stage = stage
        self._choose()
        self.show(frame)
        return True

    def attach(self, scene: Scene) -> None:
        """Let the check boxes act on another scene."""
        self._scene = scene
        if self._ways is not None:
            scene.ghosts.taken = self._ways.take
        for overlay, box in self._boxes.items():
            scene.choose(overlay, bool(box.value))
        if self._drag is not None and self._drag.value:
            self._give_handle()
        if self._drag_marks is not None:
            self._give_marks()

    def remove(self) -> None:
        """Take every control away."""
        self._side.remove()
        for part in reversed(self._parts):
            part.remove()

    def _kept(self, part: Any) -> Any:
        """Remember a control that ``remove`` takes away."""
        self._parts.append(part)
        return part

    def _clock(self, words: Sequence[str]) -> None:
        """Buttons and a slider for time."""
        asked: dict[str, Command] = {PAUSE: commands.Pause(True), RESUME: commands.Pause(False)}
        asked[RESET], asked[PATH] = commands.Reset(), commands.Aim(None)
        buttons = self._kept(self._gui.add_button_group("time", words))
        speed = self._kept(
            self._gui.add_slider(
                "speed", min=0.1, max=FASTEST, step=0.1, initial_value=min(self._latest.speed, FASTEST)
            )
        )

        self._on_click(buttons, asked.__getitem__)
        self._on_update(speed, lambda value: commands.Speed(float(value)))

    def _time_slider(self, duration: float) -> None:
        """A slider over the time of a replay, which follows it and can be dragged."""
        self._slider = self._kept(
            self._gui.add_slider("t [s]", min=0.0, max=max(duration, 0.01), step=0.01, initial_value=0.0)
        )
        self._on_update(self._slider, lambda value: commands.Seek(float(value)))

    def _on_update(self, control: Any, order: Callable[[Any], Command | None]) -> None:
        """Turn what somebody sets a control to into an order, or into none."""

        async def changed(event: Any) -> None:
            asked = order(event.target.value) if event.client is not None else None
            if asked is not None:
                self._put(asked)

        control.on_update(changed)

    def _on_click(self, buttons: Any, order: Callable[[str], Command]) -> None:
        """Turn a click on one of some buttons into an order, by the word on it."""

        async def clicked(event: Any) -> None:
            self._put(order(str(event.target.value)))

        buttons.on_click(clicked)

    def _tell(self, stage: Stage) -> None:
        """How the planner learns of what breaks."""
        how = self._gui.add_dropdown("report failure", TELLS, initial_value=stage.tell)
        delay = self._gui.add_number(
            "after [s]", 0.5, min=0.0, max=60.0, step=0.1, visible=stage.tell == "after"
        )
        self._dropdowns["tell"] = how

        async def changed(event: Any) -> None:
            delay.visible = how.value == "after"
            if event.client is not None:
                self._put(commands.Tell(str(how.value), float(delay.value)))

        how.on_update(changed)
        delay.on_update(changed)

    def _breakers(self, names: Sequence[str]) -> None:
        """Buttons that break and repair joints: a row for each, or one row below a dropdown."""
        words = (*ACTIONS, REPAIR)
        if len(names) <= ROWS:
            labels = short_names(names)
            rows = [self._gui.add_button_group(label, words) for label in labels]
            for name, row in zip(names, rows, strict=True):
                self._on_row(row, partial(str, name))
        else:
            chosen = self._gui.add_dropdown("joint", tuple(names), initial_value=names[0])
            self._on_row(self._gui.add_button_group("break it", words), lambda: str(chosen.value))

    def _on_row(self, row: Any, joint: Callable[[], str]) -> None:
        """Turn the clicks on a row into commands for its joint."""

        def order(word: str) -> Command:
            return commands.Repair(joint()) if word == REPAIR else commands.Break(joint(), ACTIONS[word])

        self._on_click(row, order)

    def _setup(self, stage: Stage) -> None:
        """Which robot, scenario, scheme and backend; what the page leads the tip by."""
        choices = {
            "robot": stage.robots,
            "scenario": stage.scenarios,
            "scheme": stage.schemes,
            "backend": stage.backends,
        }
        chosen = self._chosen(stage)
        for key, options in choices.items():
            if options:
                self._dropdown(key, options, chosen.get(key, ""))
        self._gui.add_html(
            '<div style="font:12px system-ui;color:#666;padding:4px 10px">A choice begins anew. What cannot '
            "be built is refused in the head of this page, and the arm stays as it is.</div>"
        )

    def _dropdown(self, key: str, options: Sequence[str], value: str) -> None:
        """One choice; the page says ``own`` where the present one is not in the list."""
        listed = tuple(options) if value in options else (value or "own", *options)
        dropdown = self._gui.add_dropdown(key, listed, initial_value=value if value in listed else listed[0])

        def order(value: Any) -> Command | None:
            chosen: dict[str, Any] = {key: str(value)}
            return commands.Use(**chosen) if value in options else None

        self._on_update(dropdown, order)
        self._dropdowns[key] = dropdown

    def _choose(self) -> None:
        """Let the dropdowns show what there is."""
        for name, value in self._chosen(self._stage).items():
            if name in self._dropdowns and value in self._dropdowns[name].options:
                self._dropdowns[name].value = value

    def _chosen(self, stage: Stage) -> dict[str, str]:
        """What the dropdowns show."""
        return {
            "robot": stage.robot.name,
            "scenario": stage.title,
            "scheme": stage.scheme,
            "backend": stage.backend,
            "tell": stage.tell,
        }

    def _overlays(self, stage: Stage) -> None:
        """Check boxes for what the scene shows, and for the handle of the target."""
        self._boxes: dict[str, Any] = {}
        self._drag: Any = None
        if stage.live:
            self._drag = self._gui.add_checkbox("drag the target", True)
            self._drag.on_update(self._dragging)
            self._give_handle()
        self._drag_marks: Any = None
        tasks = any(one.place and not one.shape for one in self._latest.further)
        if stage.live and (tasks or any(one.solid for one in self._latest.further)):
            self._drag_marks = self._gui.add_checkbox("drag tasks and things", tasks or stage.box)
            self._drag_marks.on_update(self._dragging_marks)
            self._give_marks()
        for overlay in self._scene.overlays:
            box = self._gui.add_checkbox(overlay, overlay not in self._scene.hidden)
            self._boxes[overlay] = box
            self._on_box(box, overlay)

    def _on_box(self, box: Any, overlay: str) -> None:
        """Let a check box show and hide an overlay."""

        async def changed(event: Any) -> None:
            self._scene.choose(overlay, bool(event.target.value))

        box.on_update(changed)

    async def _dragging(self, event: Any) -> None:
        """Give the target a handle, or take it away and give the path back."""
        if event.target.value:
            self._give_handle()
        else:
            self._scene.handles.release()
            self._put(commands.Aim(None))

    def _give_handle(self) -> None:
        """A handle where the target is, which goes with it until somebody drags it."""
        pose = self._latest.target if self._latest.target is not None else self._latest.tip
        turns = any(row.startswith("r") for row in self._stage.robot.default_rows)
        self._scene.handles.drag(self._aim, pose, turns)

    async def _dragging_marks(self, event: Any) -> None:
        """Give tasks and things a handle each, or take them away; they stay where they are."""
        self._give_marks()

    def _give_marks(self) -> None:
        """A handle for each task and thing, where that is asked for."""
        if self._drag_marks.value:
            self._scene.handles.drag_marks(self._scene.marks, self._place)
        else:
            self._scene.handles.release_marks()

    def _place(self, k: int, position: FloatArray) -> None:
        """Put a task's target, or a thing, to where its handle is."""
        self._put(commands.Place(self._latest.further[k].name, position))

    def _aim(self, pose: FloatArray) -> None:
        """Lead the tip to where the handle is."""
        self._put(commands.Aim(pose))


def short_names(names: Sequence[str]) -> list[str]:
    """Names without what all of them begin with, up to the last underscore or slash of it."""
    alike = [len(set(letters)) == 1 for letters in zip(*names, strict=False)] if len(names) > 1 else []
    shared = names[0][: [*alike, False].index(False)]
    length = max(shared.rfind("_"), shared.rfind("/")) + 1
    return [name[length:] for name in names]
