"""How the redundancy of an arm is spent on a known path, so that most failures of a joint are survived."""
