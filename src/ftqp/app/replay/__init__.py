"""Recorded QPs, solved again."""
