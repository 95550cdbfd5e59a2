"""Sensor placement: the article's eight sensors on the rig, by Fisher information."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("sensor_placement", sensors=8, count=24, modes=(1, 2, 3, 4), unwanted=(5, 6))
