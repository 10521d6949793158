"""``python -m ftqp.app`` is the command ``ftqp``."""

from ftqp.app.commands.cli import main

main()
