"""How sure a number is: intervals over seeds, repeatability, bands of predicted FRFs."""
