"""``python -m ftqp`` is the command ``ftqp``, where the folder of scripts is not on the path."""

from ftqp.app.commands.cli import main

main()
