"""A study of a workspace: what happens from every start when a joint locks and nobody notices."""

from dataclasses import dataclass
from typing import ClassVar, Literal

from ftqp.app.schema.reading import Table
from ftqp.app.schema.robot_section import Quaternion, RobotTable
from ftqp.core.errors import InputError
from ftqp.core.setting import REQUIRED, keys_of, setting

PLANAR = ("screen", "horizon", "length", "box", "gain", "v_max")
"""Keys that go with planar arms, that is, without rows ..."""
SPATIAL = ("orientation", "plane", "instants")
"""... and those that need rows."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MapTable(Table):
    """The goal, the starts, and what is asked of them."""

    goal: tuple[float, ...] = setting(
        REQUIRED, "where the tip is to go, [x, y] or [x, y, z]", unit="m", count=(2, 3)
    )
    rows: Literal["position", "pose"] | tuple[str, ...] | None = setting(
        None, "task rows of an arm in space, 'position', 'pose' or their names; planar arms if absent"
    )
    orientation: Quaternion | None = setting(
        None, "quaternion x, y, z, w of the goal, where rows count rotation"
    )
    plane: Literal["xy", "xz", "yz", "space"] | None = setting(
        None, "with rows: the plane through the goal that is mapped, xz if absent, or all of space"
    )
    instants: int | None = setting(
        None, "with rows: nodes of a line at which failures are simulated, 4 if absent", least=1.0
    )
    grid: int = setting(52, "nodes of the square grid of starts along each axis, >= 2", least=2.0)
    configurations: int = setting(90, "postures on each component of a self-motion, >= 1", least=1.0)
    steps: int = setting(100, "equal parts of the straight line to the goal, >= 1", least=1.0)
    screen: bool = setting(
        True, "whether failures that no trial found dangerous are taken as harmless, not simulated"
    )
    horizon: float | None = setting(
        None, "the tip must be there within, > 0; without it, at last", unit="s", above=0.0
    )
    length: str = setting(
        "cartesian", "whether shares are of the tip's way or of the joints'", choices=("cartesian", "joint")
    )
    box: str = setting(
        "product",
        "whether the ranges of all components of the goal's self-motion count together",
        choices=("product", "per_component"),
    )
    weights: tuple[tuple[float, ...], ...] | None = setting(
        None, "W, weights of the joint rates in the controller, (nv, nv); the identity if absent"
    )
    gain: float = setting(1.0, "of the controller, > 0", unit="1/s", above=0.0)
    v_max: float | None = setting(None, "largest speed of the tip, > 0", unit="m/s", above=0.0)
    seed: int = setting(0, "moves quasi-random postures, >= 0", least=0.0)

    def __post_init__(self) -> None:
        if self.rows is None:
            if unfit := [key for key in SPATIAL if getattr(self, key) is not None]:
                raise InputError(f"has {', '.join(unfit)} without rows, which an arm in space needs")
        elif unfit := [key for key in PLANAR if getattr(self, key) != keys_of(MapTable)[key].default]:
            raise InputError(f"has {', '.join(unfit)} beside rows; they go with planar arms, without rows")


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkspaceFile(Table):
    """A whole study of a workspace."""

    whole: ClassVar[str] = "a study"

    description: str = setting("", "what a reader should know")
    robot: RobotTable = setting(REQUIRED, "the arm")
    map: MapTable = setting(REQUIRED, "the goal, the starts, and what is asked of them")
