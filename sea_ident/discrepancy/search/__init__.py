"""Which effects the mean of the periods lacks."""
