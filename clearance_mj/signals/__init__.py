"""What a test or a simulation records, and what is made of it: excitations, responses, FRFs, modes, correlation.

One order of axes everywhere, that of python-control: outputs, then inputs, then frequency or time last. A response has
``acceleration`` (n_sensors, n_t), ``displacement`` and forces (n_bushings, n_t) over ``time`` (n_t,); an FRF has
``value`` (n_outputs, n_inputs, n_f) over ``frequency`` (n_f,). Mode shapes are columns, (n_dof, n_modes). Arrays of
these types are read-only.
"""
