"""What changes from period to period, which the mean does not show."""
