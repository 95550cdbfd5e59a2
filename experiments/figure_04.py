"""Figure 4: damping identified at single scales, in three sequences, and what each scale costs."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("figure_04", snrs=(100, 40, 20), seeds=20)
