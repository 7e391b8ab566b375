"""Which correction methods there are beside the core's own, without what they need to run: see `papernets`."""

from __future__ import annotations

PAPER_METHODS = ("paper-a", "paper-b", "paper-c", "paper-ours", "paper-corrections")
LEARNED_METHOD = "lattice-network"  # `lattice`, with the network that finds rods
