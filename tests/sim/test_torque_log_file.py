"""Logs with torques are read from CSV files and runs; another arm's are refused."""

from pathlib import Path

import numpy as np
import pytest

import ftqp
from ftqp.sim.torque_logs import torque_log_of_csv, write_torque_log

JOINTS = ("a", "b")


def _log() -> ftqp.TorqueLog:
    t = np.arange(0.0, 1.0, 0.01)
    q = np.stack([np.sin(t), np.cos(t)], axis=1)
    return ftqp.TorqueLog(t=t, q=q, tau=2.0 * q)


def test_what_is_written_is_read(tmp_path: Path) -> None:
    write_torque_log(tmp_path / "log.csv", JOINTS, _log())
    again = torque_log_of_csv(tmp_path / "log.csv", JOINTS, 0.002)
    np.testing.assert_allclose(again.q, _log().q, atol=1e-8)
    np.testing.assert_allclose(again.tau, _log().tau, atol=1e-8)
    assert again.late == 0.002
    with pytest.raises(ftqp.InputError, match="exists, and nothing is overwritten"):
        write_torque_log(tmp_path / "log.csv", JOINTS, _log())


def test_further_columns_and_rows_without_samples_are_left_alone(tmp_path: Path) -> None:
    rows = [f"{0.01 * k},{k},0,1,2,{'nan' if k == 5 else 3}" for k in range(20)]
    (tmp_path / "log.csv").write_text("\n".join(["t,note,q.a,q.b,tau.a,tau.b", *rows]))
    assert len(torque_log_of_csv(tmp_path / "log.csv", JOINTS, 0.0).t) == 19


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t,q.x,q.b,tau.a,tau.b\n0,0,0,0,0\n", "is of another arm: it has 'q.x', but no 'q.a'"),
        ("t,q.a,q.b,tau.a\n0,0,0,0\n", "column 'tau.b' is missing"),
        ("q.a,q.b,tau.a,tau.b\n0,0,0,0\n", "column 't' is missing"),
        ("t,q.a,q.b,tau.a,tau.b\n0,0,0,0,much\n", "expected a number"),
        ("t,q.a,q.b,tau.a,tau.b\n", "expected a header and at least one sample"),
    ],
)
def test_what_is_no_log_of_this_arm_is_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "log.csv").write_text(text)
    with pytest.raises(ftqp.InputError, match=message):
        torque_log_of_csv(tmp_path / "log.csv", JOINTS, 0.0)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ftqp.InputError, match="does not exist"):
        torque_log_of_csv(tmp_path / "none.csv", JOINTS, 0.0)
