"""Science and values: arrays in, arrays out. No file, clock, network, randomness or logging of its own."""
