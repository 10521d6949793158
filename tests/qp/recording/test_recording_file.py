"""The file of a recording comes back as it was, or an error says in a sentence what is wrong with it."""

import json
from pathlib import Path

import numpy as np
import pytest
from recorded import small

from ftqp.core.errors import InputError
from ftqp.qp import Recording
from ftqp.qp.recording.recorded_qps import SHAPES


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "qps.npz"
    small(robot="toy", faults=[{"joint": "j1"}]).save(path)
    return path


def test_a_saved_recording_comes_back_as_it_was(file):
    first, again = small(robot="toy", faults=[{"joint": "j1"}]), Recording.load(file)
    for name in SHAPES:
        np.testing.assert_array_equal(getattr(first, name), getattr(again, name))
    assert (again.variables, again.rows) == (first.variables, first.rows)
    assert again.metadata == {"robot": "toy", "faults": [{"joint": "j1"}], "backend": "active_set"}


def test_an_existing_file_is_left_alone(file):
    before = file.read_bytes()
    with pytest.raises(InputError, match="exists, and nothing is overwritten"):
        small().save(file)
    assert file.read_bytes() == before


def test_a_write_that_fails_leaves_nothing(tmp_path, monkeypatch):
    def full(stream, **arrays):
        stream.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", full)
    with pytest.raises(InputError, match="cannot be written: No space left on device"):
        small().save(tmp_path / "qps.npz")
    assert list(tmp_path.iterdir()) == []


def rewritten(file: Path, **changes) -> Path:
    """The file with arrays replaced, or taken out where the change is None."""
    with np.load(file) as archive:
        arrays = {name: archive[name] for name in archive.files} | changes
    path = file.with_name("changed.npz")
    np.savez_compressed(path, **{name: value for name, value in arrays.items() if value is not None})
    return path


def about(**changes) -> np.ndarray:
    content = {"format": 1, "variables": ["a", "b", "c"], "rows": ["d", "e", "f"], "metadata": {}}
    return np.array(json.dumps(content | changes))


DAMAGED = {
    "missing": ({"ub": None}, "is not a recording, or is damaged"),
    "unknown": ({"uub": np.zeros(3)}, "is not a recording, or is damaged"),
    "shape": ({"H": np.eye(3)}, "is damaged .H has shape"),
    "pickle": ({"g": np.array([object()] * 5)}, "is not a recording, or is damaged"),
    "version": ({"about": about(format=2)}, "has format 2, this ftqp reads 1; record it again"),
    "no JSON": ({"about": np.array("{")}, "is not a recording, or is damaged"),
    "names": ({"about": about(rows=["d"])}, "rows has 1 different names, expected 3"),
}


@pytest.mark.parametrize(("changes", "message"), DAMAGED.values(), ids=DAMAGED)
def test_a_damaged_file_is_refused_in_one_sentence(file, changes, message):
    with pytest.raises(InputError, match=message) as caught:
        Recording.load(rewritten(file, **changes))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"hello", b"PK\x03\x04", b"\x93NUMPY\x01\x00"])
def test_another_file_is_refused(tmp_path, content):
    path = tmp_path / "other.npz"
    path.write_bytes(content)
    with pytest.raises(InputError, match="is not a recording, or is damaged"):
        Recording.load(path)


def test_a_missing_file_or_a_folder_is_refused(tmp_path):
    for path in (tmp_path, tmp_path / "none.npz"):
        with pytest.raises(InputError, match="does not exist; `ftqp run --record-qps FILE` makes one"):
            Recording.load(path)


def test_truncated_and_flipped_files_never_do_more_than_an_error(file, tmp_path):
    data, path = file.read_bytes(), tmp_path / "hurt.npz"
    rng = np.random.default_rng(0)
    refused = 0
    for k in range(60):
        hurt = bytearray(data)
        if k % 3 == 0:
            hurt = hurt[: rng.integers(len(hurt))]
        else:
            for at in rng.integers(len(hurt), size=3):
                hurt[at] ^= 1 << rng.integers(8)
        path.write_bytes(bytes(hurt))
        try:
            Recording.load(path)
        except InputError:
            refused += 1
    assert refused > 40
