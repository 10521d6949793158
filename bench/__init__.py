"""Parts of the step benchmark; ``bench_step.py`` puts them together, and nothing in ftqp imports them."""
