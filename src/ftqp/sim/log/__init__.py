"""The log of a run, what its columns mean, and figures of merit from it."""
