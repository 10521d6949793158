"""From a scenario to the cast of a session: the arm, its naive twin, and what fails by itself."""

from ftqp.app.scenario import document
from ftqp.app.scenario.setup import Setup, resolve, validated
from ftqp.app.schema.planner_section import DetectorTable
from ftqp.core.errors import InputError
from ftqp.sim.session.cast import Cast, Choice, Player
from ftqp.sim.session.session_leader import SessionLeader


def cast_of(choice: Choice, *, twin: bool = True) -> Cast:
    """The cast of a choice.

    Args:
        choice: Scenario, and what takes the place of what it says.
        twin: Whether the naive twin plays, too.

    Raises:
        FtqpError: The scenario is wrong, or cannot be shown live.
    """
    setup = _setup(choice, detector=choice.detector)
    if setup.world is not None:
        raise InputError(
            f"scenario {setup.name} has a moving base, which the live page does not move; run it and view "
            "the run: ftqp run, then ftqp view with its folder"
        )
    other = _setup(choice, detector=False) if twin else None
    return Cast(
        title=setup.name,
        robot=setup.robot,
        path=setup.path,
        q=setup.q,
        v=setup.v,
        schedule=setup.schedule,
        arm=_player(setup),
        twin=None if other is None else _player(other),
        detects=setup.tables.planner.detector is not None,
    )


def _setup(choice: Choice, *, detector: bool | None) -> Setup:
    """The scenario with all choices in the place of its own."""
    overrides = list(choice.overrides)
    if choice.robot is not None:
        overrides += [f"robot.name={choice.robot}"]
    if choice.backend is not None:
        overrides += ["planner.profile=", f"planner.backend={choice.backend}"]
    if choice.scheme is not None:
        overrides += [f"planner.scheme={choice.scheme}"]
    found = document.read(choice.scenario, overrides)
    tables = validated(found)
    if detector is not None and detector != (tables.planner.detector is not None):
        table = DetectorTable() if detector else None
        tables = tables.model_copy(update={"planner": tables.planner.model_copy(update={"detector": table})})
    return resolve(found, tables)


def _player(setup: Setup) -> Player:
    mean = setup.tables.simulation.feed_forward == "mean"
    leader = SessionLeader(setup.planner, setup.path, setup.follower, mean=mean)
    return Player(planner=setup.planner, leader=leader, plant=setup.plant, sensors=setup.sensors)
