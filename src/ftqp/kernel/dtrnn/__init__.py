"""The discrete-time recurrent network."""
