"""The commands that palpate lists when this distribution is installed."""
