"""A vehicle whose steering shaft has clearance: paths, plants, steering, controllers and manoeuvres."""
