"""Figures of merit of a run, computed from its log alone."""

from collections import Counter
from collections.abc import Mapping, Sequence
from copy import deepcopy
from typing import Any, Final, final

import numpy as np

from ftqp.control.moving_base.inertial_task import BaseStatus
from ftqp.control.planner.status import StepStatus
from ftqp.core.checks import BoolArray, FloatArray, IntArray
from ftqp.faults.kinds import KINDS, kind_of
from ftqp.kernel.layout.thresholds import TIME_SLACK
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.log_rows import RowSink
from ftqp.sim.log.signals import BODIES, FACTS, PLANES, TASKS, Column, names_in, refuse_unknown_conditions

EXACT = 200_000
"""So many numbers are kept, and their quantiles are exact."""
RATIO = 1.001
"""The upper end of a bin by its lower one, where numbers are only counted."""
LEAST = 1e-6
"""Numbers below, those that are not positive included, are counted in the lowest bin."""
BINS = 32_000
"""Bins, so that the highest one begins at 8e7 in the unit of the numbers."""


@final
class Quantiles:
    """Takes in numbers, and tells their quantiles; what is no number is left out.

    Attributes:
        count: How many numbers it has taken in.
    """

    def __init__(self) -> None:
        self.count = 0
        self._kept: FloatArray | None = np.empty(0)
        self._bins: IntArray = np.zeros(0, dtype=np.int64)

    def add(self, values: FloatArray) -> None:
        """Take in numbers, (K,)."""
        finite = values[np.isfinite(values)]
        self.count += len(finite)
        if self._kept is not None:
            self._kept = np.concatenate([self._kept, finite])
            if self.count <= EXACT:
                return
            finite, self._kept, self._bins = self._kept, None, np.zeros(BINS, dtype=np.int64)
        places = np.log(np.maximum(finite, LEAST) / LEAST) / np.log(RATIO)
        self._bins = self._bins + np.bincount(np.minimum(places.astype(np.int64), BINS - 1), minlength=BINS)

    def at(self, percent: float) -> float | None:
        """The number below which so many lie [%]; None where there is none."""
        if not self.count:
            return None
        if self._kept is not None:
            return float(np.percentile(self._kept, percent))
        place = int(np.searchsorted(np.cumsum(self._bins), percent / 100.0 * (self.count - 1), side="right"))
        return LEAST * float(RATIO ** (min(place, BINS - 1) + 0.5))


BRAKED = 1e-3
"""Speed below which a joint that a real brake holds counts as at rest [rad/s or m/s]: brakes creep."""
LIMITED: Final = (
    ("q", "q_min", "q_max"),
    ("v", None, "v_max"),
    ("a", None, "a_max"),
    ("tau", None, "tau_max"),
)
"""Signals with the names of their lower and upper limits; for None the lower is minus the upper one."""
IDLE: Final = [kind.number for kind in KINDS.values() if not kind.works]
"""What ``truth`` says of joints that do not work."""


@final
class Excess:
    """The largest excess of a working joint over its limits of q, v, a and motor torque.

    A limit counts at its healthy value, from the announcement of a degradation on at what is left of it, and
    there not before the joint has been inside once.

    Attributes:
        worst: By signal; 0 where every limit was kept.
    """

    def __init__(self, metadata: Mapping[str, Any]) -> None:
        self._limits = metadata["limits"]
        self._weak = [
            (number, fault)
            for number, fault in enumerate(metadata.get("faults", []))
            if fault["announced"] is not None
        ]
        self._inside: dict[tuple[int, str], bool] = {}
        self._first: float | None = None
        self.worst = {"q": 0.0, "v": 0.0, "a": 0.0, "tau": 0.0}

    def add(self, rows: Log) -> None:
        """Look at the rows that come next."""
        t = rows["t"]
        if not len(t):
            return
        self._first = float(t[0]) if self._first is None else self._first
        refuse_unknown_conditions(rows["truth"], "the log")
        works = ~np.isin(rows["truth"], IDLE)
        for signal, low, high in LIMITED:
            values = rows[signal]
            top = self._limit(t, values.shape, high, np.inf)
            bottom = -top if low is None else self._limit(t, values.shape, low, -np.inf)
            with np.errstate(invalid="ignore", over="ignore"):  # inf - inf is no excess
                excess = np.maximum(values - top, bottom - values)
            counts = works.copy()
            if signal in ("q", "v"):
                for number, fault in self._weak:
                    if kind_of(fault["kind"]).works:
                        i, since = fault["index"], t >= fault["announced"] - TIME_SLACK
                        been = np.logical_or.accumulate(since & (excess[:, i] <= 0.0))
                        been |= self._inside.get((number, signal), False)
                        counts[:, i] &= ~since | been
                        self._inside[number, signal] = bool(been[-1])
            found = excess[counts & np.isfinite(excess)]
            self.worst[signal] = max(self.worst[signal], float(found.max(initial=0.0)))

    def _limit(self, t: FloatArray, shape: tuple[int, ...], name: str, infinite: float) -> FloatArray:
        """A limit of all joints over time, (K, nv), lowered from the announcement of a degradation on."""
        healthy = np.array([infinite if value is None else value for value in self._limits[name]])
        values: FloatArray = np.broadcast_to(healthy, shape)
        for _, fault in self._weak:
            i, shares = fault["index"], kind_of(fault["kind"]).shares
            since = t >= fault["announced"] - TIME_SLACK
            from_start = self._first is not None and self._first >= fault["announced"] - TIME_SLACK
            narrower = fault.get(name) if name in ("q_min", "q_max") else None
            if narrower is None and name not in shares:
                continue
            values = values.copy()
            if narrower is not None:
                left = max(narrower, healthy[i]) if name == "q_min" else min(narrower, healthy[i])
                values[since, i] = left
                healthy[i] = left if from_start else healthy[i]
            else:
                values[since, i] *= fault[shares[name]]
        return values


@final
class Motion:
    """How far each locked joint has moved since it came to rest, each free one since it failed [rad or m]."""

    def __init__(self, metadata: Mapping[str, Any]) -> None:
        self._faults = [
            (number, fault)
            for number, fault in enumerate(metadata.get("faults", []))
            if not kind_of(fault["kind"]).works
        ]
        self._rest = BRAKED if metadata.get("plant_tolerance") else 0.0
        self._at_rest: dict[int, bool] = {}
        self._from: dict[int, float] = {}
        self._moved: dict[int, float] = {}

    def add(self, rows: Log) -> None:
        """Look at the rows that come next."""
        t = rows["t"]
        if not len(t):
            return
        for number, fault in self._faults:
            i = fault["index"]
            failed = rows["truth"][:, i] == kind_of(fault["kind"]).number
            failed = failed & (t >= fault["at"] - TIME_SLACK)
            if fault["kind"] == "locked":
                rested = np.logical_or.accumulate(failed & (np.abs(rows["v"][:, i]) <= self._rest))
                rested |= self._at_rest.get(number, False)
                self._at_rest[number] = bool(rested[-1])
                failed &= rested
            q = rows["q"][failed, i]
            if len(q):
                begun = self._from.setdefault(number, float(q[0]))
                self._moved[number] = max(self._moved.get(number, 0.0), float(np.abs(q - begun).max()))

    @property
    def by_joint(self) -> dict[str, float]:
        """By the name of the joint, those that have failed."""
        return {
            fault["joint"]: self._moved[number] for number, fault in self._faults if number in self._moved
        }


@final
class Following:
    """What was sent for a tick minus where the joint then was; 0 at the first, NaN of one that fails."""

    def __init__(self) -> None:
        self._sent: FloatArray | None = None
        self._worst: FloatArray | None = None

    def add(self, rows: Log) -> FloatArray:
        """The errors of the rows that come next, (K, nv)."""
        q, sent = rows["q"], rows["q_command"]
        error = np.zeros(q.shape)
        error[1:] = sent[:-1] - q[1:]
        if self._sent is not None and len(q):
            error[0] = self._sent - q[0]
        idle: BoolArray = np.isin(rows["truth"], IDLE)
        result: FloatArray = np.where(idle, np.nan, error)
        if len(q):
            size = np.where(np.isfinite(result), np.abs(result), -np.inf).max(axis=0)
            self._worst = size if self._worst is None else np.maximum(self._worst, size)
            self._sent = sent[-1].copy()
        return result

    def largest(self, i: int) -> float | None:
        """The largest error of joint i; None where there is none."""
        worst = -np.inf if self._worst is None else float(self._worst[i])
        return worst if np.isfinite(worst) else None


STATUSES = tuple(status.name for status in StepStatus)
"""Names of the status codes, by position."""
STOP_CODES = (STATUSES.index(StepStatus.STOPPING.name), STATUSES.index(StepStatus.STOPPED.name))
"""Codes of a run that has given up its task."""
MEASURED: Final = (
    "position_error", "rotation_error", "off_path", "sigma_min", "qp_iterations", "qp_residual", "step_time",
)  # fmt: skip
"""Signals of which the extremes are listed."""


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
        self._times, self._iterations = Quantiles(), Counter[float]()
        self._excess, self._motion = Excess(metadata), Motion(metadata)
        self._following = Following() if sensed else None
        self._inertial: dict[str, Extremes] | None = None
        self._base_counts = np.zeros(len(BaseStatus), dtype=np.int64)
        self._last_error: float | None = None
        self._further: dict[str, Extremes] = {}
        self._ends: dict[str, float] = {}

    def add(self, rows: Log) -> None:
        """Take in the rows that come next."""
        if "base_status" in rows and self._inertial is None:
            self._inertial = {"position": Extremes(), "rotation": Extremes()}
        if not len(rows):
            return
        t, status = rows["t"], rows["status"].astype(np.int64)
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
        iterations = np.asarray(rows["qp_iterations"], dtype=np.float64)
        self._iterations.update(iterations[np.isfinite(iterations)].tolist())
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

    def _in_space(self, found: dict[str, Extremes], rows: Log) -> None:
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
                "iterations_median": _median(self._iterations),
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


def _median(counts: Counter[float]) -> float | None:
    """The middle one of counted numbers; None where there is none."""
    if not counts:
        return None
    return float(np.median(np.repeat(list(counts), list(counts.values()))))


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _faults(about: Mapping[str, Any]) -> dict[str, Any]:
    """What failed and, with a detector, when it was found [s], as which kinds; and what was found wrongly."""
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


@final
class TalliedRows(RowSink):
    """Hands rows on, and keeps their tally."""

    def __init__(self, sink: RowSink, columns: Sequence[Column], metadata: Mapping[str, Any]) -> None:
        self._sink, self._columns, self._metadata = sink, columns, dict(metadata)
        self._tally = Tally(metadata, sensed=any(one.name.startswith("q_command.") for one in columns))

    def write(self, first: int, rows: FloatArray) -> None:
        """Keep rows, (K, columns); repeated with the same ``first``, they count once."""
        self._sink.write(first, rows)
        if first == self._tally.count:
            tally = deepcopy(self._tally)  # so that this can be repeated, wherever it is interrupted
            tally.add(Log.of_table(None, rows, self._columns, self._metadata))
            self._tally = tally

    def annotate(self, metadata: Mapping[str, Any]) -> None:
        self._sink.annotate(metadata)
        self._metadata |= metadata

    def close(self) -> None:
        self._sink.close()

    def facts(self) -> dict[str, Any]:
        """What happened in the run so far, ready for ``summary.json``."""
        return self._tally.facts(self._metadata)


def summary(log: Log) -> dict[str, Any]:
    """What happened in a run, ready for ``summary.json``; SI units, ``None`` where there is nothing to tell.

    A limit counts for a joint as long as it works: at its healthy value, from the announcement of a
    degradation on at what is left of it, and there not before the joint has been inside once. A locked
    joint's motion counts from the moment its velocity has become zero. Quantiles of the times of more than
    200,000 steps are within 0.1 % of themselves.
    """
    tally = Tally(log.metadata, sensed=is_sensed(log))
    tally.add(log)
    return tally.facts(log.metadata)


def is_sensed(log: Log) -> bool:
    """Whether the log keeps what was sent and what was measured beside what was true."""
    return f"q_command.{log.metadata['joints'][0]}" in log
