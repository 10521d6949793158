"""The same random episodes under every backend: how often its answer was not used, and what that cost.

    python solvers/backends_under_fire.py                          the report in solvers/results
    python solvers/backends_under_fire.py --episodes 20 --backends osqp,proxqp

Episodes are those of the bundled campaign ``backends``, drawn from their numbers alone, so that every backend
gets the same ones; each is judged from outside. A backend runs in a process of its own with a time limit.
"""

import logging
import sys
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Any

from bench import command_line, results
from bench.contenders import Contender
from bench.isolation import Ended, isolated
from bench.tables import Table

from ftqp import ScenarioError
from ftqp.app.campaign.draws import put
from ftqp.app.campaign.episode_study import EpisodeWork, load_campaign
from ftqp.control.planner.status import STATUSES, StepStatus
from ftqp.core import clock
from ftqp.sim.loop import MEMORY

CAMPAIGN = "backends"
USUAL, WHOLE = 200, 50
"""Episodes of each backend; a run of fewer than the second number is a quick one."""
TARGET = 0.02
"""The largest share of ticks that shall end as FALLBACK."""
SHOWN = 3
"""Episodes that are named for each backend."""
LIMITATIONS = (
    "A tick of a stopped arm asks no solver; the share of all ticks and that of ticks in motion are given.",
    "Times are of the thread's processor, not of the wall, so that other programs do not count; they belong "
    "to this machine. They are those of ticks in motion, without the first one of an episode.",
    "The worst step is a single one and holds whatever else befell the process in it, a collection of "
    "garbage for example; it need not come again in the same episode.",
    "Episodes are kinematic: the arm does what it is told.",
)


def fought(backend: str, first: int, episodes: int) -> dict[str, Any]:
    """What came of the episodes of the campaign under one backend.

    Args:
        backend: Its name.
        first: Number of the first episode.
        episodes: How many.
    """
    logging.getLogger("ftqp").setLevel(logging.ERROR)
    clock.perf_counter_ns = time.thread_time_ns  # type: ignore[attr-defined]
    work = EpisodeWork(load_campaign(CAMPAIGN))
    said: Counter[str] = Counter()
    found: dict[str, Any] = {"broken": [], "raised": [], "refused": 0, "worst": 0.0, "fallbacks": []}
    times: list[float] = []
    with suppress(Exception):  # what loads code is not timed; what it raises is raised again below
        _episode(work, first, _content(work, first, backend))
    for number in range(first, first + episodes):
        try:
            counts, sentences, steps = _episode(work, number, _content(work, number, backend))
        except ScenarioError:
            found["refused"] += 1
            continue
        except Exception as error:  # counted: no backend may make a planner raise
            found["raised"].append([number, f"{type(error).__name__}: {error}"])
            continue
        said.update(counts)
        times += steps
        if sentences:
            found["broken"].append([number, sentences[0]])
        if counts.get("FALLBACK"):
            found["fallbacks"].append([number, counts["FALLBACK"]])
    times.sort()
    most = sorted(found["fallbacks"], key=lambda pair: -pair[1])
    return found | {
        "said": dict(said),
        "fallbacks": most,
        "p50": times[len(times) // 2] if times else 0.0,
        "p99": times[int(0.99 * len(times))] if times else 0.0,
        "worst": times[-1] if times else 0.0,
    }


def _content(work: EpisodeWork, number: int, backend: str) -> dict[str, Any]:
    """The tables of an episode, under a backend."""
    content, _ = work.campaign.drawn(number)
    put(content, "planner.backend", backend)
    return content


def _episode(
    work: EpisodeWork, number: int, content: dict[str, Any]
) -> tuple[dict[str, int], list[str], list[float]]:
    """How often each status was said, the laws that were broken, and what each step took [us]."""
    setup = work.campaign.setup_of(number, content)
    ended = setup.simulation(
        log=MEMORY,
        singularities=False,
    ).run()
    if ended.log is None:
        return {}, [], []
    seen = work.verdict(setup, ended.log)
    counts = {status.name: count for status, count in ended.status_counts.items()}
    moves = ended.log["status"][1:] != STATUSES.index(StepStatus.STOPPED)
    return counts, [str(breach) for breach in seen.breaches], ended.log["step_time"][1:][moves].tolist()


def table(rows: dict[str, dict[str, Any]], left_out: dict[str, str], episodes: int) -> Table:
    """The table of the report."""
    lines = []
    for name, row in rows.items():
        ticks, fallback = sum(row["said"].values()), row["said"].get("FALLBACK", 0)
        moving = ticks - row["said"].get("STOPPED", 0)
        lines.append(
            [
                name,
                str(episodes - row["refused"] - len(row["raised"])),
                str(ticks),
                f"{100.0 * fallback / max(ticks, 1):.3f}",
                f"{100.0 * fallback / max(moving, 1):.3f}",
                str(len(row["broken"])),
                str(len(row["raised"])),
                *(f"{row[key]:.0f}" for key in ("p50", "p99", "worst")),
                "",
            ]
        )
    lines += [[name, *[""] * 9, why] for name, why in left_out.items()]
    return Table(
        title="Every backend in the same episodes",
        headings=[
            "backend",
            "episodes",
            "ticks",
            "FALLBACK [% of ticks]",
            "of ticks in motion",
            "laws broken",
            "exceptions",
            "p50 [us]",
            "p99 [us]",
            "worst step [us]",
            "left out because",
        ],
        rows=lines,
        notes=[f"A FALLBACK in more than {100.0 * TARGET:g} % of the ticks counts as a habit."],
        text_last=True,
    )


def markdown(result: dict[str, Any]) -> str:
    """The report, as one string."""
    lines = results.preamble("Backends under fire", result)
    lines += table(result["rows"], result["left_out"], result["settings"]["episodes"]).markdown()
    notes = []
    for name, row in result["rows"].items():
        for number, sentence in [*row["broken"], *row["raised"]][:SHOWN]:
            notes.append(f"- {name}, episode {number}: {sentence}")
        if row["fallbacks"]:
            most = ", ".join(f"{number} ({count})" for number, count in row["fallbacks"][:SHOWN])
            notes.append(f"- {name} fell back in {len(row['fallbacks'])} episodes, most in {most}")
    lines += ["## Episodes", "", *(notes or ["Nothing to tell."]), ""]
    return "\n".join([*lines, *results.appendix(result)])


def main(arguments: list[str] | None = None) -> int:
    """Runs and writes: 0 when every backend came through, 1 when one did not, 2 for bad input."""
    parser = command_line.parser(__doc__)
    at_least_one = command_line.at_least_one
    parser.add_argument("--episodes", type=at_least_one, default=USUAL, metavar="N", help="of each backend")
    parser.add_argument("--first", type=int, default=0, metavar="N", help="number of the first episode")
    parser.add_argument("--backends", metavar="A,B", help="backends (default: those of the campaign)")
    parser.add_argument("--seconds", type=float, default=600.0, help="time limit of each backend [s]")
    parser.add_argument("--jobs", type=at_least_one, default=1, metavar="N", help="backends at a time")
    results.add_out(parser, "backends_under_fire")
    parser.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    given = parser.parse_args(arguments)
    drawn = load_campaign(CAMPAIGN).tables.vary["planner.backend"]
    names = given.backends.split(",") if given.backends else list(drawn)
    rows: dict[str, dict[str, Any]] = {}
    left_out: dict[str, str] = {}

    def asked(name: str) -> Ended:
        return isolated(fought, name, given.first, given.episodes, seconds=given.seconds)

    with ThreadPoolExecutor(given.jobs) as jobs:
        came = dict(zip(names, jobs.map(asked, names), strict=True))
    for name, ended in came.items():
        if ended.reason:
            left_out[name] = ended.reason
        elif ended.answer["refused"] == given.episodes:
            left_out[name] = "every episode was refused; is it installed? `ftqp backends` says"
        else:
            rows[name] = ended.answer
    taking_part = [Contender(name=name, settings={"name": name}) for name in rows]
    settings = {"episodes": given.episodes, "first": given.first}
    result = results.circumstances("backends_under_fire", taking_part, settings) | {
        "rows": rows,
        "left_out": left_out,
        "limitations": list(LIMITATIONS),
    }
    name = results.stem("backends_under_fire", name=None, quick=given.episodes < WHOLE)
    code = results.told(result, markdown(result), given.out, name, as_json=given.json)
    good = not left_out and all(not row["raised"] and not row["broken"] for row in rows.values())
    return code or (0 if good else 1)


if __name__ == "__main__":
    sys.exit(main())
