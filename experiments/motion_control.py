"""Motion control beyond the article: gap, misestimated gap, preview, plants, and what an identified law is worth."""

from clearance_mj.reproduce import main

if __name__ == "__main__":
    main("motion_control")
