"""A simulation that goes on for as long as somebody watches, and takes orders on its way."""
