"""One monitor for arms whose servos take positions: what it learns, what is sent, and who has failed."""
