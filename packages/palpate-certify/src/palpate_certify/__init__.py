"""Where a force loop is stable: certificates of tuned gains, their independent check, and controllers of others."""
