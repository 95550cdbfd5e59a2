"""Contacts and backlash in MuJoCo models of others: the gallery, the measurements, an arm with a worn elbow."""
