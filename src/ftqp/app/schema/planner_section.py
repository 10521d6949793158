"""The table ``[planner]``: its own keys, and those that its parts declare."""

from dataclasses import dataclass
from typing import Any, ClassVar

from ftqp.app.schema.reading import Options, Table, options
from ftqp.control.drive.joint_drive import Drive, Noise
from ftqp.control.following.stall import StallEscape
from ftqp.control.planner.planner import Planner
from ftqp.control.task.task import EmergencyStop, Task
from ftqp.core.errors import InputError
from ftqp.core.setting import setting
from ftqp.faults.detection.detector import Detector

Named = dict[str, Any]
"""A name with settings that their owner checks; in a file the name alone will do."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerTable(Table):
    """How the next command is chosen."""

    explained_by: ClassVar[type[Planner]] = Planner
    dt: float = setting(1e-3, unit="s", above=0.0, most=1.0)
    level: str = setting("acceleration", choices=("acceleration", "velocity"))
    drive: Options[Drive] = setting(options(Drive), short="kind")
    noise: Options[Noise] = setting(options(Noise))
    scheme: Named | None = setting(
        None,
        "a scheme or a table with its gains, see `ftqp schemes`; mvn, or rmp with a plan, if absent",
        short="name",
    )
    task: Options[Task] = setting(options(Task))
    bounds: Named = setting(
        {"name": "viability"}, "'viability', 'jin', 'one_step' or a table with the gains of jin", short="name"
    )
    backend: Named | None = setting(
        None,
        "a QP backend or a table with its settings, see `ftqp backends`; active_set if absent",
        short="name",
    )
    profile: str | None = setting(None, "a backend's TOML profile, in place of backend", file=True)
    posture: tuple[float, ...] | None = setting(None, unit="rad or m")
    plan: str | None = setting(
        None,
        "a file of `ftqp plan`: the arm starts as it does, and its postures lead the null space; "
        "scheme is rmp if absent",
        file=True,
    )
    branch_limits: dict[str, tuple[float, float]] | None = setting(None, unit="rad or m", infinite=True)
    torque_limits: bool = setting(True)
    emergency: Options[EmergencyStop] | None = setting(
        options(EmergencyStop), "the emergency stop; 'off' to have none", off=True
    )
    detector: Options[Detector] | None = setting(None)
    stall: Options[StallEscape] | None = setting(
        options(StallEscape),
        "the escape of a stalled path, for reference = 'progress'; 'off' to have none",
        off=True,
    )
    bridges: bool = setting(
        False,
        "whether a blocked path goes on from another posture, to which the tip leaves it, for reference = "
        "'progress'",
    )
    leave: float | None = setting(
        None,
        "how far the tip may leave a blocked path to go on from another posture, for reference = 'progress'; "
        "if absent, anywhere with bridges and not at all without",
        unit="m",
        least=0.0,
    )

    remember: float | None = setting(None, unit="s", above=0.0)

    def __post_init__(self) -> None:
        if self.backend is not None and self.profile is not None:
            raise InputError("has backend and profile, expected one of them")
        if self.scheme is None:
            object.__setattr__(self, "scheme", {"name": "mvn" if self.plan is None else "rmp"})
