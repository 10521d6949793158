"""A simulation that goes on for as long as somebody watches, and takes commands on its way."""
