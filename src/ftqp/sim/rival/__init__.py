"""What a good engineer writes without ftqp, to be compared with."""
