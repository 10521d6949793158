"""What everything else stands on: errors, array checks, pose maths for set-up and reports, the clock."""
