"""What a tick asks of the QP: intervals, objective, rows."""
