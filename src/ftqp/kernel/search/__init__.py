"""One search for all ways of the joints: looks, proven edges, trees, shortening, timing."""
