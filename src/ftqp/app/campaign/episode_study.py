"""A campaign as a study: a row an episode, drawn from its number alone, run, and judged from outside."""

import hashlib
import json
import logging
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any, ClassVar, Literal, final

import numpy as np

from ftqp import __version__
from ftqp.app.campaign import beside_rival, campaign_summary
from ftqp.app.campaign.draws import episode, refuse_wrong
from ftqp.app.campaign.shown_trace import failures, model_file, trace
from ftqp.app.scenario import document
from ftqp.app.scenario.setup import Setup, arm_from, resolve, validated
from ftqp.app.schema.reading import Table, plain, read
from ftqp.app.schema.robot_section import RobotTable
from ftqp.app.schema.scenario_file import Scenario
from ftqp.checker.checked_run import LAWS, Verdict, verdict
from ftqp.checker.model_file import ModelFile
from ftqp.checker.recovery_law import followable, rest_after
from ftqp.checker.trace import KINEMATIC, PHYSICS, Strictness, Trace
from ftqp.control.task.keep import Keep, TorqueLimits
from ftqp.core.errors import FtqpError, InputError, ScenarioError
from ftqp.core.setting import REQUIRED, every_key, keys_of, setting
from ftqp.model.robot import Robot
from ftqp.sim.log.log_arrays import Log
from ftqp.sim.loop import MEMORY


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodesTable(Table):
    """How many episodes, of which numbers, judged how."""

    episodes: int = setting(1000, "how many there are, 1 to 10,000,000", least=1.0, most=1e7)
    seed: int = setting(0, "of all draws: another one gives other episodes, >= 0", least=0.0)
    judged: Literal["exactly", "in physics", "beside a rival"] = setting(
        "exactly",
        "'exactly' to rounding, for arms that follow exactly; 'in physics' with 2 % on "
        "limits and 0.1 s to notice what happened; 'beside a rival' by what a user sees of the arm, also "
        "where it is led by damped least squares",
    )
    calm: float | None = setting(
        None,
        "how long an arm may take to come to rest where its target rests, > 0; 1 s exactly, 2 s "
        "in physics if absent",
        unit="s",
        above=0.0,
        most=1e6,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignFile(Table):
    """A whole campaign."""

    whole: ClassVar[str] = "a campaign"
    inside: ClassVar[tuple[str, tuple[str, ...]]] = ("scenario", tuple(keys_of(Scenario)))

    description: str = setting("", "what a reader should know")
    campaign: EpisodesTable = setting(EpisodesTable(), "how many episodes, of which numbers")
    scenario: dict[str, Any] = setting(REQUIRED, "the tables of a scenario, as in a scenario's file")
    bundles: dict[str, Any] = setting(
        {}, "by group and name, values of keys that are drawn together, with a weight"
    )
    vary: dict[str, Any] = setting(
        REQUIRED, "keys of the scenario such as 'planner.dt', each with a list of values or a distribution"
    )


PREFIX = "wheel:"
"""``wheel:NAME/path`` stands for a file of the installed package NAME."""


def located(value: Any) -> Any:
    """The value, whatever it holds, with the paths of files of packages."""
    if isinstance(value, Mapping):
        return {key: located(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [located(inner) for inner in value]
    if not isinstance(value, str) or not value.startswith(PREFIX):
        return value
    name, _, path = value.removeprefix(PREFIX).partition("/")
    try:
        file = Path(str(distribution(name).locate_file(path)))
    except PackageNotFoundError as error:
        raise FileNotFoundError(f"package {name} is not installed") from error
    if not file.is_file():
        raise FileNotFoundError(f"package {name} has no file {path}")
    return str(file.resolve())


def with_files(bundles: Mapping[str, Any], origin: str) -> tuple[dict[str, Any], list[str]]:
    """The bundles whose files there are, and a sentence for those of each group that are left out."""
    kept: dict[str, Any] = {}
    shown = []
    for group, choices in bundles.items():
        absent: dict[str, list[str]] = {}
        kept[group] = {}
        for name, one in choices.items():
            try:
                kept[group][name] = located(one)
            except FileNotFoundError as error:
                absent.setdefault(str(error), []).append(name)
        shown += [
            f"{group} {', '.join(names)} of {origin} left out, as {why}" for why, names in absent.items()
        ]
        if not kept[group]:
            why = "; ".join(absent) or "there is none"
            raise ScenarioError(f"{origin} has errors:", [f"bundles.{group} has nothing left to draw: {why}"])
    return kept, shown


ABSENT = "no such file"
"""What stands for the hash of a file that cannot be read."""


def named_files(scenario: Mapping[str, Any], vary: Mapping[str, Any], folder: Path) -> dict[str, str]:
    """The files that a scenario or what is drawn for it names, each with the hash of its bytes."""
    names = {name for tables in (scenario, vary) for name in _named(tables, "")}
    return {name: _hash(folder / name) for name in sorted(names)}


def _named(value: Any, key: str) -> Iterator[str]:
    """The texts that stand at keys of files; those of a list or of ``one_of`` are at the key itself."""
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _named(inner, key if name == "one_of" else str(name).rpartition(".")[2])
    elif isinstance(value, list):
        for inner in value:
            yield from _named(inner, key)
    elif isinstance(value, str) and key in _keys():
        yield value


@cache
def _keys() -> frozenset[str]:
    """The keys of a scenario, in whichever table, that name a file."""
    found = every_key(keys_of(Scenario))
    return frozenset(path.rpartition(".")[2] for path, key in found if key.says.file)


def _hash(file: Path) -> str:
    try:
        with file.open("rb") as content:
            return hashlib.file_digest(content, "sha256").hexdigest()
    except (OSError, ValueError):
        return ABSENT


MOST = 256
"""So many arms are kept; a campaign that draws payloads or limits has another one in every episode."""


@final
class KnownArms:
    """Makes the arms of ``[robot]`` tables, and keeps them; a copy for another process begins without any."""

    def __init__(self) -> None:
        self._known: dict[tuple[str, Path], Robot] = {}

    def __call__(self, table: RobotTable, folder: Path) -> Robot:
        """The arm of a table; files are relative to ``folder``."""
        key = repr(table), folder
        if key not in self._known:
            while len(self._known) >= MOST:
                del self._known[next(iter(self._known))]
            self._known[key] = arm_from(table, folder)
        return self._known[key]

    def __reduce__(self) -> tuple[Any, ...]:
        return KnownArms, ()


KIND = "campaign"
COLUMNS = {
    "drawn": "TEXT",
    "outcome": "TEXT",
    "status": "TEXT",
    "said": "TEXT",
    "ticks": "INTEGER",
    "largest_error": "REAL",
    "largest_ok_error": "REAL",
    "followable": "REAL",
    **{f"law_{name}": "REAL" for name in LAWS},
    **campaign_summary.REST_COLUMNS,
    **campaign_summary.COLUMNS,
    "beside": "TEXT",
    "sentences": "TEXT",
}
"""The values of an episode: a law's is by how much it was broken, 0 where it holds; ``followable`` is for how
long the target was certain to be within reach, speed and strength, so that the law of tracking holds [s]."""
SEEN_LATE = 0.05
"""With sensors a claim may be wrong for so long even where runs are judged exactly [s]."""
TRIED = 20
"""A campaign is refused when not one of its first episodes is a scenario."""
MOST_ARMS = 64
"""So many model files are kept; a campaign that draws loads or rotors has another one in every episode."""
REFUSED, RAISED = "refused", "raised"
"""Outcomes of an episode that was not run: its scenario cannot be, or something went wrong."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Campaign:
    """A campaign that is ready to be run."""

    name: str
    tables: CampaignFile
    text: str
    folder: Path
    arms: KnownArms = field(default_factory=KnownArms, compare=False, repr=False)

    @property
    def key(self) -> str:
        """Its fingerprint: a hash of its text, the files it names and the version."""
        content = plain(self.tables)
        del content["campaign"]["episodes"]
        text = json.dumps(content, sort_keys=True, default=str)
        if files := self.files:
            text += f"\n{json.dumps(files)}"
        return hashlib.sha256(f"{__version__}\n{text}".encode()).hexdigest()

    @property
    def files(self) -> dict[str, str]:
        """The files that it names, each with the hash of its bytes."""
        return named_files(self.tables.scenario, self.tables.vary, self.folder)

    @property
    def whole_text(self) -> str:
        """Its text, with a line for each file that it names: two campaigns that differ have other ones."""
        return self.text + "".join(f"# hash {digest[:12]} of {name}\n" for name, digest in self.files.items())

    def drawn(self, number: int) -> tuple[dict[str, Any], dict[str, Any]]:
        """The scenario's tables of an episode, and what was drawn for it."""
        tables = self.tables
        seed = tables.campaign.seed
        return episode(tables.scenario, tables.vary, seed, number, self.arms, self.folder, tables.bundles)

    def setup(self, number: int) -> Setup:
        """An episode ready to be run."""
        return self.setup_of(number, self.drawn(number)[0])

    def setup_of(self, number: int, content: dict[str, Any]) -> Setup:
        """An episode ready to be run, from its tables."""
        name = f"{self.name}-{number}"
        found = document.Document(name=name, origin=f"episode {number}", folder=self.folder, content=content)
        setup = resolve(found, validated(found), arms=self.arms)
        try:
            failures(setup)
        except InputError as error:  # nobody could judge it
            raise ScenarioError(f"episode {number} has errors:", [str(error)]) from error
        return setup


@final
@dataclass(frozen=True)
class EpisodeWork:
    """Runs and judges episodes."""

    campaign: Campaign
    arms: dict[str, ModelFile] = field(default_factory=dict)

    def __call__(self, items: Sequence[int]) -> list[tuple[Any, ...]]:
        """The rows of the episodes with these numbers, in the order of ``COLUMNS``."""
        return [tuple(row.get(name) for name in COLUMNS) for row in map(self._row, items)]

    def _row(self, number: int) -> dict[str, Any]:
        try:
            with quietly():
                content, drawn = self.campaign.drawn(number)
        except InputError as error:  # an arm that cannot be, for example a load on one without masses
            return {"drawn": "{}", "outcome": REFUSED, "sentences": str(error), "ticks": 0}
        return {"drawn": json.dumps(drawn, default=str)} | self.row_of(number, content)

    def row_of(self, number: int, content: dict[str, Any]) -> dict[str, Any]:
        """What came of an episode, by column, from its tables."""
        try:
            with quietly():
                if self.campaign.tables.campaign.judged == "beside a rival":
                    return self._beside(number, content)
                return self._judged(self.campaign.setup_of(number, content))
        except ScenarioError as error:
            return {"outcome": REFUSED, "sentences": str(error), "ticks": 0}
        except Exception as error:  # an exception is a result of the campaign: it is counted, not hidden
            return {"outcome": RAISED, "sentences": f"{type(error).__name__}: {error}", "ticks": 0}

    def _beside(self, number: int, content: dict[str, Any]) -> dict[str, Any]:
        """What came of an episode beside the rival."""
        found = beside_rival.beside(lambda tables: self.campaign.setup_of(number, tables), content)
        sentences = beside_rival.sentences(found["ftqp"], found["healthy"])
        return {
            "outcome": "broken" if sentences else "sound",
            "ticks": found["ticks"],
            "beside": json.dumps(found),
            "sentences": "\n".join(sentences),
        }

    def _judged(self, setup: Setup) -> dict[str, Any]:
        """What came of an episode."""
        ended = setup.simulation(log=MEMORY, singularities=False).run()
        if ended.interrupted:
            raise KeyboardInterrupt
        if ended.log is None:
            raise FtqpError("a simulation kept no log")
        shown = self.shown(setup, ended.log)
        seen = verdict(self._arm(setup), shown, self._strictness(setup))
        by_law = {f"law_{law}": 0.0 for law in LAWS} | {f"law_{b.law}": b.size for b in seen.breaches}
        return {
            "outcome": "broken" if seen.breaches else "sound",
            "status": None if ended.final_status is None else ended.final_status.name,
            "said": json.dumps({status.name: count for status, count in ended.status_counts.items()}),
            "ticks": len(ended.log) - 1,
            "largest_error": seen.largest_error,
            "largest_ok_error": seen.largest_ok_error,
            "followable": shown.until,
            "sentences": "\n".join(str(breach) for breach in seen.breaches),
            **by_law,
            **campaign_summary.rest_values(setup, shown.rest),
            **campaign_summary.detector_values(setup, ended.log),
        }

    def verdict(self, setup: Setup, log: Log) -> Verdict:
        """What the checker says of a run."""
        return verdict(self._arm(setup), self.shown(setup, log), self._strictness(setup))

    def shown(self, setup: Setup, log: Log) -> Trace:
        """What the checker is shown of a run, and for how long the target can certainly be followed."""
        run = trace(setup, log)
        sensors = setup.tables.sensors
        blind = () if sensors is None else sensors["faults"]
        failing = [*(failure.since for failure in run.failures), *(fault["at"] for fault in blind)]
        failing += [begin for begin, _ in run.holds]
        healthy = min(failing, default=np.inf)
        ticks = int(min(len(run.target), np.ceil(healthy / run.dt - 1e-9)))
        until = 0.0
        free = not (run.planes or run.cones or run.watched)
        if run.axis is None and not setup.v.any() and free:
            until = followable(self._arm(setup), run.q[0], run.target[:ticks], run.rows, run.dt)
        judged = run.axis is None and free and not blind and not run.held and not run.holds
        rest = rest_after(self._arm(setup), run, self._strictness(setup)) if judged else None
        return replace(run, can_be_followed=True, until=until, rest=rest)

    def _arm(self, setup: Setup) -> ModelFile:
        """The arm of an episode as the checker reads it."""
        name = repr((setup.tables.robot, setup.tables.simulation.mujoco))
        if name not in self.arms:
            while len(self.arms) >= MOST_ARMS:
                del self.arms[next(iter(self.arms))]
            self.arms[name] = model_file(setup)
        return self.arms[name]

    def _strictness(self, setup: Setup) -> Strictness:
        """What is let pass in an episode."""
        table, sensors = self.campaign.tables.campaign, setup.tables.sensors
        strict: Strictness = PHYSICS if table.judged == "in physics" else KINEMATIC
        if sensors is not None:  # which a planner looks through: it cannot know the truth at once
            strict = replace(strict, noise=sensors["position_noise"], grace=max(strict.grace, SEEN_LATE))
            if setup.planner.drive.kind != "position":  # and its loop passes on what noise there is
                strict = replace(strict, speed=PHYSICS.speed, acceleration=PHYSICS.acceleration)
        return strict if table.calm is None else replace(strict, calm=table.calm)


@contextmanager
def quietly() -> Iterator[None]:
    """What a planner logs for its operator is not shown meanwhile."""
    log = logging.getLogger("ftqp")
    before = log.level
    log.setLevel(logging.ERROR)
    try:
        yield
    finally:
        log.setLevel(before)


def _bundles(content: Mapping[str, Any]) -> dict[tuple[str, str], Any]:
    """The bundles of a file by group and name, as far as it has any."""
    groups = content.get("bundles")
    return {
        (group, name): bundle
        for group, bundles in (groups.items() if isinstance(groups, dict) else ())
        for name, bundle in (bundles.items() if isinstance(bundles, dict) else ())
    }


def load_campaign(source: str, overrides: Iterable[str] = ()) -> Campaign:
    """The campaign of a file; its first episodes are drawn to see that one can be run."""
    found = document.read(source, kind=KIND)
    known = set(_bundles(found.content))
    for key, bundle in _bundles(document.overridden(found, overrides, KIND).content).items():
        if key not in known and isinstance(bundle, dict) and set(bundle) == {"weight"}:
            names = ", ".join(name for group, name in sorted(known) if group == key[0])
            raise ScenarioError(
                f"--set bundles.{'.'.join(key)}.weight: there is no such bundle in {found.origin}; "
                f"it has {names or 'none of that group'}"
            )
    tables = read(CampaignFile, found.content, f"{found.origin} has errors:")
    bundles, sentences = with_files(tables.bundles, found.origin)
    tables = replace(tables, bundles=bundles)
    for sentence in sentences:
        logging.getLogger("ftqp").warning("%s", sentence)
    folder = found.folder.resolve()
    made = Campaign(name=found.name, tables=tables, text=document.toml(plain(tables)), folder=folder)
    try:
        refuse_wrong(tables.vary, tables.bundles)
    except InputError as error:
        raise ScenarioError(f"{found.origin} has errors:", [str(error)]) from error
    _try_some(made, found.origin)
    return made


def _say_what_is_not_judged(setup: Setup) -> None:
    """Constraints that the checker has no law of are kept by the planner alone."""
    names = [
        repr(name)
        for name, kept in setup.planner.constraints.items()
        if not isinstance(kept.given, Keep | TorqueLimits)
    ]
    if names:
        logging.getLogger("ftqp").warning(
            "no law of the checker is about the constraint%s %s: whether the arm keeps to it is not judged",
            "s" if len(names) > 1 else "",
            ", ".join(names),
        )


def _try_some(made: Campaign, origin: str) -> None:
    """What is drawn may be no scenario, and such episodes are counted; but not all of the first are to be."""
    tried = min(TRIED, made.tables.campaign.episodes) if made.tables.vary else 1
    for number in range(tried):
        try:
            setup = made.setup(number)
        except InputError as error:  # an arm that cannot be, for example a load on one without masses
            refused = ScenarioError(f"episode {number} has errors:", [str(error)])
        except ScenarioError as error:
            refused = error
        else:
            _say_what_is_not_judged(setup)
            return
    if not made.tables.vary:
        raise refused
    what = f"{origin} draws no scenario: none of its first {tried} episodes can be run, the last because"
    raise ScenarioError(what, refused.errors)
