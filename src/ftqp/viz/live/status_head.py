"""The head of a page: what the arm does and what has failed, as HTML that people and programs read."""

from collections.abc import Sequence
from html import escape

import numpy as np

from ftqp.core.checks import IntArray
from ftqp.sim.log.signals import CONDITIONS, HEALTHY
from ftqp.sim.session.frame import Frame
from ftqp.viz.live import colours

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
