"""What is believed of measurements, and what is sent: the loop between the reference and the arm."""
