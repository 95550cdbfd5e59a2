"""F-16: `python experiments/real_f16.py FOLDER --identify 1,3,5,7 --predict 2,4,6 --out OUT`; see `real/f16.py`."""

from experiments.real.f16 import main

if __name__ == "__main__":
    raise SystemExit(main())
