"""From a scenario file to the objects of a run."""
