"""The figures of docs/benchmarks.md."""

from matplotlib.figure import Figure

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
MARKERS = "os^Dv<>"
STYLE = {"linewidth": 1.2, "markersize": 4}


def alternatives(result):
    """Error of the FRFs against time per simulated second, a line for each method from coarse to fine."""
    figure = Figure(figsize=(7.5, 4.6), layout="constrained")
    axes = figure.add_subplot()
    methods = dict.fromkeys(row["method"] for row in result["rows"])
    for method, colour, marker in zip(methods, COLOURS, MARKERS):
        rows = [row for row in result["rows"] if row["method"] == method]
        cost, error = [row["cost"] for row in rows], [row["error"] for row in rows]
        axes.loglog(cost, error, color=colour, marker=marker, label=method, **STYLE)
    axes.axhline(0.5, color="#8c8c8c", linewidth=0.8)
    axes.axvline(result["raw_loop"]["cost"], color="#8c8c8c", linewidth=0.8, linestyle="--")
    loop = f"mj_step alone,\n{result['raw_loop']['setting']}"
    axes.text(result["raw_loop"]["cost"] * 1.05, 4.0, loop, fontsize=7, va="top")
    _label(axes, "time per simulated second (s)", "RMSE of the FRFs, 5-220 Hz (dB)")
    figure.legend(fontsize=8, ncols=7, loc="outside upper center", handlelength=1.2, columnspacing=1.2)
    return figure


def scaling(result):
    """Time against links, modes, bushings, batch size, duration and threads; the legends have the exponents."""
    panels = (("links", "links"), ("modes", "modes"), ("bushings", "bushings"))
    panels += (("simulations", "simulations in a batch"), ("seconds", "duration (s)"), ("threads", "threads"))
    figure = Figure(figsize=(7.5, 5.4), layout="constrained")
    for axes, (unit, label) in zip(figure.subplots(2, 3).flat, panels):
        rows = [row for row in result["series"] if row["unit"] == unit]
        for row, colour, marker in zip(rows, COLOURS, MARKERS):
            name = row["name"].partition(":")[2 if unit == "links" else 0].strip()
            unit_time = row["seconds"][0] if unit == "links" else 1.0  # a step and a second in one panel
            time, text = [seconds / unit_time for seconds in row["seconds"]], f"{name}: {row['exponent']:.2f}"
            axes.loglog(row["values"], time, color=colour, marker=marker, label=text, **STYLE)
        quantity = {"links": "time, relative", "modes": "time per step (s)", "bushings": "time per step (s)"}
        _label(axes, label, quantity.get(unit, "time (s)"))
        ticks = rows[0]["values"] if rows else []
        axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.minorticks_off()
        low, high = axes.get_ylim()
        axes.set_ylim(low, high * (high / low) ** 0.45)  # room for the legend
        axes.legend(fontsize=6.5, loc="upper left")
    return figure


def drives(result):
    """Time of a step over that without play, inside the actuators and between two joints, over their number."""
    figure = Figure(figsize=(5.5, 3.2), layout="constrained")
    axes = figure.add_subplot()
    names = {
        "actuator": "play inside the actuators", "joint": "play between two joints each",
        "native": "as a dead band of MuJoCo's own",
    }  # fmt: skip
    for (form, name), colour in zip(names.items(), COLOURS):
        for state, line, marker in (("free", "--", "o"), ("engaged", "-", "s")):
            ratios = result["series"][f"{form} {state}"]
            axes.plot(result["joints"], ratios, line, color=colour, marker=marker, label=f"{name}, {state}", **STYLE)
    axes.axhline(1.0, color="#8c8c8c", linewidth=0.8)
    axes.set_ylim(0, 1.5 * axes.get_ylim()[1])  # room for the legend
    _label(axes, "joints", "time of a step over that without play")
    axes.legend(fontsize=7, loc="upper left", ncols=2)
    return figure


def steps(scaling, alternatives):
    """Error against the time step, and against the number of links."""
    figure = Figure(figsize=(7.5, 3.2), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    names = dict.fromkeys(row["name"] for row in scaling["steps"])
    for name, colour, marker in zip(names, COLOURS, MARKERS):
        rows = [row for row in scaling["steps"] if row["name"] == name]
        step, error = [1e6 * row["step"] for row in rows], [row["error"] for row in rows]
        left.loglog(step, error, color=colour, marker=marker, label=name, **STYLE)
    left.legend(fontsize=8)
    _label(left, "time step (µs)", "RMSE of the FRFs (dB)")
    rows = [row for row in alternatives["rows"] if row["method"] == "links"]
    links = [int(row["setting"].split()[0]) for row in rows]
    right.loglog(links, [row["error"] for row in rows], color=COLOURS[0], marker="o", **STYLE)
    right.set_xticks(links, [str(n) for n in links])
    right.minorticks_off()
    _label(right, "links", "")
    return figure


def _label(axes, x, y):
    axes.set_xlabel(x, fontsize=8)
    axes.set_ylabel(y, fontsize=8)
    axes.tick_params(labelsize=8)
    axes.grid(alpha=0.3, linewidth=0.5)
