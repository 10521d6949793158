"""What the record holds: its enumerations, its rooms, and what each QP row stands for."""
