"""Tables of status words, one TOML file a maker, and their one reader."""

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from numbers import Integral
from types import MappingProxyType
from typing import Any, Final

from ftqp.core.errors import InputError, unknown
from ftqp.faults.kinds import Degraded, Fault, FreeSwinging, Locked
from ftqp.vendors.verdict import GOES_ON, PAUSED, PERSON, RecoveryStep, Verdict

ALL_BITS: Final = -1
WEAK: Final = 0.3
"""Share of speed and torque that is left to a joint whose drive warns that it is at its limits."""
LOOK: Final = (RecoveryStep(PERSON, "look up the number in the maker's manual"),)


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One meaning of a status word.

    Args:
        values: Numbers or names: the word is one of them, or holds one of them.
        mask: The bits that are compared; None: any bit of ``values`` is set.
        means: What it says.
        well: It says that all is well.
        joint: What of the joint: ``off``, ``locked``, ``weak``, or empty.
        arm: What of the whole arm.
        sensor: ``lost``, or empty.
        recovery: The name of the steps.
        after: It counts only after so long [s].
        names: The word names a joint: its value less this is the joint's place.
        heat: It is a matter for ``Spare``.
        unsure: It stands in no text of the maker.
    """

    values: tuple[Any, ...]
    mask: int | None
    means: str
    well: bool = False
    joint: str = ""
    arm: str = GOES_ON
    sensor: str = ""
    recovery: str = ""
    after: float = 0.0
    names: int | None = None
    heat: bool = False
    unsure: bool = False

    def fits(self, value: Any) -> bool:
        """Whether a value of the word says this."""
        if isinstance(value, str):
            return value in self.values
        if self.mask is None:
            return bool(value & self.values[0])
        return any(not isinstance(one, str) and value & self.mask == one for one in self.values)


@dataclass(frozen=True, slots=True, kw_only=True)
class Word:
    """A status word: of each joint or of the arm, and all its rows.

    Args:
        title: Its name in the maker's texts.
        of: ``joint`` or ``arm``.
        form: ``bits``, ``code``, ``state`` (a code in some bits beside other bits), or ``names``.
        rows: What its values mean.
        optional: A sample may leave it out.
        ignored: Bits that say nothing about faults.
    """

    title: str
    of: str
    form: str
    rows: tuple[Row, ...]
    optional: bool = False
    ignored: int = 0

    def found(self, value: Any) -> tuple[int, ...] | None:
        """The rows that a value fits, by place; None where it holds what no row defines."""
        if self.form == "names":
            places = [[i for i, row in enumerate(self.rows) if row.fits(name)] for name in value]
            return None if not all(places) else tuple(dict.fromkeys(one[0] for one in places))
        bits = tuple(i for i, row in enumerate(self.rows) if row.mask is None and row.fits(value))
        codes = tuple(i for i, row in enumerate(self.rows) if row.mask is not None and row.fits(value))
        must_fit = self.form != "bits" or any(row.well for row in self.rows)
        if (must_fit and not codes + bits) or (self.form == "state" and not codes):
            return None
        if not isinstance(value, str):
            known = self.ignored
            for row in self.rows:
                known |= row.values[0] if row.mask is None else row.mask
            if value & ~known:
                return None
        return codes[:1] + bits

    def checked(self, name: str, value: Any) -> Any:
        """One value of the word as it is compared; refuses what is no number, or no name."""
        if self.form == "names":
            if isinstance(value, str) or not isinstance(value, Sequence | set | frozenset):
                raise InputError(f"{name} is {value!r:.60}, expected the names of the errors that are set")
            return tuple(sorted(map(str, value)))
        if isinstance(value, str) and any(isinstance(one, str) for row in self.rows for one in row.values):
            return value
        try:
            whole = int(value)
        except (TypeError, ValueError, OverflowError):
            whole = None
        if whole is None or (not isinstance(value, Integral) and whole != value):
            raise InputError(
                f"{name} holds {value!r:.60}, expected whole numbers as the controller sends them"
            )
        return whole


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """What the status words of one make of controller, drive or servo mean.

    Attributes:
        name: The name by which ``ftqp.vendors.table`` finds it.
        title: The maker, or the standard.
        version: Of the texts that it was made from.
        goes_on: Whether the remaining joints can go on after a fault of one: ``yes``, ``no``, or ``held``,
            for a joint that is left at rest on purpose only.
        evidence: Why.
        sources: The texts.
        brakes: Whether each joint has a brake that closes when its drive is off.
        joints: How many joints the arm has; None is any number.
        words: The status words by name.
        recovery: Steps back to work by name.
        temperature: Where each joint's temperature and its limit are found.
        block: Address and length of one read that has status and position of a servo, and where in it.
    """

    name: str
    title: str
    version: str
    goes_on: str
    evidence: str
    sources: tuple[str, ...]
    brakes: bool
    joints: int | None
    words: Mapping[str, Word]
    recovery: Mapping[str, tuple[RecoveryStep, ...]]
    temperature: str
    block: Mapping[str, Any] | None

    def verdicts(
        self, sample: Mapping[str, Any], joints: Sequence[str], brakes: Mapping[str, bool] | None = None
    ) -> tuple[Verdict, ...]:
        """What one sample says, all that is not well; a ``Watch`` waits for the second of two.

        Args:
            sample: The words by name: of joints one number each, of the arm one number.
            joints: Names of the joints in the order of the words.
            brakes: Whether a joint has a brake that closes without power; None is as the table says.

        Raises:
            InputError: Unknown or missing words, a wrong number of joints, or what is no status word.
        """
        values = self.read(sample, len(joints))
        return tuple(
            self.verdict(name, value, place, row, joints, brakes or {})
            for name, value, place, row in self.claims(values)
        )

    def read(self, sample: Mapping[str, Any], count: int) -> tuple[Any, ...]:
        """The words of a sample in the order of the table, checked; None for one that is left out."""
        if self.joints is not None and count != self.joints:
            raise InputError(f"{count} joints are watched, expected {self.joints}, as {self.title} has")
        try:
            strange = [name for name in sample if name not in self.words]
        except TypeError:
            raise InputError(
                f"a sample is {type(sample).__name__}, expected a mapping of {', '.join(self.words)}"
            ) from None
        if strange:
            raise unknown("word", strange[0], self.title, self.words)
        return tuple(self._read(name, word, sample.get(name), count) for name, word in self.words.items())

    def _read(self, name: str, word: Word, given: Any, count: int) -> Any:
        if given is None:
            if not word.optional:
                raise InputError(f"a sample of {self.title} lacks {name}, expected {word.title}")
            return None
        if word.of == "arm":
            return word.checked(name, given)
        alone = not hasattr(given, "__len__") or getattr(given, "shape", None) == ()
        if alone or isinstance(given, str | bytes):
            raise InputError(f"{name} is {given!r:.60}, expected one number for each of {count} joints")
        if len(given) != count:
            raise InputError(f"{name} has {len(given)} numbers, expected {count}, one for each joint")
        return tuple(word.checked(name, one) for one in given)

    def claims(self, values: tuple[Any, ...]) -> Iterator[tuple[str, Any, int | None, int | None]]:
        """Word, value, joint's place and row of all that is not well; row None is undefined."""
        for (name, word), given in zip(self.words.items(), values, strict=True):
            if given is None:
                continue
            for place, value in enumerate(given) if word.of == "joint" else ((None, given),):
                rows = word.found(value)
                if rows is None:
                    yield name, value, place, None
                    continue
                for i in rows:
                    row = word.rows[i]
                    if not row.well:
                        yield name, value, place if row.names is None else value - row.names, i

    def verdict(
        self, name: str, value: Any, place: int | None, i: int | None, joints: Sequence[str],
        brakes: Mapping[str, bool],
    ) -> Verdict:  # fmt: skip
        """The verdict of a row of a word."""
        word = self.words[name]
        if place is not None and place >= len(joints):
            i, place = None, None
        joint = None if place is None else joints[place]
        if isinstance(value, tuple):
            value = ", ".join(value)
        number = value if isinstance(value, str) else f"{value} (0x{value & 0xFFFFFFFF:X})"
        said = f"{word.title}{f' of {joint}' if joint else ''} is {number}"
        if i is None:
            return Verdict(
                joint, None, PAUSED,
                f"{said}, which the table of {self.title} ({self.version}) does not define: unknown", LOOK,
            )  # fmt: skip
        row = word.rows[i]
        heat = "; see ftqp.vendors.Spare" if row.heat else ""
        return Verdict(
            joint, None if joint is None else self._fault(row, joint, brakes), row.arm,
            f"{said}: {row.means}{heat}", self.recovery.get(row.recovery, ()), row.sensor == "lost",
        )  # fmt: skip

    def _fault(self, row: Row, joint: str, brakes: Mapping[str, bool]) -> Fault | None:
        """What is reported of the joint."""
        loose = row.joint == "off" and not row.sensor and not brakes.get(joint, self.brakes)
        if loose:
            return FreeSwinging(joint)
        if row.joint in ("off", "locked"):  # where a joint goes that is not measured, nobody sees
            return Locked(joint)
        return Degraded(joint, velocity=WEAK, torque=WEAK) if row.joint == "weak" else None

    def decode(self, answer: bytes) -> dict[str, int]:
        """What one answer of a servo to a read of the whole ``block`` holds, by name.

        Position and status belong together only if they come from one answer. Empty the input before each
        question: no answer says which question it is of, and a late one would be taken for the next.

        Raises:
            InputError: A wrong length, or a table without a block.
        """
        if self.block is None:
            raise InputError(f"{self.title} is no servo on a bus, expected dynamixel or feetech")
        begin, length = self.block["address"], self.block["length"]
        if len(answer) != length:
            raise InputError(
                f"an answer has {len(answer)} bytes, expected {length}, those from address {begin} on"
            )
        return {
            name: int.from_bytes(answer[place - begin : place - begin + size], "little")
            for name, (place, size) in self.block["fields"].items()
        }


def names() -> tuple[str, ...]:
    """The names of all tables."""
    found = (entry.name for entry in files(__package__).joinpath("tables").iterdir())
    return tuple(sorted(name.removesuffix(".toml") for name in found if name.endswith(".toml")))


@cache
def table(name: str) -> Table:
    """The table of a maker.

    Args:
        name: One of ``ftqp.vendors.names()``, for example ``feetech``.

    Raises:
        InputError: There is no such table.
    """
    if name not in names():
        raise unknown("table", name, "ftqp.vendors", names())
    data = tomllib.loads(files(__package__).joinpath("tables", f"{name}.toml").read_text("utf-8"))
    words = {key: _word(word) for key, word in data.pop("words").items()}
    recovery = {
        key: tuple(RecoveryStep(*one) for one in steps) for key, steps in data.pop("recovery").items()
    }
    return Table(
        name=name, words=MappingProxyType(words), recovery=MappingProxyType(recovery),
        sources=tuple(data.pop("sources")), joints=data.pop("joints", None), block=data.pop("block", None),
        temperature=data.pop("temperature")["where"], **data,
    )  # fmt: skip


def _word(data: dict[str, Any]) -> Word:
    """A word of a table's file."""
    rows = tuple(_row(row) for row in data.pop("rows"))
    return Word(rows=rows, **data)


def _row(data: dict[str, Any]) -> Row:
    """A row of a table's file: ``bit = 1``, or ``is = 1`` or ``is = [1, 2]`` in the bits of ``mask``."""
    if "bit" in data:
        return Row(values=(data.pop("bit"),), mask=None, **data)
    values = data.pop("is")
    mask = data.pop("mask", ALL_BITS)
    return Row(values=tuple(values) if isinstance(values, list) else (values,), mask=mask, **data)
