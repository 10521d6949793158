"""Reports: what happened in runs, as one page that opens without a network."""
