"""One monitor for every drive: what it learns of each joint, what is sent to servos, and who has failed."""
