"""What the benchmark of the step says: ratios, tables, limitations."""

from collections.abc import Iterator
from typing import Any

from bench import results
from bench.tables import Table, quantity
from bench.ways import WAYS
from rich.console import Console, Group
from rich.text import Text

OURS, REFERENCE = "ftqp active_set", "placo soft"
"""The two variants whose ratio has a target."""

TASKS = {
    "panda_velocity": "Panda, velocity level",
    "panda_torque": "Panda, acceleration level, torque limits",
    "chain30_velocity": "30 joints, velocity level",
    "chain30_torque": "30 joints, acceleration level, torque limits",
}

SUFFIXES = {way: "" if way == "best" else f"_{way}" for way in WAYS}
"""What follows a key of the result where it is about another way than ``best``."""

GOALS = {
    "panda_velocity": {"best": 0.25, "readme": 0.33, "paced": 0.40},
    "panda_torque": {"best": 0.12, "readme": 0.20, "paced": 0.25},
    "chain30_velocity": {"best": 0.12, "readme": 0.18, "paced": 0.25},
    "chain30_torque": {"best": 0.08, "readme": 0.12, "paced": 0.15},
}
"""What the ratio of p50 shall be at most."""

TAIL_GOAL = 1.0
"""What that of p99.9 shall be at most."""

LIMITATIONS = (
    "Microseconds belong to this machine; ratios of one run carry over better, and only for the same task.",
    "The path is smooth and stays away from limits: few or no bounds are active, which is the usual case "
    "in a control loop and the cheap one for every program.",
    "ftqp checks the KKT residuals, keeps the ability to brake (which needs acceleration limits) and "
    "watches for an emergency stop in every step; the peers do none of these. placo, pink and mink bound "
    "position and velocity, placo at torque level also torque; only ftqp bounds acceleration (placo uses "
    "it as its safe acceleration near position limits).",
    "At velocity level the peers aim at the target in one step, which is their default; ftqp uses a gain "
    "of 100 per second. At torque level ftqp and placo have the same gains; without the target's velocity "
    "both lag behind it. The variants '+ twist' also get that velocity.",
    "By default ftqp keeps torque limits at velocity level too, with M, h and a row a joint; no peer does. "
    "The ratio is that of the default; the variant 'no torque rows' does what the peers do.",
    "A target without a velocity counts as one that stands, and ftqp sees to it that the arm comes to rest "
    "there. No peer does; the variant 'not calm' does without.",
    "placo's model has a floating base that is masked, as its documentation says for arms that are bolted "
    "down. placo is C++ behind its own bindings; pink and mink are Python around pinocchio and MuJoCo.",
    "placo integrates its own state inside solve(True); ftqp takes q and v from the caller and returns "
    "the next ones. pink and mink build a new QP in every step, by design.",
    "The locked joint is masked in placo's kinematics, a hard joints task in placo's dynamics, a hard "
    "constraint in pink and mink, and a reported fault in ftqp. pink and mink have no torque level.",
    "What the redundant joints do differs: ftqp has its minimum velocity norm scheme, the peers their own "
    "default regularisation.",
    "In 'readme' and 'paced' ftqp gets fresh q and v every tick, which are made between steps and not timed, "
    "and one target that is rewritten within the step. The peers take the target's row from the path's array "
    "and rewrite their one task; their own state is their own, so nothing measured is handed to them.",
    "Everybody has gone round the path once before anything is timed. "
    "Chunks alternate between processes that share one core; the first steps of each chunk are not "
    "counted. In 'best' and 'readme' caches are therefore warm. In 'paced' a process sleeps between its "
    "steps; what the others leave in the caches depends on what else runs on the machine.",
    "The p99.9 of a shared or virtual machine is mostly its interrupts: compare with the empty call. "
    "Variants other than the two of the ratio make fewer steps, and their p99.9 means little in 'paced'.",
)


def ratios(cases: list[dict[str, Any]]) -> dict[str, Any]:
    """Ratios of p50, healthy and locked, and of p99.9, and both times; None where one is missing."""
    result: dict[str, Any] = {}
    for suffix in SUFFIXES.values():
        for name in (f"ratios_to_placo{suffix}", f"ratios_to_placo{suffix}_locked"):
            result[name] = dict.fromkeys(TASKS)
        result[f"p999_ratios_to_placo{suffix}"] = dict.fromkeys(TASKS)
    for suffix in SUFFIXES.values():
        result |= {f"us{suffix}": dict.fromkeys(TASKS), f"placo{suffix}": dict.fromkeys(TASKS)}
    for case in cases:
        key, suffix = f"{case['robot']}_{case['level']}", SUFFIXES[case["way"]]
        ours, reference = case["variants"].get(OURS), case["variants"].get(REFERENCE)
        locked = "" if case["locked"] is None else "_locked"
        if ours and reference:
            result[f"ratios_to_placo{suffix}{locked}"][key] = round(ours["p50"] / reference["p50"], 4)
        if locked:
            continue
        if ours and reference:
            result[f"p999_ratios_to_placo{suffix}"][key] = round(ours["p999"] / reference["p999"], 4)
        for name, row in (("us", ours), ("placo", reference)):
            if row:
                result[name + suffix][key] = {part: row[part] for part in ("p50", "p999", "tail")}
    return result


def complete(result: dict[str, Any]) -> bool:
    """Whether every task has a ratio in every way, with and without a locked joint."""
    names = [name for name in result if name.startswith("ratios_to_placo")]
    return all(ratio is not None for name in names for ratio in result[name].values())


def title(case: dict[str, Any]) -> str:
    """One line for a case, for example ``panda, torque level, joint panda_joint3 locked``."""
    state = "healthy" if case["locked"] is None else f"{case['locked']} locked"
    return f"{case['robot']}, {case['level']} level, {state}"


def short(result: dict[str, Any]) -> Table:
    """The ratios, and the times in brackets, one line a task."""
    rows = []
    for task, name in TASKS.items():
        cells = []
        for suffix in SUFFIXES.values():
            ours, reference = result[f"us{suffix}"][task], result[f"placo{suffix}"][task]
            ratio = result[f"ratios_to_placo{suffix}"][task]
            cells.append(
                "-"
                if ratio is None
                else f"{ratio:.2f} ({quantity(ours['p50'])} / {quantity(reference['p50'])} us)"
            )
        rows.append((name, *cells))
    return Table(title=f"p50 of a whole step over that of {REFERENCE}", headings=("", *WAYS), rows=rows)


def reached(result: dict[str, Any]) -> Table:
    """Every ratio beside what it shall be, with p50, p99.9 and their quotient of both."""
    rows = [
        (
            f"{TASKS[task]}, {way}",
            *(quantity(ours["p50"]) if ours else "-", quantity(reference["p50"]) if reference else "-"),
            *(_ratio(result[f"ratios_to_placo{suffix}"][task]), _ratio(GOALS[task][way])),
            _ratio(result[f"ratios_to_placo{suffix}_locked"][task]),
            *(quantity(ours["p999"]) if ours else "-", quantity(reference["p999"]) if reference else "-"),
            _ratio(result[f"p999_ratios_to_placo{suffix}"][task]),
            *(f"{ours['tail']:.1f}" if ours else "-", f"{reference['tail']:.1f}" if reference else "-"),
        )
        for task, way, suffix, ours, reference in _both(result)
    ]
    return Table(
        title=f"{OURS} beside {REFERENCE} [us]",
        headings=(
            "", "p50", "placo's", "ratio", "goal", "a joint locked", "p99.9", "placo's", "ratio",
            "p99.9 / p50", "placo's",
        ),
        rows=rows,
        notes=("goal: what the ratio shall be at most; a joint locked: the ratio of p50 there.",),
    )  # fmt: skip


def missed(result: dict[str, Any]) -> Table:
    """The ratios that are above their goal."""
    rows = []
    for task, way, suffix, ours, reference in _both(result):
        name = f"{TASKS[task]}, {way}"
        if ours is None or reference is None:
            continue
        ratio, tail = result[f"ratios_to_placo{suffix}"][task], result[f"p999_ratios_to_placo{suffix}"][task]
        if ratio > GOALS[task][way]:
            rows.append((name, "p50 / placo's p50", _ratio(ratio), f"{GOALS[task][way]:.2f}"))
        if tail > TAIL_GOAL:
            rows.append((name, "p99.9 / placo's p99.9", _ratio(tail), f"{TAIL_GOAL:.2f}"))
    if not rows and complete(result):
        rows = [("nothing", "", "", "")]
    return Table(
        title="Missed", headings=("", "figure", "measured", "wanted at most"), rows=rows, text_last=True
    )


def contenders(result: dict[str, Any]) -> list[Table]:
    """p50 of everybody on healthy arms, a table for each robot."""
    tables = []
    for robot, name in (("panda", "Panda"), ("chain30", "30 joints")):
        found = {
            (case["level"], case["way"]): case["variants"]
            for case in result["cases"]
            if case["robot"] == robot and case["locked"] is None
        }
        names = dict.fromkeys(variant for variants in found.values() for variant in variants)
        columns = [(level, way) for level in ("velocity", "torque") for way in WAYS if (level, way) in found]
        rows = [
            (
                variant,
                *(quantity(found[at][variant]["p50"]) if variant in found[at] else "-" for at in columns),
            )
            for variant in names
        ]
        tables.append(
            Table(
                title=f"{name}, p50 of everybody [us]",
                headings=("", *(f"{level}, {way}" for level, way in columns)),
                rows=rows,
                bold=OURS,
            )
        )
    return tables


def details(result: dict[str, Any]) -> list[Table]:
    """A table a robot, level and state: p50, p99.9, longest and ratio of every variant and way [us, mm]."""
    tables = []
    for name in dict.fromkeys(title(case) for case in result["cases"]):
        found = {case["way"]: case["variants"] for case in result["cases"] if title(case) == name}
        rows = []
        for variant in dict.fromkeys(variant for variants in found.values() for variant in variants):
            cells: list[str] = []
            for variants in found.values():
                row, reference = variants.get(variant), variants.get(REFERENCE)
                if row is None:
                    cells += ["-"] * 4
                    continue
                ratio = row["p50"] / reference["p50"] if reference else None
                cells += [quantity(row["p50"]), quantity(row["p999"]), quantity(row["max"]), _ratio(ratio)]
            last = [variants[variant] for variants in found.values() if variant in variants]
            moved = max(row["position_error"] for row in last)
            said = dict.fromkeys(status for row in last for status in row["statuses"] if status)
            rows.append((variant, *cells, f"{1e3 * moved:.3f}" if said else "-", ", ".join(said)))
        headings = [f"{way} {part}" for way in found for part in ("p50", "p99.9", "longest", "ratio")]
        tables.append(
            Table(
                title=name,
                headings=("", *headings, "error", "statuses"),
                rows=rows,
                bold=OURS,
                text_last=True,
            )
        )
    return tables


def _both(result: dict[str, Any]) -> Iterator[tuple[str, str, str, Any, Any]]:
    """Task, way, the suffix of its keys, our times and the reference's."""
    for task in TASKS:
        for way, suffix in SUFFIXES.items():
            yield task, way, suffix, result[f"us{suffix}"][task], result[f"placo{suffix}"][task]


def _ratio(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"


def show(result: dict[str, Any], console: Console) -> None:
    """Tables on the terminal, and what a report has at its foot."""
    parts: list[Any] = [table.rich() for table in (reached(result), *contenders(result))]
    console.print(Group(*parts, Text("\n".join(results.appendix(result)))))


def markdown(result: dict[str, Any]) -> str:
    """Everything as a file to read."""
    lines = results.preamble("Whole user step", result)
    lines += ["Times in us, tracking error in mm, ratios to the p50 of placo soft in the same run.", ""]
    for table in (short(result), reached(result), missed(result), *contenders(result), *details(result)):
        lines += table.markdown()
    return "\n".join([*lines, *results.appendix(result)]).rstrip() + "\n"
