"""The recurrent network inside the kernel, for QPs that are not a planner's, and its settings."""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from ftqp.core.checks import FloatArray
from ftqp.core.errors import InputError
from ftqp.kernel.entry.workspace import NO_TRACE, solve_networks
from ftqp.kernel.layout.flat_arrays import memory_size
from ftqp.qp.adapters.backend import Backend, Claim, QPBuffers

Method = Literal["implicit", "94lvi", "e47"]
Mode = Literal["product", "paper"]
METHODS: tuple[str, ...] = get_args(Method)
MODES: tuple[str, ...] = get_args(Mode)
_CODES = {"94lvi": 0, "e47": 1, "implicit": 2}
PRODUCT_TOLERANCE, PAPER_TOLERANCE = 1e-9, 1e-5
PRODUCT_CAP, PAPER_CAP = 2000, 20_000
GAMMA, GAMMA_SCALED = 1.0, 1.6
CAP = 4
"""Position of the iteration cap among the numbers that the kernel takes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DtrnnSettings:
    """How the network iterates and when it stops; None is what suits method and mode.

    The iterations and the stopping rules are derived in ``docs/theory/recurrent-network.md``.

    Attributes:
        method: The iteration: ``implicit`` factorises once a QP and does not slow down with the size of the
            numbers; ``94lvi`` and ``e47`` are the published explicit ones.
        mode: ``product`` ends a solve when the task residual is below 1e-8 and either |e| is below
            ``tolerance`` or the duality gap is negligible; ``paper`` ends it as soon as |e| is below
            ``tolerance``, which bounds the task residual and not the error of x.
        tolerance: Largest |e| that ends a solve, > 0, in the network's own scaled units; smaller is more
            accurate and takes more iterations. None is 1e-9, in paper mode 1e-5.
        max_iterations: Most iterations of one solve, a cold repeat included, >= 1; a smaller cap bounds the
            time and gives up more often. None is 2000, in paper mode 20000.
        gamma: Step size in (0, 2), without unit; larger steps are fewer while they help, and towards 2 the
            iteration stops converging. None is 1.6 for ``implicit`` with scaling, else 1.
        scaling: Whether objective and rows are scaled, which ``implicit`` needs for ill-conditioned Hessians
            and which harms ``94lvi`` and ``e47``. None is yes for ``implicit`` in product mode.
        newton: Whether Newton jumps are tried, which end most solves after one iteration. None is yes in
            product mode.
    """

    method: Method = "implicit"
    mode: Mode = "product"
    tolerance: float | None = None
    max_iterations: int | None = None
    gamma: float | None = None
    scaling: bool | None = None
    newton: bool | None = None

    def __post_init__(self) -> None:
        """Check what no single field can."""
        if self.gamma is not None and not self.gamma < 2.0:
            raise InputError(
                f"dtrnn.gamma is {self.gamma!r}, expected a number below 2; the step would diverge"
            )

    @property
    def paper(self) -> bool:
        """Whether |e| alone is the stopping rule."""
        return self.mode == "paper"

    @property
    def scaled(self) -> bool:
        """Whether objective and rows are scaled."""
        return self.scaling if self.scaling is not None else self.method == "implicit" and not self.paper

    @property
    def jumps(self) -> bool:
        """Whether Newton jumps are tried."""
        return self.newton if self.newton is not None else not self.paper

    @property
    def cap(self) -> int:
        """Most iterations."""
        return self.max_iterations or (PAPER_CAP if self.paper else PRODUCT_CAP)

    @property
    def step_size(self) -> float:
        """gamma."""
        return self.gamma or (GAMMA_SCALED if self.method == "implicit" and self.scaled else GAMMA)

    @property
    def accuracy(self) -> float:
        """Tolerance of |e|."""
        return self.tolerance or (PAPER_TOLERANCE if self.paper else PRODUCT_TOLERANCE)

    def numbers(self) -> FloatArray:
        """The options as the kernel takes them, (7,)."""
        chosen = (self.scaled, self.jumps, self.paper, self.cap, self.step_size, self.accuracy)
        return np.array([_CODES[self.method], *chosen], dtype=np.float64)


class Dtrnn(Backend):
    """The kernel's network on memory of its own; a warm solve starts from what the buffers hold as solution.

    A warm solve and its cold repeat together take at most ``settings.cap`` iterations.

    Attributes:
        numbers: The options, as the kernel takes them.
        residual: |e| at the end of the last solve.
        trace: |e|, r_eq, gap and whether a jump succeeded, one row an iteration as far as there are rows,
            (k, 4). The start of a cold repeat takes the row of the last iterate before it.
    """

    package = "ftqp"
    settings_type = DtrnnSettings

    def __init__(self, name: str, settings: DtrnnSettings) -> None:
        super().__init__(name, settings)
        self.numbers = settings.numbers()
        self.residual, self.trace = 0.0, NO_TRACE

    def start(self) -> None:
        """The buffers hold a start as their solution: the next solve may be warm."""
        self._stale = False

    def _prepare(self, qp: QPBuffers) -> None:
        self._memory = np.zeros(memory_size(qp.n, qp.m, qp.p))

    def _run(self, qp: QPBuffers, cold: bool) -> Claim:
        left = self.settings.cap - self._spent
        if left <= 0:
            self.iterations = 0
            return Claim.MAX_ITERATIONS
        self.numbers[CAP] = left
        ((claim, iterations, self.residual),) = solve_networks(
            qp.flat[None], qp.solution[None], (qp.n, qp.m, qp.p), self.numbers, self._memory,
            self.trace[self._spent :], not cold,
        ).tolist()  # fmt: skip
        self.iterations = int(iterations)
        return Claim(int(claim))
