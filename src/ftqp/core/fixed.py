"""Attributes that are set once: whoever sets one later reads how to get what was meant."""

from collections.abc import Callable
from operator import attrgetter
from typing import Any, Generic, NoReturn, TypeVar, overload

from ftqp.core.setting import words_of

T = TypeVar("T")
MADE = "the object was laid out for it; make another one"
"""The remedy where there is no verb that changes an attribute."""


class Fixed(Generic[T]):
    """An attribute that can be read and not be set.

    Args:
        path: Where its object keeps it, dotted, or what reads it of the object.
        about: What it is, with its unit: the documentation of the attribute; without one it is what its
            class says of the argument of that name.
        remedy: What to do in place of setting it, in words; ``{name}`` is the attribute.
    """

    def __init__(self, path: str | Callable[[Any], T], about: str = "", remedy: str = MADE) -> None:
        self._read = attrgetter(path) if isinstance(path, str) else path
        self.__doc__, self._remedy = about, remedy

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name
        self.__doc__ = self.__doc__ or words_of(owner, name)

    @overload
    def __get__(self, owner: None, kind: type) -> "Fixed[T]": ...

    @overload
    def __get__(self, owner: Any, kind: type) -> T: ...

    def __get__(self, owner: Any, kind: type) -> "Fixed[T] | T":
        if owner is None:
            return self
        value: T = self._read(owner)
        return value

    def __set__(self, owner: Any, value: Any) -> NoReturn:
        self._refuse(owner, "set")

    def __delete__(self, owner: Any) -> NoReturn:
        self._refuse(owner, "deleted")

    def _refuse(self, owner: Any, what: str) -> NoReturn:
        name, remedy = f"{type(owner).__name__.lower()}.{self._name}", self._remedy.format(name=self._name)
        raise AttributeError(f"{name} cannot be {what}: {remedy}")
