"""Front ends: how position and force reach the regression through the same filter."""
