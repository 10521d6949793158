"""What an answer is worth, and what comes next when it is bad."""
