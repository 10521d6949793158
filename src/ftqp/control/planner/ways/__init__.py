"""Ways out: where an arm can still go when its task cannot go on."""
