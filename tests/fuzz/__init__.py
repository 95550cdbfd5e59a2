"""Damaged and invented files against every reader: ``make fuzz``.

`samples` are whole files, `mutations` damage them, `readers` says what reads them, `run` counts what comes of it.
"""
