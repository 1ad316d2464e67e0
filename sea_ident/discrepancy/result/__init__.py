"""What comes of a diagnosis: its parts, and the model with what was found."""
