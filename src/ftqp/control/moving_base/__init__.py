"""An arm on a base that moves."""
