"""State space plus delay channels: the numbers that every numeric method works on."""
