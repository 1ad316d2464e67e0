"""Models made of effects, fitted to one recording in its noise."""
