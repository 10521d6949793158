import pytest

from ftqp import InputError
from ftqp.qp import backend
from ftqp.qp.adapters.registry import profile


def test_a_profile_becomes_a_backend(tmp_path):
    path = tmp_path / "tight.toml"
    path.write_text('name = "daqp"\ntolerance = 1e-10\n')
    assert profile(path) == {"name": "daqp", "tolerance": 1e-10}
    assert backend(path).name == backend(str(path)).name == "daqp"


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"tolerance = 1e-9\n", "has no name"),
        (b"name = \n", "is not valid TOML"),
        (b"name = 'daqp'\ntolerance = 0x" + b"f" * 500, "tolerance is"),
        (b"\xff\xfe\x00", "is not valid TOML"),
    ],
)
def test_a_wrong_profile_is_refused_in_one_sentence(tmp_path, content, sentence):
    path = tmp_path / "wrong.toml"
    path.write_bytes(content)
    with pytest.raises(InputError, match=sentence):
        backend(path)


def test_a_missing_profile_or_a_folder_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"nothing\.toml cannot be read \(No such file"):
        backend(str(tmp_path / "nothing.toml"))
    with pytest.raises(InputError, match="cannot be read"):
        backend(tmp_path)
