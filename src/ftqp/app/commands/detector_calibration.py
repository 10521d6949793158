"""``ftqp calibrate``: thresholds, noise and friction of a detector, from runs of the healthy arm."""

from collections.abc import Sequence
from pathlib import Path

from ftqp.app.output.console import ExitCode, say, tell, tell_json
from ftqp.app.run.runs import SCENARIO
from ftqp.app.scenario.setup import load
from ftqp.core.errors import InputError
from ftqp.faults.detection.detector import Detector
from ftqp.sim.log.log_file import load_log


def calibrate(
    runs: Sequence[Path], file: Path, *, alarms: float, extrapolate: bool, as_json: bool
) -> ExitCode:
    """Calibrate on runs and write what was found."""
    if file.exists():
        raise InputError(f"{file} exists, and nothing is overwritten; name another one by --out")
    scenario = runs[0] / SCENARIO
    if not scenario.is_file():
        raise InputError(f"{runs[0]} has no {SCENARIO}; expected the folder of a run, `ftqp run` makes one")
    logs = [load_log(run) for run in runs]
    setup = load(str(scenario))
    planner, table = setup.planner, setup.tables.planner.detector
    settings = Detector() if table is None else table.made(calibration=None)
    blank = settings.for_arm(planner.robot, planner.dt, drive=planner.drive, noise=planner.noise)
    found = blank.calibrate(logs, alarms, extrapolate=extrapolate).calibration
    assert found is not None
    found.save(file)
    if as_json:
        tell_json(
            {
                "file": str(file),
                "hours": found.hours,
                "rate": found.rate,
                "alarms": found.alarms,
                "rate_interval": [found.rate_low, found.rate_high],
                "extrapolated": found.extrapolated,
                "noise": found.sigma,
                "friction": dict(zip(found.joints, found.coulomb.tolist(), strict=True)),
            }
        )
        return ExitCode.DONE
    tell(str(found))
    tell(f"The encoders' noise is {found.sigma:.2g} rad.")
    if found.coulomb.any():
        rubs = ", ".join(f"{joint} {f:.2g}" for joint, f in zip(found.joints, found.coulomb, strict=True))
        tell(f"Coulomb friction [N m]: {rubs}.")
    else:
        say("note: no friction was found; runs without torques do not show any")
    tell(f"{file}: use it by calibration = {str(file)!r} in [planner.detector]")
    return ExitCode.DONE
