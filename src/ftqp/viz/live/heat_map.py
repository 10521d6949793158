"""Which failures a motion survives, as a map in the panel: a click on a place plays that failure."""

from collections.abc import Callable
from html import escape
from itertools import pairwise
from json import dumps
from typing import Any, final

import numpy as np

from ftqp.sim.session.session_commands import Command, Play
from ftqp.viz.live.stage import HeatMap

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
        self._said = gui.add_html(_line("Click on the map, or write joint and time."))
        self._field.on_update(self._changed)

    async def _changed(self, event: Any) -> None:
        """Play what the field names, or say what is wrong with it."""
        if event.client is None:
            return
        found = named_failure(str(event.target.value), self._heat)
        if isinstance(found, str):
            self._said.content = _line(found)
            return
        i, k = found
        name, time = self._heat.joints[i], float(self._heat.times[k])
        verdict = self._heat.words.get(int(self._heat.codes[i, k]), "unknown")
        self._said.content = _line(f"{name} locks at {time:.2f} s: {verdict}")
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


def _line(text: str) -> str:
    """A small line of text."""
    return f'<div style="font:12px system-ui;color:#444;padding:2px 10px">{escape(text)}</div>'
