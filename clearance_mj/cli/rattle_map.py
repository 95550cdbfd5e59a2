"""clearance-mj rattle-map: where a rig rattles and jumps, over level, frequency and gap."""

from __future__ import annotations

from ..core.errors import ClearanceError
from ..model import Model
from ..periodic import RattleMap, map_impacts, map_rattle
from ..periodic.excitation import excited_by
from ..periodic.summaries import of_impacts, of_map
from ..report import impact_maps, rattle_maps
from ..tolerance.scatter import softer_and_stiffer
from .command import RESULTS, Options, Result, command, flag, option, settings, warn_of_depths
from .options import OVER_GRID, PERIODIC, WORKERS, forced, grid, lengths, load_model, numbers, periodic_settings, plugin


@command(
    "rattle-map", *forced(), *OVER_GRID,
    option("--gaps", "of all bushings, m or such as 0.1mm,5mil; list or range", lengths, metavar="M,..."),
    option("--loads", "what constant loads are multiplied by: a list or range; maps which walls are hit, over loads "
           "and levels at --from with --steps 1, else over levels and frequencies at each", numbers, metavar="X,..."),
    flag("--contact-spread", "map contacts a standard deviation softer and stiffer too, as the rig file's tolerance of "
         "them says"),
    WORKERS, plugin("a contact or a grease"), writes=RESULTS,
)  # fmt: skip
def run(options: Options) -> Result:
    """Map where a rig rattles and jumps, over level and frequency, for several gaps."""
    model = load_model(options)
    used = settings(model) | {name: getattr(options, name) for name in PERIODIC}
    shared = {name: getattr(options, name) for name in ("kind", "workers")} | periodic_settings(options)
    shared["progress"] = not options.quiet
    levels, frequencies = grid(options, excited_by(model, options.kind), 1 if options.loads else 2)
    if options.loads:
        if options.gaps or options.contact_spread:
            raise ClearanceError("--loads maps the rig's gaps and contacts: leave out --gaps and --contact-spread")
        hit = map_impacts(model, levels, frequencies, options.loads, **shared)
        drawings = [impact_maps.draw(hit)]
        return Result(used | of_impacts(hit), impact_maps.summary_lines(hit), impact_maps.rows(hit), drawings)

    def mapped(model: Model) -> RattleMap:
        return map_rattle(model, levels, frequencies, gaps=options.gaps, **shared)

    rattle, said = mapped(model), rattle_maps.summary_lines
    ends = softer_and_stiffer(model) if options.contact_spread else ()
    spread = {name: mapped(each) for name, each in zip(("softer", "stiffer"), ends)}
    data = used | of_map(rattle) | {name: of_map(each) for name, each in spread.items()}
    for gaps, depth in zip(rattle.gap, data["largest_depth"]):
        warn_of_depths(model.with_gap(gaps.tolist()), depth)
    words = ["\n  ".join(said(rattle))]
    words += [f"contacts a standard deviation {name}: " + "\n  ".join(said(each)) for name, each in spread.items()]
    return Result(data, words, rattle_maps.rows(rattle), [rattle_maps.draw(rattle)])
