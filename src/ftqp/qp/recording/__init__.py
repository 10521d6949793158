"""QPs kept while a planner runs, and their file."""
