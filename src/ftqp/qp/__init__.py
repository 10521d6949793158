"""Convex QPs: the problem, backends behind one interface, the judge of their answers. Knows no robot."""

from ftqp.qp import dtrnn
from ftqp.qp.adapters.backend import Backend, Claim
from ftqp.qp.adapters.buffers import QPBuffers
from ftqp.qp.adapters.registry import BackendInfo, backend, backend_names, backends
from ftqp.qp.judge.kkt_residuals import accepted, residuals
from ftqp.qp.judge.solving import solve
from ftqp.qp.problem import QP, Certificate, Residuals, Solution, SolveStatus
from ftqp.qp.recording.recorded_qps import Recording
from ftqp.qp.recording.recorder import Recorder

__all__ = [
    "QP",
    "Backend",
    "BackendInfo",
    "Certificate",
    "Claim",
    "QPBuffers",
    "Recorder",
    "Recording",
    "Residuals",
    "Solution",
    "SolveStatus",
    "accepted",
    "backend",
    "backend_names",
    "backends",
    "dtrnn",
    "residuals",
    "solve",
]
