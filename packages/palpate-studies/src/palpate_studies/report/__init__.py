"""How a study's figures and its page are drawn."""
