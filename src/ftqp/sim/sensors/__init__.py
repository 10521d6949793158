"""What is measured of a simulated arm and its base: noise and delay between truth and planner."""
