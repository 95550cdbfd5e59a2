"""What every part uses and none of the field: errors, files, units, tasks, caches, messages, drawing."""
