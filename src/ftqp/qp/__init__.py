"""Convex QPs: the problem, backends behind one interface, the judge of their answers. Knows no robot."""

import ftqp.qp.backends as _backends  # the package first: the function of that name replaces it below
from ftqp.qp.backend import Backend, Claim
from ftqp.qp.buffers import QPBuffers
from ftqp.qp.problem import QP, Certificate, Residuals, Solution, SolveStatus
from ftqp.qp.recorder import Recorder
from ftqp.qp.recording import Recording
from ftqp.qp.registry import BackendInfo, backend, backend_names, backends
from ftqp.qp.residuals import accepted, residuals
from ftqp.qp.solve import solve

del _backends

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
    "residuals",
    "solve",
]
