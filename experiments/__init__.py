"""The article computed again, real records, and other rigs: run from the source tree."""
