"""Parts of the comparison with peers; nothing in ftqp imports them."""
