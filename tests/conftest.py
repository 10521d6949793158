"""For all tests: how long a case takes decides nothing, as machines differ; whole scripts are slow.

Cases that only combine values which others have, too, are slow, but those of laws, papers and the checker.
"""

import gc
import logging
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

import ftqp

settings.register_profile("ftqp", deadline=None)
settings.load_profile("ftqp")

SCRIPTS = [Path(__file__).parent / name for name in ("solvers", "benchmarks", "studies", "examples")]
FROM_END_TO_END = (
    "test_bench_", "test_study_", "test_campaign", "test_scripts", "test_well_wired", "test_examples",
)  # fmt: skip
"""Tests that run a script from end to end: ``make test-all`` has them, ``make test`` has not."""
EVERY_COMBINATION = ("laws", "papers", "checker")
"""Folders of which ``make test`` has every combination, too, unless the test is long."""


@pytest.fixture(scope="session")
def panda() -> ftqp.Robot:
    """The arm of most tests."""
    return ftqp.robots.load("panda")


def pytest_addoption(parser: pytest.Parser) -> None:
    """``--few 2``: of each parametrised test its first and its last case only."""
    parser.addoption("--few", type=int, metavar="N", help="run N cases of each test, evenly spread")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """What is collected stays: the garbage collector looks at it neither meanwhile nor in any test."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark whole scripts as slow, and what only combines values that other cases of a test have, too.

    What ``--few`` leaves out is left out.
    """
    for item in items:
        if item.path.parent in SCRIPTS and item.path.name.startswith(FROM_END_TO_END):
            item.add_marker(pytest.mark.slow)
    for cases in cases_of(items):
        quick = not_slow(cases)
        if len(quick) > 1 and (quick[0].get_closest_marker("long") or not of_every_combination(quick[0])):
            for case in {*quick} - {*covering(quick)}:
                case.add_marker(pytest.mark.slow)
    if few := config.getoption("few"):
        kept = {one for same in cases_of(items) for one in spread(not_slow(same) or same, few)}
        config.hook.pytest_deselected(items=[item for item in items if item not in kept])
        items[:] = [item for item in items if item in kept]


def cases_of(items: list[pytest.Item]) -> Iterable[list[pytest.Item]]:
    """The cases of each test."""
    cases: dict[str, list[pytest.Item]] = {}
    for item in items:
        cases.setdefault(item.nodeid.partition("[")[0], []).append(item)
    return cases.values()


def not_slow(cases: list[pytest.Item]) -> list[pytest.Item]:
    """Those of them that ``make test`` has."""
    return [case for case in cases if not case.get_closest_marker("slow")]


def of_every_combination(case: pytest.Item) -> bool:
    """Whether it stands in one of the folders of which ``make test`` has every combination."""
    return any(case.path.is_relative_to(Path(__file__).parent / name) for name in EVERY_COMBINATION)


def covering(cases: list[pytest.Item]) -> Iterator[pytest.Item]:
    """A few in which every value of each parameter occurs, each about as often as the others."""
    values = {case: values_of(case) for case in cases}
    met: Counter[tuple[tuple[str, int], ...]] = Counter()

    def worth(case: pytest.Item) -> tuple[int, int]:
        """How many of its values are new, and how rare the others."""
        uses = [met[value] for value in values[case]]
        return uses.count(0), -sum(uses)

    while cases and worth(best := max(cases, key=worth))[0]:
        yield best
        met.update(values[best])


def values_of(case: Any) -> set[tuple[tuple[str, int], ...]]:
    """Its values by their names; those that one decorator gives together are one."""
    given = case.callspec.params
    names = [mark.args[0] for mark in case.iter_markers("parametrize")]
    together = [one.replace(" ", "").split(",") if isinstance(one, str) else one for one in names]
    alone = given.keys() - {name for one in together for name in one}
    return {
        tuple((name, id(given[name])) for name in one) for one in [*together, *([name] for name in alone)]
    }


def spread(cases: list[pytest.Item], few: int) -> list[pytest.Item]:
    """At most so many of them, from the first to the last."""
    places = {k * (len(cases) - 1) // max(1, few - 1) for k in range(few)}
    return [case for place, case in enumerate(cases) if place in places]


@pytest.fixture(params=["acceleration", "velocity"])
def level(request: pytest.FixtureRequest) -> str:
    """Both levels at which a planner works."""
    return str(request.param)


@pytest.fixture(params=["position", "velocity", "torque"])
def drive(request: pytest.FixtureRequest) -> str:
    """All drives that an arm may have."""
    return str(request.param)


@pytest.fixture(autouse=True, scope="module")
def what_is_said() -> Iterator[None]:
    """Scripts that say errors alone, and calls that are interrupted, hush no test after them."""
    log, disabled = logging.getLogger("ftqp"), logging.root.manager.disable
    level, filters = log.level, log.filters.copy()
    yield
    log.setLevel(level)
    log.filters[:] = filters
    logging.disable(disabled)
