"""Damping: what the task may give up near a singularity so that the joints need not race."""

from dataclasses import dataclass

from ftqp.core.checks import positive


@dataclass(frozen=True, slots=True, kw_only=True)
class DirectionalDamping:
    """Directional damping: the task gives way along singular directions only, the nearer the more.

    With sigma the singular values of the reduced Jacobian of the healthy joints, its rows in characteristic
    lengths, direction k is damped by factor^2 (1 - (sigma_k/threshold)^2)^2 where sigma_k < threshold. The
    rates that the task then asks for stay below about the wanted twist [lengths/s] over 2 factor.

    Attributes:
        threshold: singular value below which damping begins; 0.2 is a dozen degrees from an elbow
            singularity.
        factor: damping at the singularity itself; larger is calmer and gives up more of the task.

    Source: ``ftqp.kernel.rows.turned_rows.turn_rows``.
    """

    threshold: float = 0.2
    factor: float = 0.2

    def __post_init__(self) -> None:
        positive("threshold of the damping", self.threshold)
        positive("factor of the damping", self.factor)
