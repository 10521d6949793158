"""The command ``ftqp``, also as ``python -m ftqp`` where the folder of scripts is not on the path."""

from ftqp.app.output.termination import end_on_interrupt


def main() -> None:
    """The command, which Ctrl-C ends also while it is loaded."""
    end_on_interrupt()
    from ftqp.app.commands import cli  # slow to load

    cli.main()


if __name__ == "__main__":
    main()
