"""One monitor for arms on position drives: what is learned of each servo, what is sent, and who has failed."""
