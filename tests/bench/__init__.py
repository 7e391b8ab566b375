"""Figures: how right, how fast, how live. `make bench` writes them into docs/, the machine beside them."""
