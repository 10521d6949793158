"""Motions of an arm after one or two of its joints have failed, to the end of its path."""
