"""What is remembered from tick to tick of how an arm stands: its stop, and its coming to rest."""
