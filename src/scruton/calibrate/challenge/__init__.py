"""The blind challenge: campaigns with a hidden effect, from the full equation of motion."""
