"""What was found beside other data and another model: motion that was not used, and an earlier model."""
