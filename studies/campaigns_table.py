"""One table of campaigns that were run: how many episodes, what broke, and what share could still be missed.

    ftqp campaign safety --out runs/safety
    python studies/campaigns_table.py runs/safety runs/physics --commit 1a2b3c4 --update-docs

One commit stands for all folders, or there is one for each.

Reads what `ftqp campaign` has left in each folder (summary.json, campaign.toml) and runs nothing.
"""

import argparse
import json
import sys
import tomllib
from pathlib import Path
from typing import Any

from bench import command_line, docs
from bench.results import appendix, folder, preamble, written
from bench.tables import Table

from ftqp.app.campaign.campaign_summary import fallback_share, share_interval
from ftqp.core.errors import InputError

LIMITS = ("speed", "acceleration", "position", "braking", "plane", "cone", "torque", "failed", "finite")
CLAIMS = ("honesty", "inside", "obedience", "tasks")
OTHERS = ("rest", "chatter", "tracking")
HEADINGS = (
    "campaign", "commit", "episodes", "steps", "limit broken", "OK not true", "swings at rest",
    "chatter", "target left", "exceptions", "share at most",
)  # fmt: skip
NOTE = (
    "Columns count episodes; one that breaks several laws of a column counts as often. The last one is the "
    "upper end of the shares of episodes that break a law or raise that are compatible with what was found, "
    "at 95 % (Clopper and Pearson; 1 - 0.05^(1/n) where nothing was found)."
)
CAMPAIGNS = docs.ROOT / "docs" / "evidence" / "campaigns.md"


def row(folder: Path, commit: str) -> dict[str, Any]:
    """What a campaign came to."""
    try:
        facts = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        text = tomllib.loads((folder / "campaign.toml").read_text(encoding="utf-8"))
        run, bad = facts["sound"] + facts["broken"] + facts["raised"], facts["broken"] + facts["raised"]
        laws = {"plane": 0, "cone": 0, "tasks": 0, "chatter": 0} | facts["laws"]
        return {
            "campaign": facts["campaign"],
            "command": f"ftqp campaign {facts['campaign']} --episodes {facts['episodes']}",
            "seed": text["campaign"]["seed"],
            "commit": commit,
            "episodes": run,
            "steps": facts["steps"],
            "refused": facts["refused"],
            "given_up": len(facts["crashed"]),
            "limits": sum(laws[law] for law in LIMITS),
            "claims": sum(laws[law] for law in CLAIMS),
            **{law: laws[law] for law in OTHERS},
            "exceptions": facts["raised"],
            "at_most": (share_interval(bad, run) or (0.0, 1.0))[1],
            "laws": laws,
            "backends": {
                name: (found["episodes"], found["ticks"], fallback_share(found))
                for name, found in facts["by_key"].get("planner.backend", {}).items()
            },
            "said": facts["said"],
            "examples": facts["examples"],
        }
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{folder} holds no campaign that was run ({type(error).__name__}: {error}), expected what "
            "ftqp campaign --out names, with summary.json; the same command writes it at its end"
        ) from error


def table(rows: list[dict[str, Any]]) -> Table:
    """All campaigns, a line each."""
    cells = [
        (
            f"`{one['campaign']}`", one["commit"], f"{one['episodes']:,}", f"{one['steps']:,}",
            *(str(one[key]) for key in ("limits", "claims", *OTHERS, "exceptions")),
            f"{one['at_most']:.2g}",
        )
        for one in rows
    ]  # fmt: skip
    return Table(title="Episodes that broke a law", headings=HEADINGS, rows=cells, notes=(NOTE,))


def fallbacks(rows: list[dict[str, Any]]) -> list[Table]:
    """How often the answers of solvers were not used, of each campaign that draws its solver."""
    return [
        Table(
            title=f"Answers that were not used, in `{one['campaign']}` at {one['commit']}",
            headings=("backend", "episodes", "ticks", "FALLBACK ticks"),
            rows=[
                (f"`{name}`", f"{episodes:,}", f"{ticks:,}", share)
                for name, (episodes, ticks, share) in one["backends"].items()
            ],
            notes=("Where a solver gives no usable answer in a tick, the kernel's active set answers.",),
        )
        for one in rows
        if len(one["backends"]) > 1
    ]


def _commands(rows: list[dict[str, Any]]) -> list[str]:
    """How each is run again, and what was found one by one."""
    lines = ["## Commands, statuses, episodes", ""]
    for one in rows:
        ticks = sum(one["said"].values())
        said = ", ".join(f"{status} {100 * count / ticks:.2f} %" for status, count in one["said"].items())
        lines.append(
            f"- `{one['command']}` at {one['commit']}, seed {one['seed']}; no scenario, so not run: "
            f"{one['refused']}; given up: {one['given_up']}; ticks by status: {said}"
        )
        lines += [f"  - episode {e['episode']}: {e['sentences'].splitlines()[0]}" for e in one["examples"]]
    return [*lines, ""]


def main() -> int:
    """Read, print, write; 0 when done, 2 for bad input."""
    options = _options()
    try:
        rows = [row(*one) for one in zip(options.folders, options.commit, strict=True)]
    except InputError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    settings = {"campaigns": ", ".join(one["campaign"] for one in rows)}
    limits = ["The commands below ran the campaigns; the machine is that of the table."]
    result = docs.measured("campaigns_table", settings, rows, limits)
    result["command"] = "python studies/campaigns_table.py FOLDER..."
    tables = [table(rows), *fallbacks(rows)]
    screen = argparse.Namespace(json=options.json, out=None, update_docs=False)
    docs.publish(result, "Campaigns", tables, screen)
    out = options.out or (folder("campaigns_table") if options.update_docs else None)
    if out is not None:
        shown = [line for one in tables for line in one.markdown()]
        lines = [*preamble("Campaigns", result), *shown, *_commands(rows), *appendix(result)]
        report, *_ = written(result, "\n".join(lines), out, "campaigns_table")
        if options.update_docs:
            docs.shown(result, report, {CAMPAIGNS: tables})
    return 0


def _options() -> argparse.Namespace:
    parser = command_line.parser(__doc__)
    parser.add_argument("folders", nargs="+", type=Path, metavar="FOLDER", help="what --out named")
    of = "of the source that ran them"
    parser.add_argument("--commit", nargs="+", required=True, metavar="HASH", help=of)
    docs.options(parser)
    options: argparse.Namespace = parser.parse_args()
    if len(options.commit) == 1:
        options.commit *= len(options.folders)
    if len(options.commit) != len(options.folders):
        parser.error(f"--commit names {len(options.commit)}, expected 1 or {len(options.folders)}")
    return options


if __name__ == "__main__":
    sys.exit(main())
