"""What the library has no name for, and what was found under a name that is not its own."""
