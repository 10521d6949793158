"""An arm with a free-swinging joint: where it can rest, how it gets there, how it falls softly."""
