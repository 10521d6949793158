"""What the benchmark says: ratios, tables, limitations."""

import os
import platform
from pathlib import Path
from typing import Any

from rich.console import Console, Group
from rich.table import Table
from rich.text import Text

OURS, REFERENCE = "ftqp active_set", "placo soft"
"""The two variants whose ratio has a target."""

RATIO = f"p50 of {OURS} / p50 of {REFERENCE}"

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
    "placo's model has a floating base that is masked, as its documentation says for arms that are bolted "
    "down. placo is C++ behind its own bindings; pink and mink are Python around pinocchio and MuJoCo.",
    "placo integrates its own state inside solve(True); ftqp takes q and v from the caller and returns "
    "the next ones. pink and mink build a new QP in every step, by design.",
    "The locked joint is masked in placo's kinematics, a hard joints task in placo's dynamics, a hard "
    "constraint in pink and mink, and a reported fault in ftqp. pink and mink have no torque level.",
    "What the redundant joints do differs: ftqp has its minimum velocity norm scheme, the peers their own "
    "default regularisation.",
    "Chunks alternate between processes that share one core; the first steps of each chunk are not "
    "counted, so caches are warm. A loop that sleeps between steps finds cold ones, and every program is "
    "several times slower there.",
    "The maximum and p99.9 of a shared or virtual machine are mostly its interrupts: compare with the "
    "empty call.",
)


def ratios(cases: list[dict[str, Any]]) -> dict[str, Any]:
    """Our p50 by the reference's, healthy and locked, and p99.9 / p50 of both; None where one is missing."""
    result: dict[str, Any] = {"ratios_to_placo": {}, "ratios_to_placo_locked": {}, "us": {}, "placo": {}}
    for case in cases:
        key = f"{case['robot']}_{case['level']}"
        ours, reference = case["variants"].get(OURS), case["variants"].get(REFERENCE)
        ratio = round(ours["p50"] / reference["p50"], 4) if ours and reference else None
        if case["locked"] is not None:
            result["ratios_to_placo_locked"][key] = ratio
            continue
        result["ratios_to_placo"][key] = ratio
        for name, row in (("us", ours), ("placo", reference)):
            result[name][key] = {part: row[part] for part in ("p50", "p999", "tail")} if row else None
    return result


def machine() -> dict[str, Any]:
    """What this was measured on."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.is_file() else []
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return {
        "cpu": models[0] if models else platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
        "load": [round(value, 2) for value in os.getloadavg()] if hasattr(os, "getloadavg") else None,
    }


def title(case: dict[str, Any]) -> str:
    """One line for a case, for example ``panda, torque level, joint panda_joint3 locked``."""
    state = "healthy" if case["locked"] is None else f"{case['locked']} locked"
    return f"{case['robot']}, {case['level']} level, {state}"


HEADINGS = ("variant", "p50", "p99", "p99.9", "max", "p99.9/p50", "vs placo soft", "error", "statuses")


def cells(case: dict[str, Any]) -> list[tuple[str, ...]]:
    """The rows of a case's table as text: times in us, tracking error in mm."""
    reference = case["variants"].get(REFERENCE)
    rows = []
    for name, row in case["variants"].items():
        against = f"{row['p50'] / reference['p50']:.2f}" if reference else "-"
        statuses = ", ".join(f"{status} {count}" for status, count in row["statuses"].items() if status)
        times = tuple(f"{row[part]:.2f}" for part in ("p50", "p99", "p999", "max"))
        error = f"{row['position_error'] * 1e3:.3f}" if statuses else "-"
        rows.append((name, *times, f"{row['tail']:.1f}", against, error, statuses))
    return rows


def _ratio_lines(result: dict[str, Any]) -> list[str]:
    lines = []
    for key, ratio in result["ratios_to_placo"].items():
        ours, reference = result["us"][key], result["placo"][key]
        locked = result["ratios_to_placo_locked"].get(key)
        if ratio is None or ours is None or reference is None:
            lines.append(
                f"{key}: no ratio (placo was not measured)" if ours else f"{key}: ftqp was not measured"
            )
            continue
        also = f", with a joint locked {locked:.2f}" if locked is not None else ""
        lines.append(
            f"{key}: {ratio:.2f}{also}; p99.9/p50 {ours['tail']:.1f}, placo's {reference['tail']:.1f}"
        )
    return lines


def _version_lines(result: dict[str, Any]) -> list[str]:
    return [
        f"{name}: {', '.join(f'{package} {number}' for package, number in said['versions'].items())}"
        f" (core {said['settled']['core']}, priority {said['settled']['priority']})"
        for name, said in result["programs"].items()
    ]


def show(result: dict[str, Any], console: Console) -> None:
    """Tables, ratios, versions and limitations on the terminal."""
    parts: list[Any] = []
    for case in result["cases"]:
        table = Table(title=f"{title(case)}  [us a step, error in mm]", title_justify="left")
        for i, heading in enumerate(HEADINGS):
            table.add_column(heading, justify="left" if i in (0, len(HEADINGS) - 1) else "right")
        for row in cells(case):
            table.add_row(*row, style="bold" if row[0] == OURS else None)
        parts += [table, Text()]
    blocks = {
        RATIO: _ratio_lines(result),
        "Versions": _version_lines(result),
        "Machine": [f"{name}: {value}" for name, value in result["machine"].items()],
        "Left out": [f"{name}: {why}" for name, why in result["left_out"].items()],
        "Limitations": list(result["limitations"]),
    }
    for heading, lines in blocks.items():
        if lines:
            parts += [Text(heading, style="bold"), *(Text(f"  {line}") for line in lines)]
    console.print(Group(*parts))


def markdown(result: dict[str, Any]) -> str:
    """The same as a file to read."""
    settings = ", ".join(f"{name} {value}" for name, value in result["settings"].items())
    made = f"{result['date']}; {settings}. Made by `{result['command']}`."
    lines = ["# Whole user step", "", f"{made} Times in us, tracking error in mm.", ""]
    lines += [
        f"## {RATIO}",
        "",
        *(f"- {line}" for line in _ratio_lines(result)),
        "",
    ]
    for case in result["cases"]:
        rule = ["---"] + ["---:"] * (len(HEADINGS) - 2) + ["---"]
        table = [HEADINGS, rule, *cells(case)]
        lines += [f"## {title(case)}", "", *("| " + " | ".join(row) + " |" for row in table), ""]
    lines += ["## Versions", "", *(f"- {line}" for line in _version_lines(result)), ""]
    lines += ["## Machine", "", *(f"- {name}: {value}" for name, value in result["machine"].items()), ""]
    if result["left_out"]:
        lines += ["## Left out", "", *(f"- {name}: {why}" for name, why in result["left_out"].items()), ""]
    lines += ["## Limitations", "", *(f"- {line}" for line in result["limitations"])]
    return "\n".join(lines) + "\n"
