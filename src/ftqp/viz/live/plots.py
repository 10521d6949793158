"""The head, the plots and the ribbon of a page, and the last seconds that they are of."""

from collections.abc import Callable, Sequence
from html import escape
from itertools import groupby, pairwise
from json import dumps
from typing import Any, final

import numpy as np

from ftqp.core.checks import FloatArray, IntArray
from ftqp.sim.log.signals import CONDITIONS, HEALTHY
from ftqp.sim.session.frame import Frame
from ftqp.sim.session.session_commands import Command, Play
from ftqp.viz.live import colours
from ftqp.viz.live.stage import HeatMap

SAMPLES = 150
"""Samples that are kept."""
SPAN = 10.0
"""Time that they cover [s]."""
GAP = 2.5
"""A frame so much later than the last one begins anew [s]."""
LEAST_ERROR, LEAST_TIME = 1e-3, 1.0
"""Errors [mm] and step times [us] below these are drawn there, on logarithmic axes."""
LINES = ("#1f77b4", "#ff7f0e", "#2ca02c", "#9467bd", "#8c564b", "#e377c2", "#17becf", "#bcbd22", "#7f7f7f")
"""Colours of the joints' lines, used again after the last one; red is a limit's."""
LIMIT = "#d62728"
HEIGHT = 140
"""Height of a plot [px]."""
_SMALL: dict[str, Any] = {"size": 46, "font": "11px system-ui", "gap": 3, "ticks": {"size": 4}}
_TIME: dict[str, Any] = {**_SMALL, "size": 26, "splits": (-10, -8, -6, -4, -2, 0)}
_AGO: dict[str, Any] = {"time": False, "range": (-SPAN, 0.0)}
_NOTE = (
    '<div style="font:11px system-ui;color:#888;padding:0 12px">seconds before now, below every plot</div>'
)


@final
class History:
    """Samples of frames in the order of their times; a frame before the last one begins anew."""

    def __init__(self, frame: Frame) -> None:
        self.t: FloatArray = np.zeros(SAMPLES)
        self.share: FloatArray = np.zeros((SAMPLES, len(frame.share)))
        self.error: FloatArray = np.zeros(SAMPLES)
        self.rival: FloatArray = np.zeros(SAMPLES)
        self.step_time: FloatArray = np.zeros(SAMPLES)
        self.status: list[str] = []
        self._tick = frame.tick
        self._begin(frame)

    def add(self, frame: Frame) -> None:
        """Keep a frame, unless the last one that was kept is too near."""
        if frame.tick < self._tick or frame.t < self.t[-1] or frame.t > self.t[-1] + GAP:
            self._begin(frame)
        elif _place(frame.t) > _place(float(self.t[-1])):
            for column in (self.t, self.share, self.error, self.rival, self.step_time):
                column[:-1] = column[1:]
            self.status = [*self.status[1:], frame.status]
            self._write(frame)
        self._tick = frame.tick

    @property
    def ago(self) -> FloatArray:
        """The times of the samples before the last one, (SAMPLES,), <= 0 [s]."""
        result: FloatArray = self.t - self.t[-1]
        return result

    def step_quantile(self, share: float) -> float:
        """The step time that a share of the samples that are kept does not exceed [us]."""
        known = self.step_time[np.isfinite(self.step_time)]
        return float(np.quantile(known, share)) if known.size else np.nan

    def ribbon(self, width: int = 300, height: int = 14) -> str:
        """The statuses as a strip of SVG, the latest at its right end."""
        bar, pieces, end = width / SAMPLES, [], 0
        for status, spell in groupby(self.status):
            start, end = end, end + len(list(spell))
            if status:
                fill = colours.hexadecimal(colours.STATUS.get(status, colours.UNKNOWN))
                pieces.append(
                    f'<rect x="{start * bar:g}" width="{(end - start) * bar:g}" height="{height}" '
                    f'fill="{fill}"><title>{escape(status)}</title></rect>'
                )
        return (
            f'<svg viewBox="0 0 {width} {height}" width="100%" height="{height}" '
            f'preserveAspectRatio="none">{"".join(pieces)}</svg>'
        )

    def _begin(self, frame: Frame) -> None:
        """Forget every sample but one."""
        self.t[:] = frame.t + np.linspace(-SPAN * (1.0 - 1.0 / SAMPLES), 0.0, SAMPLES)
        for column in (self.share, self.error, self.rival, self.step_time):
            column[:] = np.nan
        self.status = [""] * (SAMPLES - 1) + [frame.status]
        self._tick = frame.tick
        self._write(frame)

    def _write(self, frame: Frame) -> None:
        """The latest sample."""
        self.t[-1] = frame.t
        self.share[-1] = frame.share
        self.error[-1] = _millimetres(frame.position_error)
        seen = frame.rival is not None and frame.truth.any()
        self.rival[-1] = _millimetres(frame.rival.error) if seen and frame.rival else np.nan
        self.step_time[-1] = max(frame.step_time_us, LEAST_TIME)


def _place(t: float) -> int:
    """The number of the sample that a time [s] belongs to."""
    return int(np.floor(t * SAMPLES / SPAN + 1e-6))


def _millimetres(error: float) -> float:
    """An error [m] in mm, at least what the axis begins with."""
    return float(np.maximum(1e3 * error, LEAST_ERROR))


@final
class Plots:
    """Three plots in the container that is open."""

    def __init__(self, gui: Any, joints: Sequence[str], history: History) -> None:
        lines = [_line(str(i + 1), LINES[i % len(LINES)]) for i in range(len(joints))]
        ends = [_line("upper", LIMIT, dash=(4, 4)), _line("lower limit", LIMIT, dash=(4, 4))]
        healthy = colours.hexadecimal(colours.CONDITION[0])

        def add(data: Any, series: Sequence[Any], title: str, scale: Any, axis: Any, **more: Any) -> Any:
            look = {"legend": {"show": True, "live": False}, "height": HEIGHT, **more}
            scales, all_series = {"x": _AGO, "y": scale}, ({"label": "before now [s]"}, *series)
            return gui.add_uplot(
                data=data, series=all_series, title=title, scales=scales, axes=(_TIME, axis), **look
            )

        both = [_line("ftqp", healthy), _line("resolved rates", colours.hexadecimal(colours.RIVAL))]
        range_of_errors = {"distr": 3, "log": 10, "range": (LEAST_ERROR, 3e3)}
        self._error = add(
            _errors(history), both, "error of the end effector [mm]", range_of_errors, _decades(-3, 3)
        )
        gui.add_html(_NOTE)
        few = {"show": True, "live": False} if len(joints) <= len(LINES) else {"show": False}
        self._joints = add(
            _shares(history), [*lines, *ends], f"joints 1 to {len(joints)} in their ranges, limits at ±1",
            {"range": (-1.15, 1.15)}, _SMALL, legend=few, height=HEIGHT + 20,
        )  # fmt: skip
        times = [_line("step", "#888888"), _line("median", healthy), _line("99.9 %", LIMIT, dash=(4, 4))]
        range_of_times = {"distr": 3, "log": 10, "range": (LEAST_TIME, 3e4)}
        title = "time of a planner's step [µs]"
        self._time = add(_times(history), times, title, range_of_times, _decades(0, 4))

    def show(self, history: History) -> None:
        """Draw what has been kept."""
        self._joints.data = _shares(history)
        self._error.data = _errors(history)
        self._time.data = _times(history)


def _decades(low: int, high: int) -> dict[str, Any]:
    """A logarithmic axis with a mark at every power of ten."""
    powers = [10.0**k for k in range(low, high + 1)]
    return {**_SMALL, "splits": powers, "values": [f"{power:,g}" for power in powers], "space": 1}


def _line(label: str, colour: str, dash: tuple[int, int] | None = None) -> dict[str, Any]:
    """The look of a curve."""
    look = {"label": label, "stroke": colour, "width": 1.5, "points": {"show": False}}
    return look if dash is None else {**look, "dash": dash}


def _shares(history: History) -> tuple[FloatArray, ...]:
    """Times, the place of each joint in its range, and both limits."""
    ones = np.ones(SAMPLES)
    return (history.ago, *(column.copy() for column in history.share.T), ones, -ones)


def _errors(history: History) -> tuple[FloatArray, ...]:
    """Times, the error of the tip and that of the rival."""
    return history.ago, history.error.copy(), history.rival.copy()


def _times(history: History) -> tuple[FloatArray, ...]:
    """Times, the time of a step, its median and what one in a thousand exceeds."""
    median, slow = (np.full(SAMPLES, history.step_quantile(share)) for share in (0.5, 0.999))
    return history.ago, history.step_time.copy(), median, slow


_FONT = "font:13px/1.45 system-ui,sans-serif;color:#222"


def status_head(frame: Frame, title: str, joints: Sequence[str], ribbon: str) -> str:
    """Status, sentence, time, errors, what has failed, the last refusal, and the ribbon."""
    light = colours.hexadecimal(colours.STATUS.get(frame.status, colours.UNKNOWN))
    time = "paused" if frame.paused else f"{_short(frame.pace)} × real time"
    facts = [f"{frame.t:.1f} s, {time}", f"error <b>{_length(frame.position_error)}</b>"]
    if frame.rival is not None and frame.truth.any():
        colour = colours.hexadecimal(colours.RIVAL)
        how = "reported" if frame.rival.reported else "not reported"
        facts.append(
            f'<span style="color:{colour}">resolved rates, {how}: <b>{_length(frame.rival.error)}</b></span>'
        )
    note = f'<div style="color:#8a4b00">{escape(frame.message)}</div>' if frame.message else ""
    return (
        f'<div id="ftqp-status" data-status="{escape(frame.status, quote=True)}" '
        f'data-faults="{_listed(frame.truth, joints)}" data-belief="{_listed(frame.belief, joints)}" '
        f'data-tick="{frame.tick}" data-stage="{frame.stage}" data-paused="{str(frame.paused).lower()}" '
        f'style="{_FONT};padding:2px 10px">'
        f'<div style="color:#666">{escape(title)}</div>'
        f'<div style="font-size:17px;font-weight:600"><span style="display:inline-block;width:12px;'
        f'height:12px;border-radius:50%;background:{light};margin-right:7px"></span>{escape(frame.status)}</div>'
        f'<div style="min-height:37px">{escape(frame.sentence)}</div>'
        f"<div>{'<br>'.join(facts)}</div>{note}"
        f'<div style="margin-top:4px">{ribbon}</div>'
        '<div style="color:#888;font-size:11px">status of the last 10 s</div></div>'
    )


def joint_table(frame: Frame, joints: Sequence[str]) -> str:
    """What each joint really is, and what the planner believes of it."""
    rows = "".join(
        f'<tr><td style="padding:0 8px 0 0">{escape(name)}</td>'
        f"{_cell(int(frame.truth[i]), bool(frame.braking[i]))}{_cell(int(frame.belief[i]), False)}</tr>"
        for i, name in enumerate(joints)
    )
    head = '<tr style="color:#666;text-align:left"><th></th><th>really</th><th>planner believes</th></tr>'
    return (
        f'<div style="{_FONT};padding:0 10px"><table id="ftqp-joints" style="border-collapse:collapse;'
        f'font-size:12px;line-height:1.3;width:100%">{head}{rows}</table></div>'
    )


def _cell(code: int, braking: bool) -> str:
    """A condition with its colour."""
    word = "braking" if braking else CONDITIONS.get(code, "unknown")
    colour = colours.hexadecimal(colours.BRAKING if braking else colours.CONDITION.get(code, colours.UNKNOWN))
    shade = "#999" if code == HEALTHY else "#111;font-weight:600"
    return (
        f'<td style="padding:0 8px 0 0;color:{shade}"><span style="display:inline-block;width:9px;height:9px;'
        f'border-radius:50%;background:{colour};margin-right:5px"></span>{word}</td>'
    )


def _listed(codes: IntArray, joints: Sequence[str]) -> str:
    """``joint:condition`` of each joint that is not healthy, with spaces between, for an attribute."""
    found = [f"{joints[i]}:{CONDITIONS[int(codes[i])]}" for i in codes.nonzero()[0].tolist()]
    return escape(" ".join(found), quote=True)


def _length(error: float) -> str:
    """A length [m] in words that a person can judge."""
    if not np.isfinite(error):
        return "unknown"
    millimetres = 1e3 * error
    if millimetres >= 1000.0:
        return f"{error:.2f} m"
    return "< 0.01 mm" if millimetres < 0.01 else f"{millimetres:.3g} mm"


def _short(factor: float) -> str:
    """A factor with two digits."""
    return f"{factor:.2g}" if np.isfinite(factor) else "?"


WIDTH, ROW = 300, 20
"""Width of the map and height of a joint's row, in units of its drawing."""
BETWEEN = " @ "
"""Between joint and time, in the words that name a failure."""
_PICK = (
    "const m=event.currentTarget,b=m.getBoundingClientRect(),"
    "n=JSON.parse(m.dataset.joints),t=JSON.parse(m.dataset.times),"
    "i=Math.min(n.length-1,Math.max(0,Math.floor((event.clientY-b.top)/b.height*n.length))),"
    "w=t[0]+(event.clientX-b.left)/b.width*(m.dataset.end-t[0]),"
    "k=t.reduce((p,c,j)=>c<=w?j:p,0),"
    "f=[...document.querySelectorAll('input.mantine-TextInput-input')]"
    ".find(i=>m.compareDocumentPosition(i)&Node.DOCUMENT_POSITION_FOLLOWING);"
    "Object.getOwnPropertyDescriptor(HTMLInputElement.prototype,'value').set.call(f,n[i]+m.dataset.between+t[k]);"
    "f.dispatchEvent(new Event('input',{bubbles:true}));"
)
"""What a click does: it writes the failure into the field below the map, as a person could."""


@final
class FailureMap:
    """The map with a field that says which failure is played, in the container that is open."""

    def __init__(self, gui: Any, heat: HeatMap, put: Callable[[Command], None]) -> None:
        self._heat, self._put = heat, put
        gui.add_html(failure_map(heat))
        self._field = gui.add_text("failure", "")
        self._said = gui.add_html(_joint_row("Click on the map, or write joint and time."))
        self._field.on_update(self._changed)

    async def _changed(self, event: Any) -> None:
        """Play what the field names, or say what is wrong with it."""
        if event.client is None:
            return
        found = named_failure(str(event.target.value), self._heat)
        if isinstance(found, str):
            self._said.content = _joint_row(found)
            return
        i, k = found
        name, time = self._heat.joints[i], float(self._heat.times[k])
        verdict = self._heat.words.get(int(self._heat.codes[i, k]), "unknown")
        self._said.content = _joint_row(f"{name} locks at {time:.2f} s: {verdict}")
        self._put(Play(name, time))


def named_failure(text: str, heat: HeatMap) -> tuple[int, int] | str:
    """Row and column of a failure by its words, ``joint @ time``; a sentence where there is none."""
    name, _, time = text.rpartition(BETWEEN)
    try:
        at = float(time)
    except ValueError:
        at = np.nan
    if name not in heat.joints or not np.isfinite(at):
        return f"expected joint{BETWEEN}time [s], for example {heat.joints[0]}{BETWEEN}{heat.times[0]:.2f}"
    return heat.joints.index(name), int(np.argmin(np.abs(heat.times - at)))


def failure_map(heat: HeatMap) -> str:
    """The map as HTML: a row for each joint, verdicts over the time of the failure."""
    end = float(heat.times[-1] + (heat.times[-1] - heat.times[-2] if len(heat.times) > 1 else 1.0))
    begin = float(heat.times[0])
    edges = (np.append(heat.times, end) - begin) / (end - begin) * WIDTH
    bars = []
    for i, codes in enumerate(heat.codes):
        starts = [0, *(np.flatnonzero(np.diff(codes)) + 1), len(codes)]
        for first, last in pairwise(starts):
            code = int(codes[first])
            bars.append(
                f'<rect x="{edges[first]:.2f}" y="{i * ROW}" width="{edges[last] - edges[first]:.2f}" '
                f'height="{ROW - 2}" fill="{escape(heat.colours.get(code, "#999999"), quote=True)}"/>'
            )
    names = "".join(
        f'<div style="height:{ROW}px;line-height:{ROW - 2}px;overflow:hidden">{escape(name)}</div>'
        for name in heat.joints
    )
    seen = sorted({int(code) for code in np.unique(heat.codes)})
    words = " ".join(
        '<span style="white-space:nowrap"><span style="display:inline-block;width:10px;height:10px;'
        f'background:{escape(heat.colours.get(code, "#999999"), quote=True)};border:1px solid #bbb"></span> '
        f"{escape(heat.words.get(code, 'unknown'))}</span>"
        for code in seen
    )
    height = ROW * len(heat.joints)
    joints = escape(dumps(heat.joints), quote=True)
    times = escape(dumps([round(float(t), 6) for t in heat.times]), quote=True)
    return (
        '<div style="font:12px system-ui,sans-serif;color:#222;padding:0 10px">'
        f"<div><b>{100.0 * heat.coverage:.1f} %</b> of these locks are survived; a click plays one</div>"
        f'<div style="display:flex;gap:6px;margin:6px 0"><div style="max-width:45%">{names}</div>'
        f'<svg id="ftqp-failures" viewBox="0 0 {WIDTH} {height}" preserveAspectRatio="none" '
        f'style="flex:1;height:{height}px;min-width:0;cursor:pointer" data-joints="{joints}" '
        f'data-times="{times}" data-end="{end:g}" data-between="{BETWEEN}" '
        f'onclick="{escape(_PICK, quote=True)}">'
        f"{''.join(bars)}</svg></div>"
        f'<div style="display:flex;justify-content:space-between;color:#666"><span>time of the failure [s]: '
        f"{begin:g}</span><span>{end:g}</span></div><div>{words}</div></div>"
    )


def _joint_row(text: str) -> str:
    """A small line of text."""
    return f'<div style="font:12px system-ui;color:#444;padding:2px 10px">{escape(text)}</div>'
