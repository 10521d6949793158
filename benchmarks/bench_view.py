"""What the live page costs the planner that it shows: times of its steps with and without a page.

One process runs a session in its thread, as ``ftqp view`` does, with its rival. Phases with and without
the page take turns, so that both see the same machine; joints are broken and repaired all the time. Pictures
and memory are measured, too. Chromium, where it is installed, looks at the page (without ``--no-browser``).

    python benchmarks/bench_view.py                   # ten minutes; writes benchmarks/results/bench_view.md
    python benchmarks/bench_view.py --minutes 1 --name bench_view-quick
"""

import argparse
import os
import platform
import resource
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from threading import Event, Thread
from time import monotonic, perf_counter, process_time, sleep

import numpy as np
from bench import results

from ftqp import __version__
from ftqp.app.view.live_source import LiveSource, arms_of
from ftqp.sim.session.live_session import Session
from ftqp.sim.session.session_arms import Choice
from ftqp.sim.session.session_commands import Break, Repair
from ftqp.viz.live.live_page import Page

RESULTS = Path(__file__).parent / "results"
CHROMIUM = (
    "--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist", "--disable-dev-shm-usage", "--window-size=760,520",
)  # fmt: skip
PHASE = 10.0
"""Seconds of a phase."""
MEGABYTE = 1e6


def main() -> None:
    """Measure and write the report."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--name", default="bench_view")
    parser.add_argument("--no-browser", action="store_true")
    options = parser.parse_args()
    text = measure(options.minutes, None if options.no_browser else shutil.which("chromium"))
    results.written({"report": text}, text, RESULTS, options.name)
    print(text)


class Times:
    """Wall times of steps, in memory that is taken beforehand."""

    def __init__(self, most: int) -> None:
        self._kept, self._count = np.ones(most), 0

    def add(self, elapsed: int) -> None:
        """Keep one more [ns]."""
        if self._count < len(self._kept):
            self._kept[self._count] = 1e-3 * elapsed
            self._count += 1

    def __len__(self) -> int:
        return self._count

    @property
    def values(self) -> "np.ndarray[tuple[int], np.dtype[np.float64]]":
        """All of them [us]."""
        return self._kept[: self._count]


def measure(minutes: float, chromium: str | None) -> str:
    """The report."""
    session = Session(arms_of, Choice(scenario="panda-circle", overrides=("faults=",)))
    most = round(2.0 * 60.0 * minutes / session.arms.arm.planner.dt)
    times = {on: Times(most) for on in (False, True)}
    shown = Event()
    _watch(session, times, shown)
    memory: list[float] = []
    nodes: list[int] = []
    over = Event()
    with LiveSource(session) as source, Page(source, port=0) as page:
        browser = _browser(chromium, page.url)
        drawing = Thread(target=_draw, args=(page, shown, over), daemon=True)
        drawing.start()
        try:
            phases = 2 * max(1, round(30.0 * minutes / PHASE))
            for phase in range(phases):
                (shown.set if phase % 2 else shown.clear)()
                until = monotonic() + PHASE
                k = 0
                while monotonic() < until:
                    source.put(Break(k % 7) if k % 2 == 0 else Repair((k - 1) % 7))
                    k += 1
                    sleep(1.0)
                memory.append(_resident())
                nodes.append(page.nodes())
            browsers = page.browsers
        finally:
            over.set()
            drawing.join()
            if browser is not None:
                browser.terminate()
                browser.wait()
        refresh = _cost(page.refresh, 100)
    arm, tick = session._arm, session.frame.tick
    frame = _cost(lambda: arm.frame(tick), 500)
    return _report(minutes, times, memory, nodes, frame, refresh, browsers)


def _watch(session: Session, times: dict[bool, Times], shown: Event) -> None:
    """Keep the wall time of every step of the arm, apart for both kinds of phases."""
    arm, search_step = session._arm, session._arm.search_step

    def watched(k: int) -> None:
        search_step(k)
        assert arm._made is not None
        times[shown.is_set()].add(arm._made.elapsed)

    arm.search_step = watched  # type: ignore[method-assign]


def _draw(page: Page, shown: Event, over: Event) -> None:
    """Draw as ``ftqp view`` does, in phases with a page."""
    due = monotonic()
    while not over.is_set():
        if shown.is_set():
            page.refresh()
        due = max(due + 1.0 / 30.0, monotonic() - 1.0 / 30.0)
        over.wait(max(due - monotonic(), 0.0))


def _browser(chromium: str | None, url: str) -> "subprocess.Popen[bytes] | None":
    """A browser that looks at the page, if there is one."""
    if chromium is None:
        return None
    folder = tempfile.mkdtemp(prefix="ftqp-bench-")
    quiet = subprocess.DEVNULL
    return subprocess.Popen(
        [chromium, *CHROMIUM, f"--user-data-dir={folder}", "--remote-debugging-port=0", url],
        stdout=quiet, stderr=quiet,
    )  # fmt: skip


def _cost(body: Callable[[], object], count: int) -> tuple[float, float]:
    """Median wall time and mean CPU time of a call [ms]."""
    walls, began = [], process_time()
    for _ in range(count):
        at = perf_counter()
        body()
        walls.append(perf_counter() - at)
    return 1e3 * float(np.median(walls)), 1e3 * (process_time() - began) / count


def _resident() -> float:
    """Resident memory now [MB]; where /proc is missing, the most there was."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / MEGABYTE
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / MEGABYTE


def _report(
    minutes: float,
    times: dict[bool, Times],
    memory: list[float],
    nodes: list[int],
    frame: tuple[float, float],
    refresh: tuple[float, float],
    browsers: int,
) -> str:
    quantiles = {on: np.percentile(taken.values, [50.0, 99.0, 99.9]) for on, taken in times.items()}
    rows = "\n".join(
        f"| {'with' if on else 'without'} the page | {len(times[on])} | "
        + " | ".join(f"{value:.1f}" for value in quantiles[on])
        + " |"
        for on in (False, True)
    )
    steps = len(times[True]) / len(times[False])
    ratio = quantiles[True] / quantiles[False]
    half = len(memory) // 2
    load = ", ".join(f"{value:.1f}" for value in os.getloadavg())
    packages = ", ".join(map(" ".join, results.packages(("numpy", "numba", "viser")).items()))
    return f"""# What the live page costs

Made by `python benchmarks/bench_view.py`: scenario panda-circle with its rival for {minutes:g} minutes.
Phases of {PHASE:g} s with and without the page take turns in one process; a joint is broken or repaired every
second; browsers that look at the page: {browsers}. ftqp {__version__}, Python {platform.python_version()},
{packages}, {platform.machine()}, {os.cpu_count()} cores, load of the
machine at the end {load}.

| planner's step [us] | steps | p50 | p99 | p99.9 |
|---|---:|---:|---:|---:|
{rows}
| with by without | {steps:.2f} | {ratio[0]:.2f} | {ratio[1]:.2f} | {ratio[2]:.2f} |

Both kinds of phases are equally long, so that fewer steps mean a slower clock: other programs, or the page,
have taken time between two bursts of ticks.

| picture [ms] | median wall | mean CPU |
|---|---:|---:|
| frame of the session | {frame[0]:.2f} | {frame[1]:.2f} |
| frame, scene and, ten times a second, plots | {refresh[0]:.2f} | {refresh[1]:.2f} |

A frame takes {1e3 * frame[1] / quantiles[False][0]:.0f} times the CPU of the median planner step.

Resident memory: {memory[1]:.0f} MB after the first two phases, {memory[half]:.0f} MB in the middle,
{memory[-1]:.0f} MB at the end. Nodes of the scene: {min(nodes)} to {max(nodes)}.
"""


if __name__ == "__main__":
    main()
