from pathlib import Path

import pytest

from clearance_mj.errors import ClearanceError
from experiments.article import ITEMS
from experiments.article.registry import get_item, select

ROOT = Path(__file__).parents[2]


def test_the_articles_sections_2_to_4_2_are_complete():
    figures = {f"figure_{number:02d}" for number in range(1, 11)}
    assert figures | {"table_1", "table_2"} <= set(ITEMS)


@pytest.mark.parametrize("name", ITEMS)
def test_every_item_has_code_script_and_page(name):
    assert callable(get_item(name))
    assert f'main("{name}"' in (ROOT / "experiments" / f"{name}.py").read_text(encoding="utf-8")
    assert (ROOT / "docs" / "experiments" / f"{name}.md").read_text(encoding="utf-8").startswith("# ")


def test_selection_keeps_the_order_and_drops_repeats():
    assert select(["table_1", "figure_02", "table_1"]) == ["figure_02", "table_1"]
    assert select([]) == select(["all"]) == select(["figure_02", "all"]) == list(ITEMS)


def test_an_unknown_name_lists_the_known_ones():
    with pytest.raises(ClearanceError, match=r'"figure_99" is unknown; known: all, figure_01, .*table_2'):
        select(["figure_02", "figure_99"])
