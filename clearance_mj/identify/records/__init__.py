"""Records to identify from: whether their channels can be used, and what they leave open."""
