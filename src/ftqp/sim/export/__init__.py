"""A run for the tools of ROS 2: bags of messages, written without ROS."""
