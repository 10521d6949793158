"""``ftqp.view``: a page of an arm that a loop of yours leads, in a tab or in the cell of a notebook."""

from time import monotonic
from typing import Any, Self, final

import numpy as np

from ftqp.control.planner.planner import Planner
from ftqp.control.planner.step import Step
from ftqp.core.checks import FloatArray, array
from ftqp.core.errors import InputError
from ftqp.model.robot import Robot
from ftqp.sim.further_measures import FurtherMeasures
from ftqp.sim.session.frame import DrawnArm, Frame, FurtherFact, Ghost, placed
from ftqp.sim.session.session_commands import Command
from ftqp.sim.session.watched_arm import facts_at
from ftqp.viz.live.live_page import PICTURES, Page
from ftqp.viz.live.stage import Stage

HEIGHT = 480
"""Of the page in a cell [px]."""


def view(what: Planner | Robot, q: Any = None, *, port: int = 8080) -> "View":
    """Open a page that shows a planner's arm, or a robot, and return what moves it.

    Nothing runs next to your loop: call ``shown.show()`` in it as often as you like, and at most thirty times
    a second something is drawn. In a notebook the last line of a cell shows the page; elsewhere open
    ``shown.url``. Joints that the planner believes to have failed have their colours.

        shown = ftqp.view(planner)
        for k in range(4000):
            step = planner.step(q, None, targets.at(k))
            q = step.q.copy()
            shown.show(step)

    Args:
        what: A planner, whose beliefs are shown, or a robot.
        q: The configuration at first, (nv,) or (nq,) [rad or m]; None is the neutral one.
        port: The port on this machine, 0 for any free one; where it is in use, the next free one is taken.

    Raises:
        InputError: It is neither, or no port is free.
        MissingPackage: viser is not installed.
    """
    return View(what, q, port=port)


@final
class View:
    """A page of one arm, until ``close``, as ``view`` opens it."""

    def __init__(self, what: Planner | Robot, q: Any = None, *, port: int = 8080) -> None:
        if not isinstance(what, Planner | Robot):
            raise InputError(f"view shows a planner or a robot, got {type(what).__name__}")
        self._planner = what if isinstance(what, Planner) else None
        self.robot = what.robot if isinstance(what, Planner) else what
        self._drawn, self._due, self._k = DrawnArm(self.robot), -np.inf, 0
        self._measures = None if self._planner is None else FurtherMeasures(self._planner)
        self._lead(None)
        self._frame = self._framed(self.robot.neutral if q is None else self.robot.angles(q), None)
        self._page = Page(self, port=port)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        """Where the page is."""
        return f"<view of {self.robot.name} at {self.url}>"

    def _repr_html_(self) -> str:
        """The page in a cell; where notebooks are not on this machine, its address."""
        return (
            f'<iframe src="{self.url}" width="100%" height="{HEIGHT}" style="border:0"></iframe>'
            f'<div><a href="{self.url}" target="_blank">{self.url}</a></div>'
        )

    @property
    def url(self) -> str:
        """The address of the page, which only this machine reaches."""
        return self._page.url

    def show(self, step: Any = None, *, way: Any = None) -> None:
        """Draw the arm, if the last picture is a thirtieth of a second old.

        Args:
            step: A step of the planner, or a configuration, (nv,) or (nq,) [rad or m]; None draws what there
                is again, with what the planner now believes.
            way: Places that the joints are to go to, (k, nv) [rad or m], as ``GoTo.way`` has them: the end
                effector's way there is drawn, and the arm at its end as a ghost. None: no ghost.

        Raises:
            InputError: The shape is another one, or a number is NaN or infinite.
        """
        self._k += 1
        self._lead(way)
        if monotonic() < self._due:
            return
        if step is None:
            self._frame = self._framed(self._frame.q, None)
        elif isinstance(step, Step):
            self._frame = self._framed(np.array(step.q), step)
        else:
            self._frame = self._framed(self.robot.angles(step), None)
        self._page.refresh()
        self._due = monotonic() + 1.0 / PICTURES  # however long that took, the loop has as long for itself

    def _lead(self, way: Any) -> None:
        """Keep the ghost of a way, made anew where it is another one."""
        if way is None or not np.size(way):
            self._led = np.zeros((0, self.robot.nv))
            self._ghosts: tuple[Ghost, ...] = ()
            return
        places = array("way", way, (*np.shape(way)[:1], self.robot.nv), "(k, nv)")
        if np.array_equal(places, self._led):
            return
        self._led = places.copy()
        price, drawn = f"{np.linalg.norm(np.diff(places, axis=0), axis=1).sum():.1f} rad", self._drawn
        self._ghosts = (
            Ghost(
                kind="way round", clear=True, price=price, sentence=f"way round: {price}", q=self._led,
                joints=drawn.joints(places[-1]), tips=drawn.tips(places),
            ),
        )  # fmt: skip

    def close(self) -> None:
        """End the page."""
        self._page.close()

    def frame(self) -> Frame:
        """The latest frame, for the page."""
        return self._frame

    def stage(self) -> Stage:
        """What stays the same, for the page."""
        planner = self._planner
        return Stage(
            number=0,
            title=self.robot.name,
            robot=self.robot,
            scheme="" if planner is None else planner.scheme.name,
            backend="" if planner is None else planner.backend,
            live=False,
        )

    def put(self, command: Command) -> None:
        """The page has no controls that would move this arm."""

    def _framed(self, q: FloatArray, step: Any) -> Frame:
        """The picture at a configuration, (nv,), after a step or without one."""
        planner, drawn, further = self._planner, self._drawn, tuple[FurtherFact, ...]()
        if planner is not None and self._measures is not None:
            further = facts_at(planner, self._measures, q)
        codes = drawn.codes({} if planner is None else planner.faults)
        return drawn.frame(
            tick=self._k,
            t=self._k * (0.0 if planner is None else planner.dt),
            q=q,
            v=np.zeros(self.robot.nv) if step is None else step.v,
            truth=codes,
            belief=codes,
            target=placed(self.robot.pose(q)),
            status=0 if step is None else step.code,
            position_error=0.0 if step is None else step.position_error,
            rotation_error=0.0 if step is None else step.rotation_error,
            ways=self._ghosts,
            further=further,
        )
