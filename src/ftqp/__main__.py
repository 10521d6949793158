"""The command ``ftqp``, also as ``python -m ftqp`` where the folder of scripts is not on the path."""


def main() -> None:
    """The command."""
    from ftqp.app.commands import cli  # slow to load

    cli.main()


if __name__ == "__main__":
    main()
