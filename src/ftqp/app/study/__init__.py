"""Long studies: many independent items, computed in chunks by processes or a cluster, kept in one file."""
