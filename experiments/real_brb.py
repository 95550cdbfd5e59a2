"""Brake-Reuss beam: `python experiments/real_brb.py FOLDER --out OUT`; see `experiments.real.brb`."""

from experiments.real.brb import main

if __name__ == "__main__":
    raise SystemExit(main())
