"""Where model and data disagree, which effect is missing, and the model with it added."""
