"""Contact logs whose least-squares parameters are certified to 11 digits, and the check of a solver against them."""
