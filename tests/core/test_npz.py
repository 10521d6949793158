"""Files of arrays are measured before they are read, and nothing in them is run."""

import io
import struct
import zipfile

import numpy as np
import pytest

from ftqp.core.npz import npz_arrays

GOOD = np.linspace(0.0, 1.0, 5)


def npy(array, **how):
    file = io.BytesIO()
    np.save(file, array, **how)
    return file.getvalue()


def headed(text, data=b"", version=(1, 0)):
    """An array file with this text for a head."""
    head = text.encode() + b"\n"
    return b"\x93NUMPY" + bytes(version) + struct.pack("<H", len(head)) + head + data


def head(shape, kind="<f8"):
    return repr({"descr": kind, "fortran_order": False, "shape": shape})


def archive(folder, content, method=zipfile.ZIP_DEFLATED):
    path = folder / "arrays.npz"
    with zipfile.ZipFile(path, "w", method) as file:
        file.writestr("good.npy", npy(GOOD))
        file.writestr("x.npy", content)
    return path


class Evil:
    def __reduce__(self):
        return exec, ("raise SystemExit('code of the file ran')",)


def test_arrays_of_numpy_are_read_as_they_are(tmp_path):
    arrays = {"q": GOOD, "T": np.eye(4)[::-1], "whole": np.arange(3), "about": np.array("{}")}
    for save in (np.savez, np.savez_compressed):
        save(tmp_path / "a.npz", **arrays)
        found = npz_arrays(tmp_path / "a.npz", 1e6)
        assert list(found) == list(arrays)
        for name, array in arrays.items():
            np.testing.assert_array_equal(found[name], array)


@pytest.mark.parametrize(
    "content",
    [
        npy(np.array([Evil()], dtype=object), allow_pickle=True),
        headed(head((2**40,)), GOOD.tobytes()),
        headed(head((10**9,)), GOOD.tobytes()),
        headed(head((2**62, 2**62)), GOOD.tobytes()),
        headed(head((-1,)), GOOD.tobytes()),
        headed(head((True,)), GOOD[:1].tobytes()),
        headed(head((5.0,)), GOOD.tobytes()),
        headed(head("(5,)"), GOOD.tobytes()),
        headed(head((5,), "|O"), GOOD.tobytes()),
        headed(head((5,), "(1000000,)f8"), GOOD.tobytes()),
        headed(head((1,), "<U500000000"), GOOD.tobytes()),
        headed("__import__('os').abort()"),
        headed("(" * 3000 + ")" * 3000),
        headed(head((5,)), GOOD.tobytes(), version=(9, 0)),
        npy(GOOD)[:-8],
        npy(GOOD) + b"more",
        b"\x93NUMPY",
        b"",
        b"hello",
    ],
    ids=range(19),
)
def test_array_that_is_not_what_it_says_is_refused(tmp_path, content):
    with pytest.raises(ValueError) as caught:
        npz_arrays(archive(tmp_path, content), 1e6)
    assert str(caught.value)


def test_small_file_that_unpacks_to_much_is_not_unpacked(tmp_path):
    path = archive(tmp_path, npy(np.zeros(3_000_000)))
    assert path.stat().st_size < 100_000
    with pytest.raises(ValueError, match=r"holds 2.4e\+07 bytes, expected at most 1e\+06"):
        npz_arrays(path, 1e6)
