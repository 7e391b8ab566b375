"""What to compute, when, and recording that it was done."""
