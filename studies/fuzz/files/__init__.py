"""Files that nobody would write on purpose, drawn by grammar from a random source, and what holds of them."""
