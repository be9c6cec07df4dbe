"""A seeded fuzz of every input: `python -m tests.fuzz --cases 3000 --seed 1` (`make fuzz`)."""
