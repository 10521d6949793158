"""What is taken of the messages of a browser: where its camera is, values of controls, moves of the handle.

viser itself lets a browser set any property of any control, and believes what it says of types.
"""

from collections.abc import Callable, Mapping
from math import hypot, isfinite
from typing import Any, Final

FARTHEST: Final = 1e6
"""The largest number of a camera or a handle [m, rad, pixels]."""
LONGEST: Final = 1000
"""Letters of a text field, or of a name, at most."""
ROUNDING: Final = 1e-6
"""Share of a control's range by which a browser may round beyond it."""
LARGEST: Final = 1 << 24
"""Most bytes of a picture; every other message is far smaller."""
USUAL: Final = 1 << 14
"""Most bytes of any other message."""

Control = Any
"""viser's state of a control: its ``value`` and its ``props``."""
Check = Callable[[Any], bool]


def is_number(value: Any) -> bool:
    """A finite number of a size that a page has a use for."""
    return isinstance(value, int | float) and not isinstance(value, bool) and _is_moderate(value)


def _is_moderate(value: float) -> bool:
    return isfinite(value) and abs(value) <= FARTHEST


def _is_name(value: Any) -> bool:
    return isinstance(value, str) and len(value) <= LONGEST


def _is_vector(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(map(is_number, value))


def _is_rotation(value: Any) -> bool:
    """A unit quaternion, but for rounding."""
    return (
        isinstance(value, list)
        and len(value) == 4
        and all(map(is_number, value))
        and abs(hypot(*value) - 1.0) < 1e-3
    )


def _is_count(value: Any) -> bool:
    return isinstance(value, int) and is_number(value) and value >= 0


def _is_picture(value: Any) -> bool:
    return isinstance(value, bytes)


def _is_index(value: Any) -> bool:
    return value is None or _is_count(value)


def _is_place(value: Any) -> bool:
    """A place in the window."""
    return isinstance(value, list) and len(value) == 2 and all(map(is_number, value))


def _is_modifier(value: Any) -> bool:
    """Keys that are held, or none."""
    return value is None or _is_name(value)


_NODE: Mapping[str, Check] = {"name": _is_name, "owner": _is_name}
MESSAGES: Mapping[str, Mapping[str, Check]] = {
    "ViewerCameraMessage": {
        "wxyz": _is_rotation, "position": _is_vector, "look_at": _is_vector, "up_direction": _is_vector,
        "fov": is_number, "near": is_number, "far": is_number,
        "image_height": _is_count, "image_width": _is_count,
    },
    "TransformControlsDragStartMessage": _NODE,
    "TransformControlsUpdateMessage": {**_NODE, "wxyz": _is_rotation, "position": _is_vector},
    "TransformControlsDragEndMessage": _NODE,
    "SceneNodeClickMessage": {
        **_NODE, "instance_index": _is_index, "ray_origin": _is_vector, "ray_direction": _is_vector,
        "screen_pos": _is_place, "modifier": _is_modifier,
    },
    "GetRenderResponseMessage": {"payload": _is_picture, "render_uuid": _is_name},
}  # fmt: skip
"""Messages that are taken beside ``GuiUpdateMessage``, and what each part of them must be."""
OPTIONAL: Final = ("owner",)
"""Parts that may be missing."""


def is_taken(message: Any, size: int, control: Callable[[str], Control | None]) -> bool:
    """Whether a message of a browser is handed to viser.

    The message is as it was unpacked, anything at all, and ``control`` finds a control by its identity.
    """
    if not isinstance(message, dict):
        return False
    parts = {name: value for name, value in message.items() if name != "type"}
    kind = message.get("type")
    if not isinstance(kind, str) or size > (LARGEST if kind == "GetRenderResponseMessage" else USUAL):
        return False
    if kind == "GuiUpdateMessage":
        return _is_update(parts, control)
    checks = MESSAGES.get(kind)
    if checks is None or not set(checks) - set(OPTIONAL) <= set(parts) <= set(checks):
        return False
    return all(checks[name](value) for name, value in parts.items())


def _is_update(parts: Mapping[Any, Any], control: Callable[[str], Control | None]) -> bool:
    """Whether a message sets the value of a control that there is to one that it can have."""
    uuid, updates = parts.get("uuid"), parts.get("updates")
    if set(parts) != {"uuid", "updates"} or not _is_name(uuid):
        return False
    if not isinstance(updates, dict) or set(updates) != {"value"}:
        return False
    found = control(str(uuid))
    return found is not None and is_value(updates["value"], found)


def is_value(value: Any, control: Control) -> bool:
    """Whether a control can have a value: one of its options, a number in its range, a short text."""
    props, present = control.props, control.value
    options = getattr(props, "options", None)
    if options is not None:
        return isinstance(value, str) and value in options
    if isinstance(present, bool):
        return isinstance(value, bool)
    if isinstance(present, int | float):
        return is_number(value) and _is_between(
            value, getattr(props, "min", None), getattr(props, "max", None)
        )
    return isinstance(present, str) and _is_name(value)


def _is_between(value: float, low: float | None, high: float | None) -> bool:
    slack = ROUNDING * max(abs(low or 0.0), abs(high or 0.0), 1.0)
    return (low is None or value >= low - slack) and (high is None or value <= high + slack)
