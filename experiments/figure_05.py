"""Figure 5: the structure model, with sensors and base plate, drawn from its rig file."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("figure_05")
