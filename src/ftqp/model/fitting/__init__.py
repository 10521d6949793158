"""What an arm has beside its model, found from positions and torques of a motion."""
