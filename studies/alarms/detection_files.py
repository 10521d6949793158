"""Simulated motions in files, so that another detector sees them without simulating them again.

They are recorded in single precision, also where no file is written.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from alarms.detection_cases import Case, Motion
from alarms.detection_world import Record


def kept(folder: Path | None, begins: list[int], make: Callable[[], Any]) -> Any:
    """A motion or a tour: that of the file, else made and written there."""
    if folder is None:
        return _read(_written(make()))
    file = folder / f"{'-'.join(str(number) for number in begins)}.npz"
    if file.exists():
        with np.load(file) as found:
            return _read(dict(found))
    arrays = _written(make())
    folder.mkdir(parents=True, exist_ok=True)
    part = file.with_suffix(f".{os.getpid()}.part")
    with part.open("wb") as stream:
        np.savez(stream, **arrays)
    part.replace(file)
    return _read(arrays)


def _record(seen: Any) -> Record:
    """A record of which only what a detector may see is known."""
    seen = seen.astype(np.float64)
    return Record(seen, np.zeros((len(seen), 0, 0)), np.zeros(len(seen), dtype=np.int8))


def _written(made: Any) -> dict[str, Any]:
    """The arrays of a motion or a tour."""
    if isinstance(made, Record):
        return {"seen": made.seen.astype(np.float32)}
    arrays = {
        "seen": made.record.seen.astype(np.float32),
        "kinds": np.array([case.kind for case in made.cases]),
    }
    arrays["facts"] = np.array([[c.joint, c.at, c.speed, c.loss, len(c.record.seen)] for c in made.cases])
    arrays["branches"] = np.concatenate([case.record.seen for case in made.cases]).astype(np.float32)
    return arrays


def _read(arrays: dict[str, Any]) -> Any:
    """The motion or the tour of such arrays."""
    record = _record(arrays["seen"])
    if "kinds" not in arrays:
        return record
    cases, first = [], 0
    for kind, (joint, at, speed, loss, count) in zip(arrays["kinds"], arrays["facts"], strict=True):
        branch = _record(arrays["branches"][first : first + int(count)])
        first += int(count)
        cases.append(Case(str(kind), int(joint), int(at), branch, float(speed), float(loss)))
    return Motion(record, cases)
