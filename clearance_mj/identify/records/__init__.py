"""Records to identify from: checks of their channels, and warnings of what they do not identify."""
