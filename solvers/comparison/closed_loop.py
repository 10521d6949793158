"""Runs a scenario in closed loop with one backend after the other and judges whether the runs agree."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench.contenders import REFERENCE, Contender
from bench.isolation import LIMIT, isolated

from ftqp.app.compare.combinations import file_name
from ftqp.app.scenario import document
from ftqp.app.scenario.setup import Setup, load, validated
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.log.log_file import load_log
from ftqp.sim.log.metrics import summary
from ftqp.sim.loop import Simulation
from ftqp.viz.figures.compared_runs import draw_agreement, joint_difference

AGREEMENT = 1e-6
"""Largest joint difference to the reference in a run that agrees [rad or m]."""
NUDGE = 1e-9
"""How far the start is moved to see how differences grow [rad or m]."""
SIMILAR = 2.0
"""In a chaotic case, a run agrees whose task error is at most so many times the reference's."""
KEPT = 1e-9
"""A limit exceeded by less than this was kept [SI units]."""
QUICK_SECONDS = 2.0
"""A quick run ends after this time unless the case says how it is made short [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """What is run with every contender.

    Attributes:
        scenario: a path or a bundled name.
        scheme: A scheme in place of the scenario's; None is its own.
        quick: Overrides that make it short; none: it ends early.
    """

    scenario: str
    scheme: str | None = None
    quick: tuple[str, ...] = (f"simulation.duration={QUICK_SECONDS}",)

    def setup(self, contender: Contender, *, quick: bool) -> Setup:
        """The run with one contender.

        Raises:
            FtqpError: Wrong scenario, or a contender that cannot take part.
        """
        table = ", ".join(f"{key} = {json.dumps(value)}" for key, value in contender.settings.items())
        overrides = self.quick if quick else ()
        return load(self.scenario, overrides, backend=f"{{ {table} }}", scheme=self.scheme)

    def title(self) -> str:
        """``planar6-square, scheme mtn``.

        Raises:
            ScenarioError: The scenario is wrong.
        """
        found = document.read(self.scenario)
        scheme = validated(found).planner.scheme["name"] if self.scheme is None else self.scheme
        return f"{found.name}, scheme {scheme}"


def measured(
    case: Case, ready: Sequence[Contender], folder: Path, *, quick: bool, seconds: float = LIMIT
) -> tuple[list[dict[str, Any]], dict[str, Any], dict[str, str]]:
    """Every contender on one case; its logs and its figure go into ``folder``.

    Gives one row a contender, what is known of the case, and why contenders could not take part.
    """
    reference = next(contender for contender in ready if contender.name == REFERENCE)
    setup = case.setup(reference, quick=quick)
    base = _run(setup, folder / "reference.npy")
    nudged = _run(case.setup(reference, quick=quick), folder / "nudged.npy", nudge=NUDGE)
    growth = float(joint_difference(nudged, base).max())
    about = {
        "title": case.title(),
        "robot": setup.robot.name,
        "level": setup.planner.level,
        "dt": setup.planner.dt,
        "ticks": len(base),
        "nudge": NUDGE,
        "difference_after_nudge": growth,
        "chaotic": growth > AGREEMENT,
    }
    rows, declined = [], {}
    logs: dict[str, Log] = {}
    for index, contender in enumerate(ready):
        file = folder / f"{index}.npy"
        ended = isolated(_ran, case, contender, quick, file, seconds=seconds)
        if ended.reason:
            declined[contender.name] = " ".join(ended.reason.split())
            continue
        logs[contender.name] = load_log(file)
        rows.append(_row(contender.name, logs[contender.name], base, about))
    own = next(row for row in rows if row["contender"] == REFERENCE)["step_time_us"]["p50"]
    for row in rows:
        row["ratio"] = row["step_time_us"]["p50"] / own
    draw_agreement(
        logs,
        folder / f"{file_name(about['title'])}.png",
        reference=REFERENCE,
        title=f"{about['title']}: {len(logs)} backends in closed loop",
        tolerance=None if about["chaotic"] else AGREEMENT,
    )
    for file in (*folder.glob("*.npy"), *folder.glob("*.json")):
        file.unlink()
    return rows, about, declined


def _ran(case: Case, contender: Contender, quick: bool, file: Path) -> None:
    """The run of one contender, in a process of its own."""
    _simulated(case.setup(contender, quick=quick), file)


def _run(setup: Setup, file: Path, nudge: float = 0.0) -> Log:
    """The log of the first run of a setup; ``nudge`` is added to the start of every joint [rad or m]."""
    _simulated(setup, file, nudge)
    return load_log(file)


def _simulated(setup: Setup, file: Path, nudge: float = 0.0) -> None:
    Simulation(
        setup.planner,
        setup.path,
        q=setup.q + nudge,
        v=setup.v,
        schedule=setup.schedule,
        duration=setup.duration,
        feed_forward=setup.tables.simulation.feed_forward,
        log=file,
    ).run()


def _row(name: str, log: Log, base: Log, about: Mapping[str, Any]) -> dict[str, Any]:
    facts, reference = summary(log), summary(base)
    difference = float(joint_difference(log, base).max())
    return {
        "case": about["title"],
        "contender": name,
        **{key: facts[key] for key in ("completed", "stopped_at", "status_counts", "max_position_error",
           "rms_position_error", "max_limit_violation", "max_failed_joint_motion", "qp", "step_time_us")},
        "joint_difference": difference,
        "disagreement": _disagreement(facts, reference, difference, chaotic=about["chaotic"]),
    }  # fmt: skip


def _disagreement(
    facts: Mapping[str, Any], reference: Mapping[str, Any], difference: float, *, chaotic: bool
) -> str:
    """In what a run differs from the reference's; nothing when they agree."""
    found = []
    if facts["stopped_at"] != reference["stopped_at"]:
        found.append("stops" if facts["stopped_at"] is not None else "does not stop")
    for limit, excess in facts["max_limit_violation"].items():
        if excess > max(KEPT, reference["max_limit_violation"][limit]):
            found.append(f"limit of {limit} exceeded by {excess:.1g}")
    if chaotic and facts["max_position_error"] > SIMILAR * reference["max_position_error"]:
        found.append("task error")
    if not chaotic and difference > AGREEMENT:
        found.append("joints")
    return ", ".join(found)
