"""A run into a folder."""
