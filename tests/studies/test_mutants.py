"""The mutation run: how a mutant takes its module's place, and what is said of a sample."""

import dataclasses
import sys
from importlib import util

import mutants
import pytest
from mutating import mutation

SOURCE = '''"""A module."""

from dataclasses import dataclass, field

MOST = 2.0
NEVER = MOST


def limited(x, share=1.0):
    """x, at most a share of MOST."""
    return min(x, share * MOST)


class Brake:
    """One that holds."""

    number = 1

    def holds(self, x):
        return x <= MOST

    @property
    def most(self):
        return MOST


@dataclass(frozen=True, slots=True)
class Fault:
    """One that cannot be changed."""

    share: float = field(default=1.0, metadata={"most": 1.0})
'''


@pytest.fixture
def module(tmp_path, monkeypatch):
    """A module of its own, and another one that has taken names from it."""
    file = tmp_path / "brakes.py"
    file.write_text(SOURCE, encoding="utf-8")
    loaded = []
    for name, text in (
        ("ftqp.brakes", SOURCE),
        ("ftqp.car", "from ftqp.brakes import MOST, Brake, Fault, limited"),
    ):
        spec = util.spec_from_loader(name, loader=None)
        made = util.module_from_spec(spec)
        made.__file__ = str(file)
        monkeypatch.setitem(sys.modules, name, made)
        exec(compile(text, str(file), "exec"), vars(made))
        loaded.append(made)
    return loaded


def mutant(old, new):
    assert SOURCE.count(old) == 1
    return mutation.Mutant(
        module="ftqp.brakes", operator="", line=1, before=old, after=new, source=SOURCE.replace(old, new)
    )


def test_a_mutant_takes_the_place_of_functions_wherever_they_went(module):
    _, car = module
    before = car.limited
    mutation.planted(mutant("min(x, share * MOST)", "max(x, share * MOST)"))
    assert car.limited is before and car.limited(5.0) == 5.0 and car.limited(1.0) == 2.0
    mutation.planted(mutant("share=1.0", "share=3.0"))
    assert car.limited(5.0) == 5.0 and car.limited(9.0) == 6.0


def test_a_mutant_takes_the_place_of_methods_and_constants(module):
    brakes, car = module
    brake = car.Brake()
    mutation.planted(mutant("x <= MOST", "x < MOST"))
    assert not brake.holds(2.0)
    mutation.planted(mutant("number = 1", "number = 2"))
    assert brake.number == 2
    mutation.planted(mutant("MOST = 2.0", "MOST = 3.0"))
    assert car.MOST == 3.0 == brakes.NEVER and brake.holds(3.0) and brake.most == 3.0


@pytest.mark.parametrize(
    ("old", "new"),
    [("frozen=True, ", ""), ('{"most": 1.0}', '{"most": 2.0}'), ("default=1.0", "default=0.5")],
)
def test_a_mutant_takes_the_place_of_data_that_cannot_be_changed(module, old, new):
    _, car = module
    mutation.planted(mutant(old, new))
    fault = car.Fault()
    if old.startswith("frozen"):
        fault.share = 0.25
        assert fault.share == 0.25
    else:
        with pytest.raises(dataclasses.FrozenInstanceError):
            fault.share = 0.25
        assert fault.share == (0.5 if "default" in new else 1.0)
    assert dataclasses.fields(car.Fault)[0].metadata["most"] == (2.0 if "most" in new else 1.0)


def test_the_interval_of_a_share_is_that_of_wilson():
    assert mutants.wilson(5, 10) == pytest.approx((23.66, 76.34), abs=0.01)
    assert mutants.wilson(10, 10) == pytest.approx((72.25, 100.0), abs=0.01)


def test_the_score_of_all_weighs_a_module_by_its_mutants_and_is_sure_where_all_were_tried():
    rows = [{"of": 300, "tried": 10, "found": 10}, {"of": 100, "tried": 10, "found": 5}]
    score, low, high = mutants.whole(rows)
    assert score == pytest.approx(87.5) and low < 87.5 < high <= 100.0
    sure = mutants.whole([{"of": 20, "tried": 20, "found": 15}])
    assert sure == pytest.approx((75.0, 75.0, 75.0))


def test_groups_name_modules_and_tests_that_are_there():
    for modules, tests in mutants.GROUPS.values():
        for module in modules:
            assert (mutants.ROOT / "src" / f"{module.replace('.', '/')}.py").is_file(), module
        for test in tests:
            assert (mutants.ROOT / test).exists(), test
