"""What a kind of task or constraint of one's own must have, checked when one is made."""

from typing import Any

from ftqp.core.errors import InputError, unknown
from ftqp.core.setting import keys_of, refuse_out_of_range


def refuse_unfinished(made: Any, most: int) -> None:
    """Refuse one whose settings are not as they say, whose ``count`` is none, or that lacks ``filling``."""
    kind = type(made).__name__
    for name in ("count", "filling"):
        if getattr(getattr(type(made), name), "__isabstractmethod__", False):
            what = "a property" if name == "count" else "a method filling(robot)"
            raise InputError(f"{kind} has no {name}, expected {what}, as CONTRIBUTING.md shows")
    refuse_out_of_range(made, f" of {made.label}", every=True)
    for name, key in keys_of(type(made)).items():
        value = getattr(made, name)
        if key.says.choices and isinstance(value, str) and value not in key.says.choices:
            raise unknown(name, value, made.label, key.says.choices)
    count = made.count
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= most:
        raise InputError(
            f"count of {made.label} is {count!r:.60}, expected a whole number of rows, 1 to {most}"
        )
