"""A recording as models are compared with it: its periods, their noise, and checks at the border."""
