"""The file beside a coverage report from which its failures can be played."""

import json
from dataclasses import dataclass
from pathlib import Path as File
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from ftqp.app.output.console import json_text
from ftqp.app.run.runs import SCENARIO, write
from ftqp.core.errors import reading
from ftqp.faults.kinds import KINDS
from ftqp.viz.live.stage import HeatMap

if TYPE_CHECKING:
    from ftqp.analysis import CoverageReport  # slow to load, needed for writing only

VERDICTS: Final = "verdicts.json"
FORMAT: Final = 1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Verdicts:
    """What a coverage report holds for a page that plays its failures, of one kind with its settings."""

    name: str
    heat: HeatMap
    scenario: File
    kind: str
    settings: dict[str, Any]


def write_verdicts(
    folder: File, rep: "CoverageReport", name: str, scenario: str, share: float | None
) -> None:
    """Put the verdicts and the scenario into the folder of a report."""
    settings: dict[str, Any] = {}
    if rep.fault == "locked":
        settings = {"mode": rep.lock}
    elif share is not None and "v_max" in KINDS[rep.fault].shares:
        settings = {KINDS[rep.fault].shares["v_max"]: share}
    content = {
        "format": FORMAT,
        "scenario": name,
        "failures": list(rep.names),
        "times": rep.t,
        "codes": rep.status,
        "coverage": rep.coverage,
        "fault": rep.fault,
        "settings": settings,
    }
    write(folder / VERDICTS, json_text(content))
    write(folder / SCENARIO, scenario)


def read_verdicts(folder: File) -> Verdicts:
    """The verdicts of a coverage report."""
    from ftqp.viz.figures.study_pictures import LOOKS

    file = folder / VERDICTS
    with reading(file, "the list of verdicts of a coverage report", "make it anew by ftqp coverage"):
        content = json.loads(file.read_text(encoding="utf-8"))
        if content["format"] != FORMAT:
            raise ValueError(f"its format is {content['format']}, expected {FORMAT}")
        names, times = [str(name) for name in content["failures"]], np.array(content["times"], dtype=float)
        codes = np.array(content["codes"], dtype=np.int64)
        if codes.shape != (len(names), len(times)) or not set(codes.flat) <= set(map(int, LOOKS)):
            raise ValueError("it has no verdict of each failure and instant, or one that does not exist")
        name = str(content["scenario"])
        kind, settings, share = str(content["fault"]), dict(content["settings"]), float(content["coverage"])
    heat = HeatMap(
        joints=tuple(names),
        times=times,
        codes=codes,
        words={int(verdict): words for verdict, (_, words) in LOOKS.items()},
        colours={int(verdict): colour for verdict, (colour, _) in LOOKS.items()},
        coverage=share,
    )
    return Verdicts(name=name, heat=heat, scenario=folder / SCENARIO, kind=kind, settings=settings)
