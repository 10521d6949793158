"""How well an arm does without some of its joints, posture by posture."""
