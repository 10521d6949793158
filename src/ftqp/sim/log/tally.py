"""The figures of merit of a run, taken from its rows block by block, so that no run is too long for them."""

from collections.abc import Mapping
from copy import deepcopy
from typing import Any, Final, final

import numpy as np

from ftqp.control.moving_base.inertial_task import BaseStatus
from ftqp.control.planner.status import StepStatus
from ftqp.core.checks import FloatArray
from ftqp.kernel.layout.thresholds import TIME_SLACK
from ftqp.sim.log.further_signals import BODIES, FACTS, PLANES, TASKS, names_in
from ftqp.sim.log.limits_kept import Excess, Following, Motion
from ftqp.sim.log.quantiles import Counts, Quantiles
from ftqp.sim.log.signal_blocks import Signals

STATUSES = tuple(status.name for status in StepStatus)
"""Names of the status codes, by position."""
STOP_CODES = (STATUSES.index(StepStatus.STOPPING.name), STATUSES.index(StepStatus.STOPPED.name))
"""Codes of a run that has given up its task."""
MEASURED: Final = (
    "position_error", "rotation_error", "off_path", "sigma_min", "qp_iterations", "qp_residual", "step_time",
)  # fmt: skip
"""Signals of which the extremes are told."""


@final
class Extremes:
    """The largest, the smallest and the root mean square of numbers; what is not finite is left out."""

    def __init__(self) -> None:
        self._count, self._squares = 0, 0.0
        self._largest, self._smallest = -np.inf, np.inf

    def add(self, values: FloatArray) -> None:
        """Take in numbers, (K,)."""
        finite = np.asarray(values, dtype=np.float64)
        finite = finite[np.isfinite(finite)]
        if len(finite):
            self._count += len(finite)
            with np.errstate(over="ignore"):  # no run has such numbers; infinite is what their squares are
                self._squares += float(np.sum(finite**2))
            self._largest = max(self._largest, float(finite.max()))
            self._smallest = min(self._smallest, float(finite.min()))

    @property
    def largest(self) -> float | None:
        """None where there is none."""
        return self._largest if self._count else None

    @property
    def smallest(self) -> float | None:
        """None where there is none."""
        return self._smallest if self._count else None

    @property
    def root_mean_square(self) -> float | None:
        """None where there is none."""
        return float(np.sqrt(self._squares / self._count)) if self._count else None


@final
class Tally:
    """Takes in the rows of a run, and tells its figures of merit.

    Attributes:
        count: How many rows it has taken in.
    """

    def __init__(self, metadata: Mapping[str, Any], *, sensed: bool) -> None:
        self.count = 0
        self._joints = tuple(metadata["joints"])
        self._about = {key: metadata.get(key, []) for key in FACTS.values()}
        self._duration = metadata.get("path_duration")
        self._counts = np.zeros(len(STATUSES), dtype=np.int64)
        self._final: int | None = None
        self._stopped_at: float | None = None
        self._progress: float | None = None
        self._done_at: float | None = None
        self._failures = 0
        self._measured = {name: Extremes() for name in MEASURED}
        self._times, self._iterations = Quantiles(), Counts()
        self._excess, self._motion = Excess(metadata), Motion(metadata)
        self._following = Following() if sensed else None
        self._inertial: dict[str, Extremes] | None = None
        self._base_counts = np.zeros(len(BaseStatus), dtype=np.int64)
        self._last_error: float | None = None
        self._further: dict[str, Extremes] = {}
        self._ends: dict[str, float] = {}

    def after(self, rows: Signals) -> "Tally":
        """Another tally, which has taken in these rows as well; this one stays as it is."""
        result = deepcopy(self)
        result.add(rows)
        return result

    def add(self, rows: Signals) -> None:
        """Take in the rows that come next."""
        if "base_status" in rows and self._inertial is None:
            self._inertial = {"position": Extremes(), "rotation": Extremes()}
        if not len(rows):
            return
        known = np.clip(np.nan_to_num(rows["status"]), 0, len(STATUSES) - 1)  # of a damaged file, too
        t, status = rows["t"], known.astype(np.int64)
        self.count += len(rows)
        self._counts = self._counts + np.bincount(status, minlength=len(STATUSES))
        self._final = int(status[-1])
        stops = np.flatnonzero(np.isin(status, STOP_CODES))
        if self._stopped_at is None and len(stops):
            self._stopped_at = float(t[stops[0]])
        self._along(t, rows["progress"])
        for name, extremes in self._measured.items():
            extremes.add(rows[name])
        self._times.add(np.asarray(rows["step_time"], dtype=np.float64))
        self._iterations.add(np.asarray(rows["qp_iterations"], dtype=np.float64))
        self._failures += int(np.count_nonzero(rows["qp_status"] > 0))
        self._excess.add(rows)
        self._motion.add(rows)
        if self._following is not None:
            self._following.add(rows)
        if self._inertial is not None:
            self._in_space(self._inertial, rows)
        for group in FACTS:
            for name in names_in(rows, self._about, group):
                values = rows[f"{group}.{name}"]
                self._further.setdefault(f"{group}.{name}", Extremes()).add(values)
                self._ends[f"{group}.{name}"] = float(values[-1])

    def _along(self, t: FloatArray, progress: FloatArray) -> None:
        """How far the path came."""
        self._progress = float(progress[-1])
        if self._duration and self._done_at is None:
            done = np.flatnonzero(progress >= self._duration - TIME_SLACK)
            self._done_at = float(t[done[0]]) if len(done) else None

    def _in_space(self, found: dict[str, Extremes], rows: Signals) -> None:
        """True errors of a run on a moving base."""
        error = rows["inertial_error"]
        position = np.linalg.norm(error[:, :3], axis=1)
        found["position"].add(position)
        found["rotation"].add(np.linalg.norm(error[:, 3:], axis=1))
        self._last_error = float(position[-1])
        status = np.asarray(rows["base_status"]).astype(np.int64)
        self._base_counts = self._base_counts + np.bincount(status, minlength=len(BaseStatus))

    def path_facts(self, metadata: Mapping[str, Any]) -> dict[str, Any]:
        """How far the path came, as a share of it, when it was finished [s], and why it was blocked."""
        duration, progress = self._duration, self._progress
        return {
            "reference": metadata.get("reference"),
            "path_progress": progress / duration if duration and progress is not None else None,
            "path_completed_at": self._done_at,
            "blocked": metadata.get("blocked"),
        }

    def facts(self, metadata: Mapping[str, Any]) -> dict[str, Any]:
        """What happened in the run, for ``summary.json``; SI units, ``None`` where nothing is to tell."""
        measured = self._measured
        return {
            **{key: metadata.get(key) for key in ("scenario", "robot", "scheme", "backend", "level", "dt")},
            "steps": self.count,
            "completed": bool(
                metadata.get("state") == "finished"
                and self._stopped_at is None
                and metadata.get("path_finished", True)
            ),
            "final_status": None if self._final is None else STATUSES[self._final],
            "stopped_at": self._stopped_at,
            "status_counts": {
                name: int(count) for name, count in zip(STATUSES, self._counts, strict=True) if count
            },
            "max_position_error": measured["position_error"].largest,
            "rms_position_error": measured["position_error"].root_mean_square,
            "max_rotation_error": measured["rotation_error"].largest,
            "max_off_path": measured["off_path"].largest,
            **self.path_facts(metadata),
            "max_limit_violation": self._excess.worst,
            "max_failed_joint_motion": self._motion.by_joint,
            **self._sensed(metadata),
            "min_sigma_min": measured["sigma_min"].smallest,
            "qp": {
                "iterations_median": self._iterations.median(),
                "iterations_max": measured["qp_iterations"].largest,
                "residual_max": measured["qp_residual"].largest,
                "failures": self._failures,
            },
            "step_time_us": {
                "p50": self._times.at(50.0),
                "p99": self._times.at(99.0),
                "p999": self._times.at(99.9),
                "max": measured["step_time"].largest,
            },
            **_faults(metadata),
            **self._in_inertial_space(),
            **self._further_facts(),
            **({} if metadata.get("learned") is None else {"learned": metadata["learned"]}),
        }

    def _further_facts(self) -> dict[str, Any]:
        """How well soft tasks were done, and how near what is kept came to its boundary [m or rad]."""
        errors, distances, apart = (
            {name.partition(".")[2]: name for name in self._further if name.startswith(f"{group}.")}
            for group in (TASKS, PLANES, BODIES)
        )
        units = {one["name"]: one.get("unit") for one in self._about[FACTS[TASKS]]}
        shapes = {one["name"]: one.get("kind", "plane") for one in self._about[FACTS[PLANES]]}
        said = {one["name"]: {"unit": one["unit"]} for one in self._about[FACTS[PLANES]] if "unit" in one}
        tasks = {
            task: {
                "final_error": _finite(self._ends[name]),
                "max_error": self._further[name].largest,
                "unit": units.get(task, "rad"),  # the angle of a pose
            }
            for task, name in errors.items()
        }
        kept = {
            one: {"min_distance": self._further[name].smallest, "shape": shapes[one], **said.get(one, {})}
            for one, name in distances.items()
        }
        clear = {one: {"min_distance": self._further[name].smallest} for one, name in apart.items()}
        found = {"tasks": tasks, "constraints": kept, "clearance": clear}
        return {key: table for key, table in found.items() if table}

    def _sensed(self, metadata: Mapping[str, Any]) -> dict[str, Any]:
        """How far working joints were from what had been sent, and what is to be known of the plant."""
        if self._following is None:
            return {}
        return {
            **{key: metadata.get(key) for key in ("drive", "plant_tolerance", "broken")},
            "max_following_error": {
                joint: self._following.largest(i) for i, joint in enumerate(self._joints)
            },
        }

    def _in_inertial_space(self) -> dict[str, Any]:
        """True errors of a run on a moving base, and how far the base took the tip along with it."""
        if self._inertial is None:
            return {}
        position, rotation = self._inertial["position"], self._inertial["rotation"]
        counts = zip(BaseStatus, self._base_counts, strict=True)
        return {
            "inertial": {
                "max_position_error": position.largest,
                "rms_position_error": position.root_mean_square,
                "max_rotation_error": rotation.largest,
                "rms_rotation_error": rotation.root_mean_square,
                "final_position_error": self._last_error,
                "status_counts": {status.name: int(count) for status, count in counts if count},
            }
        }


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _faults(about: Mapping[str, Any]) -> dict[str, Any]:
    """What failed and, with a detector, when it was found [s], as which kinds; and what was found wrongly.

    A finding belongs to the fault of its joint that happened before it.
    """
    faults, found = [dict(fault) for fault in about.get("faults", [])], about.get("detections")
    if found is None:
        return {"faults": faults}
    left = list(found)
    for fault in faults:
        own = [one for one in left if one["joint"] == fault["joint"] and one["detected_at"] >= fault["at"]]
        fault["detected_at"] = own[0]["detected_at"] if own else None
        fault["detected_as"] = " or ".join(own[0]["kinds"]) if own else None
        left = [one for one in left if one not in own[:1]]
    return {"faults": faults, "false_detections": left}
