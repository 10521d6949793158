"""The parts of ``ftqp demo``."""
