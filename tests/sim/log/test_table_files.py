"""A log as CSV, NPZ and MAT, read back by readers that know nothing of ftqp."""

import csv
import json
import os

import numpy as np
import pytest
from scipy.io import loadmat

from ftqp.core.errors import InputError
from ftqp.sim.log import table_files
from ftqp.sim.log.log_file import load_log, open_log
from ftqp.sim.log.log_writer import LogWriter
from ftqp.sim.log.raw_rows import BLOCK
from ftqp.sim.log.signals import Column

NAMES = ("<script>alert(1)</script>", "a\"b'c, d", "Gelenk ä 手", "=1+2")
COLUMNS = [
    Column("t", "s", "time"),
    *(Column(f"q.{name}", "rad", "position") for name in NAMES),
    *(Column(f"belief.{name}", "-", "code", True) for name in NAMES),
    Column("kappa", "-", "damping"),
    Column("status", "-", "code", True),
]
WRITERS = {"csv": "to_csv", "npz": "to_npz", "mat": "to_mat"}


def table(count):
    """Numbers of all sizes, NaN and infinity among them."""
    rng = np.random.default_rng(7)
    numbers = rng.normal(size=(count, len(COLUMNS))) * 10.0 ** rng.integers(-300, 300, (count, len(COLUMNS)))
    for k, column in enumerate(COLUMNS):
        if column.integer:
            numbers[:, k] = rng.integers(0, 8, count)
    numbers[::3, -2], numbers[1::7, 2], numbers[2, 3] = np.nan, np.inf, -0.0
    return numbers


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A log that was cut short, of more than a block."""
    folder = tmp_path_factory.mktemp("run")
    numbers = table(BLOCK + 9)
    with LogWriter(folder / "log.npy", COLUMNS, {"state": "running", "robot": "</script>"}) as log:
        log.write(0, numbers[:BLOCK])
        log.write(BLOCK, numbers[BLOCK:])
    return folder, numbers


def bits(values):
    return np.ascontiguousarray(values, dtype=np.float64).view(np.uint64)


def test_csv_has_every_digit(run, tmp_path):
    load_log(run[0]).to_csv(tmp_path / "l.csv")
    with (tmp_path / "l.csv").open(newline="", encoding="utf-8") as file:
        head, *lines = csv.reader(file)
    assert head == [column.name for column in COLUMNS]
    found = np.array([[float(word) for word in line] for line in lines])
    np.testing.assert_array_equal(bits(found), bits(run[1]))
    assert lines[0][-1] == str(int(run[1][0, -1]))


def test_npz_is_equal_bit_by_bit(run, tmp_path):
    load_log(run[0]).to_npz(tmp_path / "l.npz")
    with np.load(tmp_path / "l.npz", allow_pickle=False) as found:
        assert sorted(found.files) == ["about", "belief", "kappa", "q", "status", "t"]
        assert found["t"].shape == (BLOCK + 9,) and found["q"].shape == (BLOCK + 9, 4)
        np.testing.assert_array_equal(bits(found["q"]), bits(run[1][:, 1:5]))
        np.testing.assert_array_equal(bits(found["kappa"]), bits(run[1][:, 9]))
        np.testing.assert_array_equal(found["belief"], run[1][:, 5:9])
        assert found["belief"].dtype == np.int64
        about = json.loads(str(found["about"]))
    assert [signal["name"] for signal in about["signals"]["q"]] == [f"q.{name}" for name in NAMES]
    assert about["signals"]["q"][0]["unit"] == "rad"
    assert about["metadata"]["robot"] == "</script>" and about["metadata"]["state"] == "running"


def test_mat_is_equal_bit_by_bit(run, tmp_path):
    load_log(run[0]).to_mat(tmp_path / "l.mat")
    found = loadmat(tmp_path / "l.mat", simplify_cells=True)
    np.testing.assert_array_equal(bits(found["q"]), bits(run[1][:, 1:5]))
    np.testing.assert_array_equal(bits(found["kappa"]), bits(run[1][:, 9]))
    np.testing.assert_array_equal(found["belief"], run[1][:, 5:9])
    assert found["belief"].dtype == np.int64
    assert list(found["signals"]["q"]) == [f"q.{name}" for name in NAMES]
    assert json.loads(found["metadata"])["robot"] == "</script>"


@pytest.mark.parametrize("kind", WRITERS)
def test_nothing_is_overwritten(run, tmp_path, kind):
    log, file = load_log(run[0]), tmp_path / f"l.{kind}"
    for make in (file.touch, file.mkdir, lambda: file.symlink_to(tmp_path / "nowhere")):
        make()
        with pytest.raises(InputError, match=r"exists, and nothing is overwritten"):
            getattr(log, WRITERS[kind])(file)
        file.rmdir() if file.is_dir() else file.unlink()
    with pytest.raises(InputError, match="cannot be written"):
        getattr(log, WRITERS[kind])(tmp_path / "none" / f"l.{kind}")
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("kind", WRITERS)
def test_ctrl_c_leaves_nothing(run, tmp_path, kind):
    def stop(share):
        raise KeyboardInterrupt

    rows = open_log(run[0])
    with pytest.raises(KeyboardInterrupt):
        getattr(table_files, f"write_{kind}")(rows, tmp_path / f"l.{kind}", stop)
    assert os.listdir(tmp_path) == []
