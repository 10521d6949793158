"""Directional damping: what the task gives up near a singularity so that the joints need not race."""

from dataclasses import dataclass

from ftqp.core.setting import refuse_out_of_range, setting


@dataclass(frozen=True, slots=True, kw_only=True)
class DirectionalDamping:
    """The task gives way along singular directions only, the more the nearer the singularity is.

    With sigma the singular values of the reduced Jacobian of the healthy joints, its linear rows divided by
    the characteristic length, direction k is damped by factor^2 (1 - (sigma_k/threshold)^2)^2 where sigma_k <
    threshold. The rates that the task then asks for stay below about the wanted twist [lengths/s] over 2
    factor; the derivation is in ``docs/theory/singularities.md``.

    Attributes:
        threshold: The singular value below which damping begins, > 0, without unit; 0.2 is a dozen degrees
            from an elbow singularity. A larger one begins earlier and gives up more of the task on the way.
        factor: The damping at the singularity itself, > 0, without unit. A larger one is calmer and gives up
            more of the task; position tasks may need 0.3.
    """

    threshold: float = setting(0.2, "singular value, in lengths, where damping begins, > 0", above=0.0)
    factor: float = setting(0.2, "damping at a singularity, > 0", above=0.0)

    def __post_init__(self) -> None:
        refuse_out_of_range(self, " of the damping")
