"""Parts common to a study's figures: the cases drawn, their line styles, and the words for them."""

from __future__ import annotations

from typing import Any

from matplotlib.lines import Line2D

from ...study import Study, StudyCase
from ..style import COLOURS, ENGINE_LINES, MARKERS, REPEAT, TEST

__all__ = ["Looks"]


class Looks:
    """Looks of the laws and engines of a study."""

    def __init__(self, study: Study):
        self.study, self.rig = study, study.dataset.rig
        self.test = "synthetic test" if study.is_synthetic else "test"
        self.laws = ", ".join(study.methods)
        self.level_label = f"Level ({study.unit} RMS)"
        self.magnitude = "dB re 1 m/s²/N" if study.unit == "N" else "dB re 1"
        # The best law on the other engines first, so that the main one is on top.
        others = [(study.best_law, engine) for engine in reversed(study.engines) if engine != study.main_engine]
        self.drawn = [*others, *((law, study.main_engine) for law in study.methods)]

    def colour(self, law: str) -> str:
        """Return the colour of a law."""
        return COLOURS[self.study.methods.index(law) % len(COLOURS)]

    def line(self, law: str, engine: str, marker: bool = False) -> dict[str, Any]:
        """Return the keywords of a line."""
        i = self.study.engines.index(engine)
        look = {"linestyle": ENGINE_LINES[i % len(ENGINE_LINES)], "linewidth": 1.0 if i == 0 else 0.8}
        look |= {"marker": MARKERS[i % 3], "markersize": 3} if marker else {}
        label = f"law “{law}”" + ("" if engine == self.study.main_engine else f", engine {engine}")
        return look | {"color": self.colour(law), "label": label}

    def cases(self, level: float) -> list[StudyCase]:
        """Return the first case of each curve that is drawn."""
        return [self.study.case(law, engine, level) for law, engine in self.drawn]

    def key(self, test: str = "", repeat: str = "", engines: bool = True, markers: bool = False) -> list[Line2D]:
        """Legend: the test, the repeat, a line per law, a grey line per engine."""
        handles = [Line2D([], [], color=TEST, linewidth=2.4, label=test)] if test else []
        handles += [Line2D([], [], color=REPEAT, linewidth=1.5, label=repeat)] if repeat else []
        handles += [Line2D([], [], color=self.colour(law), label=f"law “{law}”") for law in self.study.methods]
        for engine in self.study.engines if engines else ():
            look = self.line(self.study.methods[0], engine, markers) | {"color": "#555555", "label": f"engine {engine}"}
            look |= {"markersize": 3.5} if markers else {}
            handles.append(Line2D([], [], **look))
        return handles

    def repeat_key(self, level: float, engines: bool = True) -> list[Line2D]:
        """Legend with the repeatability, where the level has a second record."""
        return self.key(repeat="repeatability" if level in self.study.repeatability else "", engines=engines)

    def level_words(self, level: float) -> str:
        """Return a level in words."""
        along = f" {self.study.condition.words}" if self.study.condition else ""
        return f"{level:g} {self.study.unit} RMS{along}, {self.test}"

    def name(self, kind: str, level: float) -> str:
        """Return the name of a figure of a level."""
        return f"{kind}_level_{level:g}{self.study.suffix}"

    def words(self, level: float) -> str:
        """Return what is drawn of a level, in words."""
        return f"Level {self.level_words(level)} record {self.study.records(level)[0].name}.{self.engine_words}"

    @property
    def engine_words(self) -> str:
        """Names of the engines that are drawn, in words."""
        if len(self.study.engines) == 1:
            return ""
        main, best = self.study.main_engine, self.study.best_law
        return f" Laws on engine {main}; on the others “{best}” only: where one line style shows, the engines coincide."
