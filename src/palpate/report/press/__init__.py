"""A press of a simulated arm: its page, with a film."""
