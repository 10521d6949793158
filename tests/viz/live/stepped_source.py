"""A source for tests of pages: a session that makes a fixed number of ticks for every frame."""

from collections.abc import Sequence
from threading import Lock

import numpy as np

from ftqp.app.view.arms_of_scenario import arms_of
from ftqp.sim.session.live_session import Session
from ftqp.sim.session.session_arms import Choice
from ftqp.viz.live.frame import DrawnArm, Stage, frame_of


class SteppedSource:
    """A session; every frame is ``seconds`` of simulated time after the last one."""

    def __init__(
        self,
        scenario: str = "panda-circle",
        seconds: float = 0.02,
        overrides: Sequence[str] = (),
        **stage: object,
    ) -> None:
        self.session = Session(arms_of, Choice(scenario=scenario, overrides=tuple(overrides)))
        self.seconds, self.orders, self._more = seconds, [], stage
        self._lock = Lock()
        self._drawn = None

    def put(self, order):
        self.orders.append(order)
        self.session.put(order)

    def frame(self):
        with self._lock:
            self.session.advance(self.seconds)
            return frame_of(self.session.facts, self._arm())

    def stage(self):
        with self._lock:
            return self._stage()

    def _stage(self):
        session = self.session
        path = session.arms.path
        points = path.sample(np.linspace(0.0, path.duration, 121)).pose[:, :3, 3]
        return Stage(
            number=session.stage,
            title=session.arms.title,
            robot=session.arms.robot,
            scheme=session.choice.scheme or "mvn",
            backend=session.choice.backend or "active_set",
            tell=session.tell,
            path=points,
            box=session.arms.box,
            **{
                "robots": ("panda", "iiwa14"),
                "scenarios": ("panda-circle", "planar6-square"),
                "schemes": ("mvn", "man"),
                "backends": ("active_set", "daqp"),
                **self._more,
            },
        )

    def _arm(self):
        """What draws the arm of now."""
        if self._drawn is None or self._drawn.robot is not self.session.arms.robot:
            self._drawn = DrawnArm(self.session.arms.robot)
        return self._drawn
