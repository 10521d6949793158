"""What the colours of the live page mean, and its legend, which is made of these tables."""

from collections.abc import Mapping
from types import MappingProxyType

from ftqp.faults.kinds import KINDS
from ftqp.sim.log.signals import CONDITIONS, HEALTHY

Colour = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""


def _rgb(colour: str) -> Colour:
    """The three parts of ``#RRGGBB``."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


CONDITION: Mapping[int, Colour] = MappingProxyType(
    {HEALTHY: (46, 112, 184), **{kind.number: _rgb(kind.live_colour) for kind in KINDS.values()}}
)
"""Colour of a joint by the code of its condition."""
BRAKING: Colour = (128, 20, 24)
"""A joint that is coming to rest and will be locked."""
NEAR_LIMIT: Colour = (240, 205, 60)
"""A healthy joint beyond nine tenths of its range."""
UNKNOWN: Colour = (90, 90, 90)
"""A condition without a colour of its own."""
LINK: Colour = (208, 212, 218)
BASE: Colour = (72, 76, 84)
TARGET: Colour = (28, 150, 92)
PATH: Colour = (120, 128, 140)
TRAIL: Colour = (246, 148, 30)
ELLIPSOID: Colour = (60, 150, 210)
MARK: Colour = (0, 130, 140)
"""The target of a soft task."""
PLANE: Colour = (200, 90, 60)
"""A plane on whose side a point of the arm is kept."""
OBSTACLE: Colour = (150, 122, 96)
"""What stands around the arm."""
WAYS: tuple[Colour, ...] = ((24, 128, 128), (150, 90, 20), (70, 90, 170), (130, 120, 20), (110, 110, 110))
"""Ways out, in their order."""
RIVAL: Colour = (120, 60, 130)
"""The same arm, led by damped resolved rates."""

STATUS: Mapping[str, Colour] = MappingProxyType(
    {
        "OK": (0, 158, 115),
        "RELAXED": (225, 205, 50),
        "SCALED": (86, 180, 233),
        "LAGGING": (140, 170, 200),
        "FALLBACK": (204, 121, 167),
        "STOPPING": (230, 140, 0),
        "STOPPED": (20, 20, 20),
        "INVALID_INPUT": (213, 94, 0),
        "HELD": (150, 120, 190),
    }
)
"""Colour of a step by the name of its status."""
_FORMS = {"dot": "border-radius:50%;width:11px;height:11px", "line": "width:18px;height:4px"}
_ROW = "display:flex;align-items:center;gap:6px;break-inside:avoid;line-height:1.25;margin-bottom:2px"


def joint_colour(truth: int, braking: bool, near_limit: bool) -> Colour:
    """The colour of a joint's barrel."""
    if braking:
        return BRAKING
    if near_limit and truth == HEALTHY:
        return NEAR_LIMIT
    return CONDITION.get(truth, UNKNOWN)


def hexadecimal(colour: Colour) -> str:
    """``#rrggbb`` of a colour."""
    return "#{:02x}{:02x}{:02x}".format(*colour)


LED_OTHERWISE = "same arm, same failure, controlled by damped resolved rates with feedback"
"""What the rival of a page is."""


def legend(
    columns: int = 1, *, further: bool = False, rival: str = LED_OTHERWISE, ellipsoid: bool = True
) -> str:
    """Lines for each colour, in columns: joints by their condition, then lines and bodies."""
    joints = [("dot", CONDITION[code], f"{word} joint") for code, word in CONDITIONS.items()]
    joints += [("dot", BRAKING, "braking joint"), ("dot", NEAR_LIMIT, "joint near its limit")]
    others = [
        ("line", TRAIL, "way of the end effector"),
        ("line", PATH, "path to follow"),
        ("dot", TARGET, "target of the end effector"),
        ("dot", RIVAL, f"rival: {rival}"),
    ]
    if ellipsoid:
        others.append(
            ("dot", ELLIPSOID, "ellipsoid: speeds of the end effector that working joints can make")
        )
    if further:
        others += [
            ("dot", MARK, "target of a soft task"),
            ("dot", PLANE, "plane: a point stays on the side of the arrow"),
            ("dot", OBSTACLE, "obstacle: the arm keeps clear of it"),
        ]
    rows = "".join(
        f'<div style="{_ROW}"><span style="flex:none;display:inline-block;{_FORMS[form]};'
        f'background:{hexadecimal(colour)}"></span>{words}</div>'
        for form, colour, words in [*joints, *others]
    )
    return (
        f'<div style="font:12px/1.45 system-ui,sans-serif;color:#333;background:rgba(255,255,255,.8);'
        f'padding:6px 9px;border-radius:6px;columns:{columns};column-gap:10px">{rows}</div>'
    )
