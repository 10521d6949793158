"""The answer to a failure that is not survived: until when the path is followed, and what is left then."""

from ftqp.core.checks import FloatArray
from ftqp.core.errors import FtqpError
from ftqp.kernel.layout.survival import Survival


class NotSurvived(FtqpError):
    """A joint fails at an instant behind which the path cannot be finished.

    Attributes:
        joint: Name of the joint, or of both with a plus sign.
        time: When it fails [s].
        until: Until when the path can be followed [s].
        reason: How the continuation ends.
        q: Configurations of the samples from the failure until then, (K, nv) [rad or m].
        errors: The largest errors of position and rotation of the best effort to the end of the path [m,
            rad]; None where it was not looked for.
    """

    def __init__(
        self,
        *,
        joint: str,
        time: float,
        until: float,
        reason: Survival,
        q: FloatArray,
        errors: tuple[float, float] | None = None,
    ) -> None:
        self.joint, self.time, self.until, self.reason, self.q = joint, time, until, reason, q
        self.errors = errors
        best = "" if errors is None else "; the best effort to its end is off by {:.3g} m and {:.3g} rad"
        super().__init__(
            f"the path cannot be finished when {joint!r} locks at t = {time:g} s ({reason.name}); it can be "
            f"followed until t = {until:g} s" + best.format(*(errors or ()))
        )
