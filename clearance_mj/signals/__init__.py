"""What a test or a simulation records, and what is made of it: excitations, responses, FRFs, modes, correlation."""
