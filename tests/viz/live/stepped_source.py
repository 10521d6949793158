"""A source for tests of pages: a session that makes a fixed number of ticks for every frame."""

from threading import Lock

from ftqp.app.view.live_source import arms_of, stage_of
from ftqp.sim.session.live_session import Session
from ftqp.sim.session.session_arms import Choice


class SteppedSource:
    """A session; every frame is ``seconds`` of simulated time after the last one."""

    def __init__(self, scenario="panda-circle", seconds=0.02, overrides=()):
        self.session = Session(arms_of, Choice(scenario=scenario, overrides=tuple(overrides)))
        self.seconds, self.orders = seconds, []
        self._lock = Lock()

    def put(self, order):
        self.orders.append(order)
        self.session.put(order)

    def frame(self):
        with self._lock:
            self.session.advance(self.seconds)
            return self.session.frame

    def stage(self):
        with self._lock:
            return stage_of(self.session)
