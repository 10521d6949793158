"""``ftqp export``: a run for other programs, or an arm as a URDF."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ftqp.app.output.console import ExitCode, answer, progress, say
from ftqp.core.errors import InputError, unknown

FORMATS = {
    "mcap": ("bag", "a ROS 2 bag in the MCAP format, for Foxglove, PlotJuggler, RViz and `ros2 bag play`"),
    "csv": ("log.csv", "all signals as text, for spreadsheets"),
    "npz": ("log.npz", "all signals for numpy.load"),
    "mat": ("log.mat", "all signals for MATLAB and Octave"),
    "trajectory": ("trajectory", "a JointTrajectory in a bag, and as CSV, for ros2_control"),
    "urdf": ("{robot}.urdf", "the arm"),
}
"""Formats: the name that the file or folder gets beside the log, and what it is."""


def export(source: str, form: str, output: Path | None = None, as_json: bool = False) -> ExitCode:
    """Write a run for other programs: a ROS 2 bag, CSV, NPZ, MAT, a trajectory, or its arm as a URDF.

    Options:
        source RUN|ROBOT: The folder of a run, its log, or a robot of the catalog.
        form --format NAME: mcap, csv, npz, mat, trajectory, urdf
        output -o --output FILE: New file or folder; next to the log if left out.
    """
    if form not in FORMATS:
        raise unknown("format", form, "ftqp export", FORMATS)
    facts = _of_run(Path(source), form, output) if Path(source).exists() else _of_robot(source, form, output)
    ticks = f"{facts['ticks']} ticks, " if "ticks" in facts else ""
    said = f"{facts['file']}: {FORMATS[form][1]}; {ticks}{_size(facts['bytes'])}"
    answer(facts, as_json, [said])
    for note in facts["notes"]:
        say(f"note: {note}")
    return ExitCode.DONE


def _of_robot(name: str, form: str, output: Path | None) -> dict[str, Any]:
    """A robot of the catalog as a URDF."""
    from ftqp.model import catalog

    if name.partition("(")[0] not in catalog.names():
        raise unknown(
            "run or robot", name, "ftqp", catalog.names(), "`ftqp run SCENARIO --out FOLDER` makes a run"
        )
    if form != "urdf":
        raise InputError(f"{name} is a robot, no run; it goes with --format urdf alone")
    robot = catalog.load(name)
    return _urdf(robot.to_urdf(), output or Path(f"{robot.name}.urdf"), [])


def _urdf(text: str, file: Path, notes: list[str]) -> dict[str, Any]:
    from ftqp.sim.log.table_files import new_file

    with new_file(file) as part:
        part.write_text(text, encoding="utf-8")
    return {"format": "urdf", "file": str(file), "bytes": file.stat().st_size, "notes": notes}


def _of_run(source: Path, form: str, output: Path | None) -> dict[str, Any]:
    """A run in one of the formats."""
    from ftqp.app.run.recorded_robot import notes_of, recorded_robot
    from ftqp.sim.log.log_file import open_log

    rows = open_log(source)
    notes = notes_of(rows.metadata, rows.end)
    folder = source if source.is_dir() else source.parent
    if form == "urdf":
        robot, why = recorded_robot(rows)
        if robot is None:
            raise InputError(f"{why}; so no URDF can be written")
        return _urdf(robot.to_urdf(), output or folder / f"{robot.name.replace('/', '_')}.urdf", notes)
    file = output or folder / FORMATS[form][0]
    facts: dict[str, Any] = {"format": form, "file": str(file), "ticks": rows.count, "notes": notes}
    with progress(f"{rows.title} as {form}", 1.0) as notify:
        facts |= _written(rows, form, file, notify, notes)
    return facts | {"bytes": _bytes(file)}


def _written(
    rows: Any, form: str, file: Path, notify: Callable[[float], None], notes: list[str]
) -> dict[str, Any]:
    """Write the file; what there is to say about it."""
    from ftqp.sim.log import table_files

    if form == "mcap":
        from ftqp.app.run.recorded_robot import recorded_robot
        from ftqp.sim.export.run_bag import write_bag

        robot, why = recorded_robot(rows)
        if robot is None:
            notes.append(f"{why}; so the bag has neither /tf nor /robot_description")
        return {
            "messages": write_bag(rows, file, robot, notify),
            "robot": None if robot is None else robot.name,
        }
    if form == "trajectory":
        from ftqp.sim.export.ros_bag import AT_REST, write_trajectory

        speed = write_trajectory(rows, file, notify)
        if speed > AT_REST:
            notes.append(
                f"the last point still moves at {speed:.3g} rad/s or m/s; a joint_trajectory_controller "
                "takes that only with allow_nonzero_velocity_at_trajectory_end"
            )
        return {"last_speed": speed}
    writers = {"csv": table_files.write_csv, "npz": table_files.write_npz, "mat": table_files.write_mat}
    writers[form](rows, file, notify)
    return {}


def _bytes(path: Path) -> int:
    return sum(file.stat().st_size for file in path.rglob("*")) if path.is_dir() else path.stat().st_size


def _size(count: int) -> str:
    return f"{count / 1e6:.1f} MB" if count >= 1e5 else f"{count / 1e3:.1f} kB"
