"""The gap in forward simulation, before and after."""
