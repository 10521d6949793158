"""The same four examples of several tasks, written for ftqp, pink and placo as their users would."""
