"""The playground: one page with a planner in it, which runs in a browser without Python or a server."""
