"""What is no number, no pose, no archive and no installed package is refused in a sentence."""

import io
import re
import tomllib
import zipfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ftqp.core import extras
from ftqp.core.checks import array, is_number, non_negative, positive
from ftqp.core.errors import (
    FtqpError,
    InputError,
    MissingPackage,
    ModelError,
    ScenarioError,
    nearest,
    unknown,
)
from ftqp.core.extras import missing_library, remedy_for_extra
from ftqp.core.npz import npz_arrays
from ftqp.core.pose import (
    pose,
    quaternions,
    rotated,
    rotation_exp,
    rotation_vectors,
    rotation_x,
    rotation_z,
    skew,
    transform,
)


@pytest.mark.parametrize("value", [[1, 2, 3], (1.0, 2.0, 3.0), np.array([1, 2, 3], dtype=np.float32)])
def test_numbers_of_any_kind_become_contiguous_float64(value):
    result = array("v", value, (3,))
    assert result.dtype == np.float64 and result.flags["C_CONTIGUOUS"] and result.flags["WRITEABLE"]
    np.testing.assert_array_equal(result, [1.0, 2.0, 3.0])


@pytest.mark.parametrize(
    ("value", "sentence"),
    [
        (np.zeros(6), "v has shape (6,), expected (nv,) = (7,)"),
        (0.0, "v has shape (), expected (nv,) = (7,)"),
        ("fast", "v is not an array of numbers: 'fast'; expected shape (7,)"),
        ([[1.0], [1.0, 2.0]], "v is not an array of numbers: [[1.0], [1.0, 2.0]]; expected shape (7,)"),
        ([0, 0, np.nan, 0, 0, 0, 0], "v contains NaN at index 2; expected numbers"),
        ([0, 0, 0, 0, -np.inf, 0, 0], "v is infinite at index 4; expected finite numbers"),
    ],
)
def test_wrong_array_is_refused_with_one_sentence(value, sentence):
    with pytest.raises(InputError) as error:
        array("v", value, (7,), "(nv,)")
    assert str(error.value) == sentence


def test_infinity_passes_where_it_means_no_limit_but_nan_never():
    assert np.isinf(array("ub", [np.inf], (1,), finite=False)).all()
    with pytest.raises(InputError, match="NaN"):
        array("ub", [np.nan], (1,), finite=False)


@pytest.mark.parametrize("value", [0.0, -1.0, np.inf, np.nan])
def test_number_that_is_not_positive_and_finite_is_refused(value):
    with pytest.raises(InputError, match=r"dt is \S+, expected a finite number > 0 s"):
        positive("dt", value, "s")


@pytest.mark.parametrize("value", [None, "soon", "2", "1_000", b"1", [1.0, 2.0], np.ones(1), 1j, 10**400])
def test_what_is_no_number_is_refused(value):
    with pytest.raises(InputError, match=r"dt is .*, expected a number in s"):
        positive("dt", value, "s")


def test_zero_is_not_negative_but_minus_one_is():
    assert non_negative("gain", 0) == 0.0
    with pytest.raises(InputError, match=r"gain is -1, expected a finite number >= 0"):
        non_negative("gain", -1)


@pytest.mark.parametrize(
    "value",
    [True, None, "1", [1.0], np.float32(1.0), 1j, float("nan"), float("inf"), -float("inf"), 10**400, 1e301],
)
def test_what_cannot_be_computed_with_is_no_number(value):
    assert not is_number(value)


@pytest.mark.parametrize("kind", [InputError, ModelError, ScenarioError, MissingPackage])
def test_every_exception_descends_from_the_root(kind):
    assert issubclass(kind, FtqpError)


def test_missing_package_is_also_an_import_error():
    error = MissingPackage("backend 'osqp'", "osqp", "pip install osqp")
    assert isinstance(error, ImportError)
    assert (error.package, error.remedy) == ("osqp", "pip install osqp")
    assert str(error) == "backend 'osqp' needs the package 'osqp', which is not installed; pip install osqp"


def test_close_name_is_suggested_and_a_distant_one_is_not():
    assert nearest("quadrpog", ("daqp", "quadprog")) == " (did you mean 'quadprog'?)"
    assert nearest("zzzz", ("daqp", "quadprog")) == ""


def test_unknown_name_is_told_the_valid_ones_and_the_nearest():
    error = unknown("joint", "elbowe", "planar_3r", iter(["shoulder", "elbow"]))
    assert isinstance(error, InputError)
    assert (
        str(error) == "'elbowe' is not a joint of planar_3r (did you mean 'elbow'?); it has shoulder, elbow"
    )


ROOT = Path(__file__).parents[2]


def test_an_installed_package_sends_to_a_clone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(extras, "__file__", str(tmp_path / "site-packages" / "ftqp" / "core" / "extras.py"))
    assert remedy_for_extra("viz") == 'pip install ".[viz]" in a clone of its repository'


def test_every_extra_that_the_code_names_exists() -> None:
    known = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    named = {
        extra
        for file in (ROOT / "src").rglob("*.py")
        for extra in re.findall(r'remedy_for_extra\("(\w+)"\)', file.read_text(encoding="utf-8"))
    }
    assert {"viz", "sim", "ros", "distributed"} <= named
    assert named <= set(known["project"]["optional-dependencies"])


@pytest.mark.parametrize(
    ("file", "package"),
    [("libgomp.so.1", "libgomp1"), ("libstdc++.so.6", "libstdc++6"), ("libEGL_x2.so.1", "libegl_x2-1")],
)
def test_a_library_that_a_slim_system_lacks_is_named_with_its_package(file, package):
    error = ImportError(f"{file}: cannot open shared object file: No such file or directory")
    said = missing_library(error)
    assert said is not None and said.startswith(f"{file} is not on this machine")
    assert said.endswith(f"apt install {package}")


def test_a_module_that_is_missing_is_no_such_library():
    assert missing_library(ModuleNotFoundError("No module named 'pinocchio'")) is None


GOOD = np.linspace(0.0, 1.0, 5)


def npy(array, **how):
    file = io.BytesIO()
    np.save(file, array, **how)
    return file.getvalue()


class Evil:
    def __reduce__(self):
        return exec, ("raise SystemExit('code of the file ran')",)


def test_arrays_of_numpy_are_read_as_they_are(tmp_path):
    arrays = {"q": GOOD, "T": np.eye(4)[::-1], "whole": np.arange(3), "about": np.array("{}")}
    for save in (np.savez, np.savez_compressed):
        save(tmp_path / "a.npz", **arrays)
        found = npz_arrays(tmp_path / "a.npz")
        assert list(found) == list(arrays)
        for name, values in arrays.items():
            np.testing.assert_array_equal(found[name], values)


@pytest.mark.parametrize(
    "content", [npy(np.array([Evil()], dtype=object), allow_pickle=True), npy(GOOD)[:-8], b"\x93NUMPY"]
)
def test_array_that_is_damaged_or_would_run_code_is_refused(tmp_path, content):
    path = tmp_path / "arrays.npz"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("x.npy", content)
    for whole in (path.read_bytes(), content, b"", b"hello"):
        path.write_bytes(whole)
        with pytest.raises(ValueError, match="damaged"):
            npz_arrays(path)


vectors = st.lists(st.floats(-4.0, 4.0), min_size=3, max_size=3).map(np.array)


@given(vectors)
def test_derivative_of_the_exponential_at_zero_is_skew(w):
    h = 1e-6
    slope = (rotation_exp(h * w) - rotation_exp(-h * w)) / (2.0 * h)
    np.testing.assert_allclose(slope, skew(w), atol=1e-8)


@pytest.mark.parametrize("angle", [0.0, 1e-13, 1e-11, 1e-3, np.pi / 2, np.pi, 7.0])
def test_rotations_about_an_axis_have_cosine_and_sine_in_place(angle):
    c, s = np.cos(angle), np.sin(angle)
    np.testing.assert_allclose(rotation_z(angle), [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], atol=1e-15)
    np.testing.assert_allclose(rotation_x(angle), [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]], atol=1e-15)


def test_pose_of_another_library_is_taken_by_its_homogeneous_matrix():
    T = transform(rotation_x(0.3), np.array([0.1, 0.2, 0.3]))
    np.testing.assert_array_equal(pose(SimpleNamespace(homogeneous=T)), T)


@pytest.mark.parametrize("rotation", [2.0 * np.eye(3), np.diag([1.0, 1.0, -1.0]), np.zeros((3, 3))])
def test_matrix_that_is_not_a_rotation_is_refused(rotation):
    with pytest.raises(InputError, match=r"target has a rotation part that is not a rotation"):
        pose(transform(rotation, np.zeros(3)), "target")


@pytest.mark.parametrize("value", [np.eye(3), np.zeros((4, 4)) * np.nan, "here"])
def test_pose_of_a_wrong_shape_or_type_is_refused(value):
    with pytest.raises(InputError, match=r"pose (has shape|contains NaN|is not an array)"):
        pose(value)


def test_rotation_rounded_to_seven_digits_still_counts():
    assert pose(transform(np.round(rotation_x(1.0), 7), np.zeros(3))).shape == (4, 4)


def test_quaternions_and_rotation_vectors_are_those_of_scipy():
    turns = [Rotation.random(200, random_state=3).as_matrix(), np.eye(3)[None]]
    axes = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0.6, -0.8, 0], [0, -0.6, 0.8]])
    turns += [
        Rotation.from_rotvec(angle * axes).as_matrix() for angle in (1e-9, 1e-3, 3.0, np.pi - 1e-7, np.pi)
    ]
    R = np.concatenate(turns)
    expected = Rotation.from_matrix(R)
    np.testing.assert_allclose(np.abs(quaternions(R)), np.abs(expected.as_quat()), atol=1e-14)
    assert (quaternions(R)[:, 3] >= 0.0).all()
    np.testing.assert_allclose(Rotation.from_quat(quaternions(R)).as_matrix(), R, atol=1e-14)
    np.testing.assert_allclose(Rotation.from_rotvec(rotation_vectors(R)).as_matrix(), R, atol=1e-14)
    assert (np.linalg.norm(rotation_vectors(R), axis=1) <= np.pi + 1e-12).all()


def test_rotated_vectors_are_those_of_the_matrix():
    rng = np.random.default_rng(5)
    matrices = np.array([rotation_exp(w) for w in rng.uniform(-3.0, 3.0, (20, 3))])
    vectors = rng.normal(size=(20, 4, 3))
    expected = np.einsum("kij,knj->kni", matrices, vectors)
    np.testing.assert_allclose(rotated(quaternions(matrices), vectors), expected, atol=1e-14)
