"""The table ``[log]``: how the log of a long run is cut into files."""

from pydantic import Field, model_validator

from ftqp.app.schema.strict import Finite, Table, unit


class LogTable(Table):
    """How the log of a long run is cut into files."""

    part: Finite | None = Field(
        None,
        gt=0,
        description="simulated time after which a new file begins, > 0; the log is one file if absent",
        json_schema_extra=unit("s"),
    )
    keep: int | None = Field(
        None,
        ge=1,
        description="how many parts are kept, the newest included, >= 1; older ones are deleted, none if "
        "absent",
    )

    @model_validator(mode="after")
    def _keep_parts(self) -> "LogTable":
        if self.keep is not None and self.part is None:
            raise ValueError("keeps parts of a log, but part, their length, is not given")
        return self
