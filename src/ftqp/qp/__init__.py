"""Convex QPs: the problem, backends behind one interface, checks of their answers. Knows no robot."""

from ftqp.qp import dtrnn
from ftqp.qp.adapters.backend import Backend, Claim, QPBuffers
from ftqp.qp.adapters.registry import BackendInfo, backend, backend_names, backends
from ftqp.qp.problem import QP, Certificate, Residuals, Solution, SolveStatus
from ftqp.qp.recording.recorded_qps import Recorder, Recording
from ftqp.qp.solving import accepted, residuals, solve

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
