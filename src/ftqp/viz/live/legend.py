"""What the colours in a scene mean, as a piece of HTML."""

from ftqp.sim.log.signals import CONDITIONS
from ftqp.viz.live import colours

_FORMS = {"dot": "border-radius:50%;width:11px;height:11px", "line": "width:18px;height:4px"}


_ROW = "display:flex;align-items:center;gap:6px;break-inside:avoid;line-height:1.25;margin-bottom:2px"


def legend(columns: int = 1) -> str:
    """A line for each colour: joints by their condition, then lines and bodies.

    Args:
        columns: How many lines stand beside each other, >= 1.
    """
    joints = [("dot", colours.CONDITION[code], f"{word} joint") for code, word in CONDITIONS.items()]
    joints += [
        ("dot", colours.BRAKING, "braking joint"),
        ("dot", colours.NEAR_LIMIT, "joint near its limit"),
    ]
    others = [
        ("line", colours.TRAIL, "way of the tip"),
        ("line", colours.PATH, "path to follow"),
        ("dot", colours.TARGET, "target of the tip"),
        ("dot", colours.GHOST, "ghost: same arm, never told of its faults"),
        ("dot", colours.ELLIPSOID, "ellipsoid: tip speeds that working joints can make"),
    ]
    rows = "".join(
        f'<div style="{_ROW}"><span style="flex:none;display:inline-block;{_FORMS[form]};'
        f'background:{colours.hexadecimal(colour)}"></span>{words}</div>'
        for form, colour, words in [*joints, *others]
    )
    return (
        f'<div style="font:12px/1.45 system-ui,sans-serif;color:#333;background:rgba(255,255,255,.8);'
        f'padding:6px 9px;border-radius:6px;columns:{columns};column-gap:10px">{rows}</div>'
    )
