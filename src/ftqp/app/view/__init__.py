"""What `ftqp view` shows: running scenarios, finished runs, coverage reports."""
