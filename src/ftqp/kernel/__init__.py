"""Every formula of a control tick, once: compiled loops over one record, no objects, no files."""
