"""Figures of merit of a run, computed from its log alone."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ftqp.control.moving_base.inertial_task import BaseStatus
from ftqp.control.planner.status import StepStatus
from ftqp.core.checks import BoolArray, FloatArray
from ftqp.faults.kinds import KINDS
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.schedule import TIME_SLACK

STATUSES = tuple(status.name for status in StepStatus)
"""Names of the status codes, by position."""
STOP_CODES = (STATUSES.index(StepStatus.STOPPING.name), STATUSES.index(StepStatus.STOPPED.name))
"""Codes of a run that has given up its task."""


BRAKED = 1e-3
"""Speed below which a joint that a real brake holds counts as at rest [rad/s or m/s]: brakes creep."""


def summary(log: Log) -> dict[str, Any]:
    """What happened in a run, ready for ``summary.json``; SI units, ``None`` where there is nothing to tell.

    A limit counts for a joint as long as it works: at its healthy value, from the announcement of a
    degradation on at what is left of it, and there not before the joint has been inside once. A locked
    joint's motion counts from the moment its velocity has become zero.
    """
    about = log.metadata
    status = log["status"]
    stops = np.flatnonzero(np.isin(status, STOP_CODES))
    counts = (
        np.bincount(status, minlength=len(STATUSES)) if len(log) else np.zeros(len(STATUSES), dtype=np.int64)
    )
    qp_claims = log["qp_status"]
    return {
        **{key: about.get(key) for key in ("scenario", "robot", "scheme", "backend", "level", "dt")},
        "steps": len(log),
        "completed": bool(
            about.get("state") == "finished" and len(stops) == 0 and about.get("path_finished", True)
        ),
        "final_status": STATUSES[int(status[-1])] if len(log) else None,
        "stopped_at": float(log["t"][stops[0]]) if len(stops) else None,
        "status_counts": {name: int(count) for name, count in zip(STATUSES, counts, strict=True) if count},
        "max_position_error": _largest(log["position_error"]),
        "rms_position_error": _root_mean_square(log["position_error"]),
        "max_rotation_error": _largest(log["rotation_error"]),
        "max_off_path": _largest(log["off_path"]),
        **path_facts(log),
        "max_limit_violation": limit_violations(log),
        "max_failed_joint_motion": failed_joint_motion(log),
        **(_sensed(log) if is_sensed(log) else {}),
        "min_sigma_min": _smallest(log["sigma_min"]),
        "qp": {
            "iterations_median": _percentile(log["qp_iterations"], 50.0),
            "iterations_max": _largest(log["qp_iterations"]),
            "residual_max": _largest(log["qp_residual"]),
            "failures": int(np.count_nonzero(qp_claims > 0)),
        },
        "step_time_us": {
            "p50": _percentile(log["step_time"], 50.0),
            "p99": _percentile(log["step_time"], 99.0),
            "p999": _percentile(log["step_time"], 99.9),
            "max": _largest(log["step_time"]),
        },
        **_faults(about),
        **(_inertial(log) if "base_status" in log else {}),
    }


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


def _sensed(log: Log) -> dict[str, Any]:
    """How far working joints were from what had been sent, and what is to be known of the plant."""
    return {
        "drive": log.metadata.get("drive"),
        "plant_tolerance": log.metadata.get("plant_tolerance"),
        "broken": log.metadata.get("broken"),
        "max_following_error": {
            joint: _largest(np.abs(error))
            for joint, error in zip(log.metadata["joints"], following_error(log).T, strict=True)
        },
    }


def is_sensed(log: Log) -> bool:
    """Whether the log keeps what was sent and what was measured beside what was true."""
    return f"q_command.{log.metadata['joints'][0]}" in log


def following_error(log: Log) -> FloatArray:
    """What was sent for a tick minus where the joint truly was then, (K, nv) [rad or m].

    It is 0 at the first tick, before anything was sent, and NaN for a joint that does not work.
    """
    error = np.zeros(log["q"].shape)
    error[1:] = log["q_command"][:-1] - log["q"][1:]
    idle = np.isin(log["truth"], [kind.number for kind in KINDS.values() if not kind.works])
    return np.where(idle, np.nan, error)


def _inertial(log: Log) -> dict[str, Any]:
    """True errors of a run on a moving base, and how far the base took the tip along with it."""
    error, status = log["inertial_error"], log["base_status"]
    counts = np.bincount(status, minlength=len(BaseStatus))
    position, rotation = np.linalg.norm(error[:, :3], axis=1), np.linalg.norm(error[:, 3:], axis=1)
    return {
        "inertial": {
            "max_position_error": _largest(position),
            "rms_position_error": _root_mean_square(position),
            "max_rotation_error": _largest(rotation),
            "rms_rotation_error": _root_mean_square(rotation),
            "final_position_error": float(position[-1]) if len(log) else None,
            "status_counts": {s.name: int(n) for s, n in zip(BaseStatus, counts, strict=True) if n},
        }
    }


def path_facts(log: Log) -> dict[str, Any]:
    """How far the path came, as a share of it, when it was finished [s], and why it was blocked."""
    duration, progress = log.metadata.get("path_duration"), log["progress"]
    done = np.flatnonzero(progress >= duration - TIME_SLACK) if duration else np.zeros(0, dtype=np.int64)
    return {
        "reference": log.metadata.get("reference"),
        "path_progress": float(progress[-1] / duration) if duration and len(log) else None,
        "path_completed_at": float(log["t"][done[0]]) if len(done) else None,
        "blocked": log.metadata.get("blocked"),
    }


def limit_violations(log: Log) -> dict[str, float]:
    """The largest excess of a working joint over its limits of q, v, a and motor torque; 0 if none."""
    limits = log.metadata["limits"]
    worst = {"q": 0.0, "v": 0.0, "a": 0.0, "tau": 0.0}
    for i in range(len(log.metadata["joints"])):
        working = ~np.isin(log["truth"][:, i], [kind.number for kind in KINDS.values() if not kind.works])
        for signal, low, high in (
            ("q", "q_min", "q_max"),
            ("v", None, "v_max"),
            ("a", None, "a_max"),
            ("tau", None, "tau_max"),
        ):
            top = _limit(log, limits, high, i, np.inf)
            bottom = -top if low is None else _limit(log, limits, low, i, -np.inf)
            excess = np.maximum(log[signal][:, i] - top, bottom - log[signal][:, i])
            counts = working & _been_inside(log, i, excess, signal)
            worst[signal] = max(worst[signal], _largest(excess[counts]) or 0.0)
    return worst


def _limit(log: Log, limits: Mapping[str, Any], name: str, i: int, infinite: float) -> FloatArray:
    """A limit of joint i over time, (K,), lowered from the announcement of a degradation on."""
    healthy = limits[name][i]
    values = np.full(len(log), infinite if healthy is None else healthy, dtype=np.float64)
    for fault in log.metadata.get("faults", []):
        if fault["index"] != i or fault["announced"] is None:
            continue
        shares = KINDS[fault["kind"]].shares
        since = log["t"] >= fault["announced"] - TIME_SLACK
        if name in ("q_min", "q_max"):
            if fault.get(name) is not None:
                values[since] = (
                    max(fault[name], values[0]) if name == "q_min" else min(fault[name], values[0])
                )
        elif name in shares:
            values[since] *= fault[shares[name]]
    return values


def _been_inside(log: Log, i: int, excess: FloatArray, signal: str) -> BoolArray:
    """Where the excess of joint i counts: after a degradation only once the joint has been inside."""
    counts = np.ones(len(log), dtype=np.bool_)
    if signal in ("q", "v"):
        for fault in log.metadata.get("faults", []):
            if KINDS[fault["kind"]].works and fault["index"] == i and fault["announced"] is not None:
                since = log["t"] >= fault["announced"] - TIME_SLACK
                counts &= ~since | np.logical_or.accumulate(since & (excess <= 0.0))
    return counts


def failed_joint_motion(log: Log) -> dict[str, float]:
    """How far each locked joint has moved since it came to rest, each free one since it failed [rad or m]."""
    motion: dict[str, float] = {}
    for fault in log.metadata.get("faults", []):
        i = fault["index"]
        if KINDS[fault["kind"]].works:
            continue
        failed = log["truth"][:, i] == KINDS[fault["kind"]].number
        failed &= log["t"] >= fault["at"] - TIME_SLACK
        if fault["kind"] == "locked":
            rest = BRAKED if log.metadata.get("plant_tolerance") else 0.0
            failed &= np.logical_or.accumulate(failed & (np.abs(log["v"][:, i]) <= rest))
        q = log["q"][failed, i]
        if len(q):
            motion[fault["joint"]] = float(np.abs(q - q[0]).max())
    return motion


def _finite(values: Any) -> FloatArray:
    numbers = np.asarray(values, dtype=np.float64)
    result: FloatArray = numbers[np.isfinite(numbers)]
    return result


def _largest(values: Any) -> float | None:
    finite = _finite(values)
    return float(finite.max()) if len(finite) else None


def _smallest(values: Any) -> float | None:
    finite = _finite(values)
    return float(finite.min()) if len(finite) else None


def _root_mean_square(values: Any) -> float | None:
    finite = _finite(values)
    return float(np.sqrt(np.mean(finite**2))) if len(finite) else None


def _percentile(values: Any, percent: float) -> float | None:
    finite = _finite(values)
    return float(np.percentile(finite, percent)) if len(finite) else None
