"""Kinds of text files: how one is drawn, and what a user then does with it."""

import copy
import json
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from random import Random
from typing import Any, Final, final
from unittest import mock

import numpy as np

from ftqp.app.campaign.episode_study import RAISED, EpisodeWork, load_campaign
from ftqp.app.scenario import document
from ftqp.app.scenario.setup import Setup, load
from ftqp.app.schema import Scenario
from ftqp.app.schema.campaign_file import CampaignFile
from ftqp.app.schema.workspace_file import WorkspaceFile
from ftqp.app.study.workspace_study import MapWork, load_study
from ftqp.core.errors import FtqpError
from ftqp.qp import QP, solve
from ftqp.sim.number_files import recorded_motion, waypoint_table
from fuzz.files.grammar import NUMBERS, WORDS, anything, spoiled
from fuzz.files.toml_texts import text_of

TICKS = 4
FILES: Final = (
    "arm.urdf", "way.csv", "motion.csv", "solver.toml", "some.json", "broken.npz", "pipe", "folder", "empty",
    "missing", "/dev/zero",
)  # fmt: skip
SCENARIO = "planar3-line"
"""What a scenario is overridden of, on the command line."""


@final
@dataclass(frozen=True, slots=True)
class Case:
    """A file and its use.

    Attributes:
        file: The file, which is to stay as it is.
        use: What a user does with it.
    """

    file: Path
    use: Callable[[], object]


@cache
def _bundled(kind: str) -> tuple[dict[str, Any], ...]:
    folder = Path(document.__file__).parents[1] / document.SHELVES[kind]
    return tuple(tomllib.loads(file.read_text("utf-8")) for file in sorted(folder.glob("*.toml")))


@cache
def _whole() -> tuple[dict[str, Any], ...]:
    """Bundled scenarios with every default filled in."""
    names = ("planar3-line", "planar6-square", "modular11-locked", "panda-detected", "puma-step-10")
    return tuple(tomllib.loads(load(name).toml) for name in names)


def few_ticks(setup: Setup) -> None:
    """Run the beginning of a scenario."""
    replace(setup, duration=TICKS * setup.planner.dt).simulation().run()


def _with_files(content: Any, rng: Random) -> Any:
    """The tables, now and then with a robot, a path or a solver from a file."""
    if rng.random() < 0.85:
        return content
    tables = {
        "robot": {"urdf": rng.choice(FILES), "tip": "tool"},
        "path": {"kind": "waypoints", "file": rng.choice(FILES), "relative": True},
        "planner": {"profile": rng.choice(FILES), "plan": rng.choice(FILES)},
    }
    name = rng.choice(list(tables))
    given = tables[name]
    if name == "planner":
        key = rng.choice(list(given))
        if isinstance(content.setdefault("planner", {}), dict):
            content["planner"][key] = given[key]
    else:
        content[name] = given
    return content


def _toml(file: Path, content: dict[str, Any], rng: Random) -> Path:
    file.write_bytes(text_of(content, rng))
    return file


def scenario(rng: Random, folder: Path) -> Case:
    """A scenario, which is checked, made, and run for a few ticks."""
    content = copy.deepcopy(rng.choice(_bundled("scenario") if rng.random() < 0.6 else _whole()))
    content = _with_files(spoiled(content, rng, Scenario), rng)
    file = _toml(folder / "scenario.toml", content, rng)
    return Case(file, lambda: few_ticks(load(str(file))))


def campaign(rng: Random, folder: Path) -> Case:
    """A campaign, of which episodes are drawn, made, and run for a few ticks."""
    content = copy.deepcopy(rng.choice(_bundled("campaign")))
    part = rng.random()
    if part < 0.5 and content["vary"]:
        for _ in range(rng.randint(1, 2)):
            key = rng.choice(
                [*content["vary"], "planner.dt", "faults.0.at", "start.q", "a.b", "faults.\u00b2", ""]
            )
            content["vary"][key] = _distribution(rng)
    if part > 0.3:
        spoiled(content, rng, CampaignFile)
    file = _toml(folder / "campaign.toml", content, rng)

    def use() -> None:
        made = load_campaign(str(file))
        with mock.patch.object(EpisodeWork, "_judged", lambda self, setup: few_ticks(setup) or {}):
            for row in EpisodeWork(campaign=made)(range(3)):
                if RAISED in row[:2]:
                    raise AssertionError(f"an episode raised: {row[-1]}")

    return Case(file, use)


def _distribution(rng: Random) -> Any:
    """What a key of a campaign may be drawn from, almost."""
    name = rng.choice(
        ("uniform", "log_uniform", "normal", "integers", "one_of", "joint", "start", "away", "uniformly")
    )
    value: Any = rng.choice(
        ([0.1, 0.2], [0, 3], [2, 1], [], [1], 0.2, "any", [1e308, -1e308], [-1e308, 1e308])
    )
    found = {name: anything(rng) if rng.random() < 0.4 else value}
    for key in ("weights", "times", "plus", "chance"):
        if rng.random() < 0.2:
            found[key] = rng.choice(
                ([1, 2], [0, 0], 0.5, "path.duration", "robot", "faults.0.at", anything(rng))
            )
    return found if rng.random() < 0.9 else anything(rng)


def study(rng: Random, folder: Path) -> Case:
    """A study of a workspace, of which one start is computed."""
    content = copy.deepcopy(rng.choice(_bundled("study")))
    content["map"] |= {"grid": rng.choice((2, 4, 8)), "configurations": 4, "steps": 5}
    spoiled(content, rng, WorkspaceFile)
    file = _toml(folder / "study.toml", content, rng)

    def use() -> None:
        made = load_study(str(file))
        table = made.tables.map
        if table.steps * table.configurations <= 20_000:
            MapWork(made.task)([0])

    return Case(file, use)


PROFILES: Final = (
    {"name": "active_set"}, {"name": "osqp", "tolerance": 1e-9}, {"name": "daqp"}, {"name": "proxqp"},
    {"name": "dtrnn"}, {"name": "quadprog"}, {"name": "piqp"}, {"name": "qpsolvers:clarabel"},
)  # fmt: skip


def profile(rng: Random, folder: Path) -> Case:
    """A profile of a solver, which then solves a small problem."""
    content = copy.deepcopy(rng.choice(_profiles()))
    spoiled(content, rng)
    file = _toml(folder / "profile.toml", content, rng)
    problem = QP(np.eye(2), np.array([-1.0, 2.0]), lb=np.zeros(2), ub=np.ones(2))
    return Case(file, lambda: solve(problem, file))


@cache
def _profiles() -> tuple[dict[str, Any], ...]:
    shelf = Path(__file__).parents[2] / "profiles"
    return (*PROFILES, *(tomllib.loads(file.read_text("utf-8")) for file in sorted(shelf.glob("*.toml"))))


def overrides(rng: Random, folder: Path) -> Case:
    """One to three ``--set A.B=VALUE`` of a command line; the file is the scenario that they change."""
    said = [_override(rng) for _ in range(rng.randint(1, 3))]
    file = folder / "scenario.toml"
    file.write_text(_text_of_scenario(), encoding="utf-8")
    return Case(file, lambda: few_ticks(load(str(file), said)))


@cache
def _text_of_scenario() -> str:
    return load(SCENARIO).toml


@cache
def _scenario_tables() -> dict[str, Any]:
    return tomllib.loads(_text_of_scenario())


@cache
def _keys() -> tuple[str, ...]:
    return tuple(_keys_of(_scenario_tables()))


def at_key(content: Any, key: str) -> Any:
    """The value of a dotted key; a word where there is none."""
    for part in key.split("."):
        if isinstance(content, dict) and part in content:
            content = content[part]
        elif isinstance(content, list) and part.isdecimal() and int(part) < len(content):
            content = content[int(part)]
        else:
            return "none"
    return content


def _keys_of(content: dict[str, Any]) -> list[str]:
    """Every dotted key of a scenario."""
    found: list[str] = []
    open_tables: list[tuple[str, Any]] = [("", content)]
    while open_tables:
        before, table = open_tables.pop()
        for key, value in table.items() if isinstance(table, dict) else enumerate(table):
            found.append(f"{before}{key}")
            if isinstance(value, dict | list):
                open_tables.append((f"{before}{key}.", value))
    return found


def _override(rng: Random) -> str:
    key = rng.choice(_keys())
    if rng.random() < 0.2:
        at = rng.randrange(len(key) + 1)
        key = (
            key[:at]
            + rng.choice((".", "..", "\u00b2", "x", " ", "=", "\uff11", ".99", ".-1", "\udcff", "\x1b"))
            + key[at:]
        )
    drawn = rng.random()
    if drawn < 0.6:
        content = spoiled(copy.deepcopy(_scenario_tables()), rng, Scenario)
        keys = [k for k in _keys_of(content) if k not in _keys()] or list(_keys())
        key = rng.choice((key, rng.choice(keys)))
        value = document._inline(at_key(content, key) if rng.random() < 0.8 else rng.choice(NUMBERS))
    elif drawn < 0.7:
        value = rng.choice(WORDS)
    elif drawn < 0.9:
        value = document._inline(anything(rng))
    else:
        value = rng.choice(
            (
                "[" * 2000,
                "{a=" * 500,
                "1" * 5000,
                "1_000",
                "\uff11",
                "2026-01-01",
                "'",
                '"""',
                "[1,",
                "a\nb=1",
            )
        )
    return f"{key}{rng.choice(('=', '=', '=', '=', ' = ', '', '=='))}{value}"


WAYPOINTS: Final = "t,x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,0.01,0,0,0,0,0,1\n2,0.02,0.01,0,0,0,0,1\n"
MOTION: Final = "t,track,x,y,z,rx,ry,rz\n0,0,0,0,0,0,0,0\n1,0.1,0,0,0,0,0,0.1\n2,0,0,0,0,0,0,0\n"
CELLS: Final = (
    "0.5", "1.5", "-0.25", "3", "2e-1", "+1", "1", "0.01",
    "", " ", "nan", "inf", "-inf", "1e308", "1e999", "5e-324", "1_000", "\uff11", "0x10", "1,5", '"',
    '"1"', "1\n2", "1e-9", "abc", "\x1b", "\0", "true", "--1", "1" * 400, "\u0661", "x" * 200000,
)  # fmt: skip


def table(rng: Random, folder: Path) -> Case:
    """Waypoints or the recorded motion of a base, in CSV."""
    way = rng.random() < 0.5
    rows = [line.split(",") for line in (WAYPOINTS if way else MOTION).splitlines()]
    for _ in range(rng.randint(1, 3)):
        k = rng.randrange(len(rows))
        change, row = rng.randrange(6), rows[k]
        if change < 3 and row:
            row[rng.randrange(len(row))] = rng.choice(CELLS)
        elif change == 3:
            del rows[k]
        elif change == 4:
            rows.insert(k, list(row))
        elif row:
            row.append(rng.choice(CELLS))
        if not rows:
            break
    data = "\n".join(rng.choice((",", ",", ",", ", "))[:2].join(row) for row in rows).encode()
    if rng.random() < 0.15:
        data = data.decode().encode(rng.choice(("utf-16", "utf-8-sig"))) + rng.choice((b"", b"\xff", b"\0"))
    file = folder / "table.csv"
    file.write_bytes(data)
    if way:
        return Case(file, lambda: waypoint_table(file))
    return Case(file, lambda: recorded_motion(file, ("track", "x", "y", "z", "rx", "ry", "rz")))


def json_text(content: Any, rng: Random) -> bytes:
    """A JSON file that is spoiled as tables or as text."""
    if rng.random() < 0.85:
        spoiled(content, rng)
    text = json.dumps(content, default=str, ensure_ascii=rng.random() < 0.5)
    if rng.random() < 0.8:
        return text.encode("utf-8", "replace")
    change = rng.randrange(5)
    if change == 0:
        return text[: rng.randrange(len(text) + 1)].encode("utf-8", "replace")
    if change == 1:
        return b"[" * rng.choice((10, 100_000)) + text.encode("utf-8", "replace")
    if change == 2:
        return rng.choice(
            (b"", b"null", b"[]", b"{}", b"NaN", b"1" * 5000, b'"\\ud800"', b"\xff\xfe", b'{"a":1,"a":2}')
        )
    data = bytearray(text.encode("utf-8", "replace"))
    for _ in range(3):
        data[rng.randrange(len(data))] = rng.randrange(256)
    return bytes(data)


def refused(error: BaseException) -> bool:
    """Whether an error is one of ftqp."""
    return isinstance(error, FtqpError)
