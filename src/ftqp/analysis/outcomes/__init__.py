"""What becomes of a motion to a goal when joints lock and nobody tells the law."""
