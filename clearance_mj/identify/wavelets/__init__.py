"""Ridges of wavelet transforms: the oscillator on them, and free decays."""
