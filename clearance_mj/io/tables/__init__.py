"""Tables as data loggers write them: their names and units, where their numbers begin, their times."""
