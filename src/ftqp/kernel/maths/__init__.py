"""Small linear algebra and elementary functions in compiled loops; no record."""
