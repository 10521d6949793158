"""Robots from files and tables."""
