"""What stands around an arm, and how far it keeps from it."""
