"""Files in and out: universal files, datasets, results.

Import from the modules. `clearance_mj.rig` needs `files` from here, and `dataset` needs the rig, so nothing is imported
at this level.
"""
