"""An option says once what it means and takes; checks, files and lists of keys are made of that."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import pytest

import ftqp
from ftqp.app.schema.reading import Options, Table, options, plain, read
from ftqp.core.errors import InputError, ScenarioError
from ftqp.core.fixed import Fixed
from ftqp.core.setting import REQUIRED, Setting, every_key, keys_of, like, refuse_out_of_range, setting


@dataclass(frozen=True, kw_only=True)
class Spring:
    """A stranger's options, in fields."""

    stiffness: float = setting(100.0, "of the spring, > 0", unit="N/m", above=0.0)
    coils: int | None = setting(None, "how many, >= 1", least=1.0)
    hidden: float = 1.0

    def __post_init__(self) -> None:
        refuse_out_of_range(self, " of the spring")


class Damper:
    """A stranger's options, as arguments."""

    settings: ClassVar[Mapping[str, Setting]] = {
        "oil": Setting("what is in it", choices=("thin", "thick")),
        "rate": Setting("how it damps, 0 <= x < 1", least=0.0, below=1.0),
    }

    def __init__(self, owner: str, *, oil: str = "thin", rate: float) -> None:
        self.said = (owner, oil, rate)


@dataclass(frozen=True, slots=True, kw_only=True)
class Wheel(Table):
    """A table with a part of one kind or another."""

    radius: float = setting(REQUIRED, "of the wheel, > 0", unit="m", above=0.0)
    stiffness: float = like(Spring, "stiffness")
    spring: Options[Spring] = setting(options(Spring), "what it hangs on")
    kind: Options[Any] = setting(REQUIRED, "kind of part", kinds={"spring": Spring, "damper": Damper})


class Motor:
    """A stranger's options, in words.

    Args:
        poles: Of the rotor: a number of pairs.
        gear: How often the rotor turns for one turn of the joint, > 0 [-]. A larger one is slower; None
            is 0.5 of the usual one.
    """

    poles: Fixed[int] = Fixed("_poles")
    settings: ClassVar[Mapping[str, Setting]] = {"gear": Setting(above=0.0)}

    def __init__(self, poles: int = 2, gear: float | None = None) -> None:
        self._poles = poles


def wheel(**changes: Any) -> Wheel:
    content = {"radius": 0.3, "kind": "damper", "rate": 0.5}
    return read(Wheel, content | changes, "the wheel has errors:")


def test_only_fields_and_arguments_that_say_something_are_keys() -> None:
    assert list(keys_of(Spring)) == ["stiffness", "coils"]
    assert keys_of(Damper)["oil"].default == "thin" and keys_of(Damper)["rate"].default is REQUIRED
    assert keys_of(Wheel)["stiffness"].says is keys_of(Spring)["stiffness"].says
    assert not keys_of(str)


def test_an_option_means_what_the_docstring_of_its_class_says() -> None:
    said = "how often the rotor turns for one turn of the joint, > 0; if absent 0.5 of the usual one"
    assert keys_of(Motor)["gear"].says.about == said
    assert Motor.poles.__doc__ == "of the rotor"
    with pytest.raises(AttributeError, match=r"motor\.poles cannot be set: .* make another one"):
        Motor().poles = 3


def test_every_key_of_a_table_has_its_path() -> None:
    found = {path for path, _ in every_key({"wheel": keys_of(Holder)["wheel"]})}
    shared = {"radius", "stiffness", "spring.stiffness", "spring.coils"}
    spring, damper = shared | {"coils"}, shared | {"oil", "rate"}
    assert found == {*(f"wheel(spring).{k}" for k in spring), *(f"wheel(damper).{k}" for k in damper)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Holder(Table):
    """A table with a table."""

    wheel: Wheel = setting(REQUIRED, "the wheel")


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"stiffness": 0.0}, "stiffness of the spring is 0, expected a finite number > 0 N/m"),
        ({"coils": 0}, "coils is 0, expected a whole number >= 1"),
        ({"coils": True}, "coils is True, expected a whole number >= 1"),
    ],
)
def test_an_object_out_of_its_ranges_cannot_be_made(values: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        Spring(**values)
    assert Spring(coils=None).coils is None


def test_a_table_is_read_and_written_with_every_default() -> None:
    found = wheel()
    assert found.kind.made("axle").said == ("axle", "thin", 0.5)
    assert found.spring.made() == Spring()
    whole = plain(found)
    assert whole == {
        "radius": 0.3, "stiffness": 100.0, "spring": {"stiffness": 100.0, "coils": None},
        "kind": "damper", "oil": "thin", "rate": 0.5,
    }  # fmt: skip
    assert read(Wheel, whole, "again") == found


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"rate": 1.0}, "rate is 1.0, expected a number less than 1"),
        ({"oil": "thik"}, "oil is 'thik', expected one of thin, thick (did you mean 'thick'?)"),
        ({"coils": 3}, "coils is not a key of a scenario"),
        ({"kind": "brake"}, "the file has kind 'brake', expected one of spring, damper"),
        ({"spring": {"hidden": 2.0}}, "spring.hidden is not a key of [spring]"),
        ({"radius": 10**400}, "expected a number [m]"),
    ],
)
def test_what_a_setting_does_not_take_is_refused_with_its_place(
    changes: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(ScenarioError) as caught:
        wheel(**changes)
    assert sentence in "\n".join(caught.value.errors)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: ftqp.TipLimits(speed=None), lambda: ftqp.TipLimits(speed=[0.5, 0.5]),
        lambda: ftqp.Jin(gamma_p=None), lambda: ftqp.NMinusOne(horizon=[]),
        lambda: ftqp.FreeSwinging(1, damping=None),
        lambda: ftqp.Locked(1, deceleration=[1.0]), lambda: ftqp.Locked(1, mode=None),
        lambda: ftqp.Task(mode=None), lambda: ftqp.Drive(brakes=None),
        lambda: ftqp.MovingBase(sensing=None),
        lambda: ftqp.MovingBase(delay=None), lambda: ftqp.Noise(q=[1e-4] * 7),
        lambda: ftqp.Clearance(keep=None),
    ],
)  # fmt: skip
def test_none_and_lists_are_no_numbers_and_no_words(wrong):
    with pytest.raises(InputError, match=r"^\w+( of the \w+)? is (None|\[)"):
        wrong()
