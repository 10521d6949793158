"""For all tests: how long a case takes decides nothing, as machines differ and compile."""

from hypothesis import settings

settings.register_profile("ftqp", deadline=None)
settings.load_profile("ftqp")
