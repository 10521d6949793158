"""``python -m ftqp.app`` is the command ``ftqp``."""

from ftqp.app.cli import main

main()
