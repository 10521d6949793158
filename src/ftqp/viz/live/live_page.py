"""The live page: frames of a source become a scene and plots, clicks become commands."""

from collections.abc import Callable, Sequence
from threading import Event
from time import monotonic
from typing import Any, Self, final

from ftqp.model.robot import Robot
from ftqp.sim.session.frame import Frame
from ftqp.viz.live.meshes import Part, arm_parts
from ftqp.viz.live.panel import Panel
from ftqp.viz.live.scene import Scene
from ftqp.viz.live.server import LOOPBACK, close_server, open_server
from ftqp.viz.live.stage import Source, Stage

PICTURES = 30.0
"""Pictures of the scene in a second."""
PLOTS = 10.0
"""Plots and status heads in a second."""
CONTROLS = 320
"""Width of the panel with controls [px]."""


@final
class Page:
    """A page served to any number of browsers, all of which see the same.

    Nothing here waits for a browser or for a planner: ``refresh`` draws the latest frame, and what is clicked
    is handed to the source from a thread of the server. Any other host than this machine opens the page to
    the network; a port in use, or 0, gives the next free one. Without ``parts`` an arm is what its chain
    gives; ``seen`` gets every frame.

    Raises:
        InputError: The address is none of this machine, or no port is free.
    """

    def __init__(
        self,
        source: Source,
        *,
        host: str = LOOPBACK,
        port: int = 8080,
        parts: Callable[[Robot], Sequence[Part]] = arm_parts,
        seen: Callable[[Frame], None] = lambda frame: None,
    ) -> None:
        self._source, self._parts, self._seen = source, parts, seen
        self._server = open_server(host, port)
        self._host, self._count, self._plotted = host, 0, 0.0
        self._server.scene.configure_default_lights(True, cast_shadow=False)
        self._server.gui.configure_theme(
            control_width="large", show_logo=False, show_share_button=False, brand_color=(46, 112, 184)
        )
        self._server.gui.main_panel.dock_right()
        self._server.gui.main_panel.set_width(CONTROLS)
        self._stage: Stage | None = None
        self._scene: Scene | None = None
        self._panel: Panel | None = None
        try:
            self.refresh()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def port(self) -> int:
        """The port that counts."""
        return int(self._server.get_port())

    @property
    def url(self) -> str:
        """The address for a browser on this machine."""
        shown = "127.0.0.1" if self._host in ("0.0.0.0", "") else self._host
        return f"http://{f'[{shown}]' if ':' in shown else shown}:{self.port}"

    def clients(self) -> list[Any]:
        """viser's handles of the browsers that are connected, for pictures of what they see."""
        return list(self._server.get_clients().values())

    @property
    def browsers(self) -> int:
        """How many browsers are connected."""
        return len(self._server.get_clients())

    def refresh(self) -> bool:
        """Draw the latest frame of the source, with plots ten times a second; whether it could be drawn."""
        frame = self._source.frame()
        self._seen(frame)
        if self._stage is None or frame.stage != self._stage.number:
            stage = self._source.stage()
            if stage.number != frame.stage:
                return False
            self._change(stage, frame)
        assert self._stage is not None and self._scene is not None and self._panel is not None
        now = monotonic()
        with self._server.atomic():
            self._scene.show(frame)
            self._panel.follow(frame)
            if now - self._plotted >= 1.0 / PLOTS:
                self._plotted = now
                stage = self._source.stage()
                if stage is not self._stage and stage.number == self._stage.number:
                    self._stage = stage
                    self._panel.keep(stage, frame)
                self._panel.show(frame)
                self._panel.plot()
        return True

    def run(self, ended: Event, pictures: float = PICTURES) -> None:
        """Draw until the event is set."""
        due = monotonic()
        while not ended.is_set():
            self.refresh()
            due = max(due + 1.0 / pictures, monotonic() - 1.0 / pictures)
            ended.wait(max(due - monotonic(), 0.0))

    def close(self) -> None:
        """End the server; browsers say that the connection is lost."""
        close_server(self._server)

    def nodes(self) -> int:
        """How many nodes the scene has."""
        return len(self._server.scene._handle_from_node_name)

    def _change(self, stage: Stage, frame: Frame) -> None:
        """Draw another arm, and make the controls anew where its joints differ."""
        with self._server.atomic():
            if self._scene is not None:
                self._scene.remove()
            self._count += 1
            parts = self._parts(stage.robot)
            scene = Scene(
                self._server, stage.robot, frame, path=stage.path, name=f"arm-{self._count}", parts=parts
            )
            if self._panel is None or not self._panel.keep(stage, frame):
                if self._panel is not None:
                    self._panel.remove()
                self._panel = Panel(self._server, stage, scene, frame, self._source.put)
            else:
                self._panel.attach(scene)
            if self._scene is not None and self._stage is not None and self._stage.robot != stage.robot:
                for client in self._server.get_clients().values():
                    scene.camera(client)
        self._stage, self._scene = stage, scene
