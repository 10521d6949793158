"""Where an arm comes to rest that does not know of its failure, and whether it stays there."""
