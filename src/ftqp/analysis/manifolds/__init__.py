"""What an arm can do without moving its tip: self-motions, ranges of joints, what is left after a lock."""
