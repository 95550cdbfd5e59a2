// Interactive charts of a report's figures: `report/interactive.py` says what their data are.
(() => {
const NARROW = 40, LEFT = 62, BELOW = 46, SEARCHED = 60, GAP = 16;

function element(name, properties = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(properties))
    key in made ? made[key] = value : made.setAttribute(key, value);
  made.append(...children);
  return made;
}

// Arrays of a figure's data, null where a value is not finite.
async function decoded({arrays, numbers}) {
  const compressed = Uint8Array.from(atob(numbers), character => character.charCodeAt(0));
  const stream = new Blob([compressed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer()), n = planes.length / 4;
  const bytes = new Uint8Array(planes.length);
  for (let i = 0; i < n; i++) for (let k = 0; k < 4; k++) bytes[4 * i + k] = planes[k * n + i];
  const floats = Array.from(new Float32Array(bytes.buffer), value => Number.isFinite(value) ? value : null);
  return arrays.map(({from, step, at, n}) => at == null ? Array.from({length: n}, (_, i) => from + i * step)
    : floats.slice(at, at + n));
}

// A word without its unit, where both have no room.
const fitting = (words, pixels) => words.length * 7 < pixels ? words : words.split(" (")[0];

class Chart {
  constructor(figure, data, arrays) {
    this.figure = figure;
    this.series = data.series;
    this.names = [...new Set(data.series.map(one => one.label))];
    this.hidden = new Set();
    this.panels = [];
    this.cells = data.cells.map((cell, number) => {
      const entry = {title: cell.title, column: cell.column, panels: [], hidden: false};
      for (const described of cell.panels) entry.panels.push(this.prepared(described, arrays, entry));
      this.panels.push(...entry.panels);
      entry.name = cell.title || `panel ${number + 1}`;
      return entry;
    });
    const first = this.panels[0];
    this.log = first.log[0];
    this.linear = false;
    this.cell = this.cells[0];
    this.build();
    this.draw();
    figure.classList.add("live");
    darkness.addEventListener("change", () => this.draw());
    new ResizeObserver(() => this.fit()).observe(this.grid);
  }

  prepared(described, arrays, cell) {
    const lines = described.lines;
    const panel = {...described, cell, group: described.x + described.limits[0], plot: null};
    const same = lines.every(line => line.x === lines[0].x);
    panel.data = same ? [arrays[lines[0].x], ...lines.map(line => arrays[line.y])]
      : uPlot.join(lines.map(line => [arrays[line.x], arrays[line.y]]));
    panel.drawn = [panel.data[0], ...panel.data.slice(1).map((values, i) => lines[i].up
      ? values.map(v => v == null ? v : v + lines[i].up) : values)];
    panel.window = panel.limits[1];
    panel.span = panel.limits[0];
    panel.level = panel.log[1];
    return panel;
  }

  build() {
    const button = (label, action, more = {}) => element("button", {type: "button", onclick: action, ...more}, label);
    const label = this.figure.querySelector("figcaption b")?.textContent ?? "Figure";
    const tools = element("div", {className: "chart-tools", role: "toolbar", "aria-label": `${label} Tools`});
    const positive = this.panels.every(panel => panel.limits[0][0] > 0);
    if (positive) tools.append(this.logButton = button("", () => { this.log = !this.log; this.draw(); },
      {className: "chart-x"}));
    if (this.panels.some(panel => panel.decibel || panel.level)) tools.append(this.linearButton = button("",
      () => { this.linear = !this.linear; this.whole(); this.draw(); }, {className: "chart-y"}));
    tools.append(button("+", () => this.zoom(.5), {"aria-label": "Zoom in", className: "chart-in"}),
      button("−", () => this.zoom(2), {"aria-label": "Zoom out", className: "chart-out"}),
      button("Whole", () => this.whole(), {className: "chart-whole"}));
    if (this.cells.length > 1) this.cells.forEach(cell => tools.append(button(cell.name,
      event => this.toggleCell(cell, event.currentTarget), {"aria-pressed": "true", className: "chart-cell-toggle"})));
    this.pictureButton = button("Picture", () => {
      const shown = this.figure.classList.toggle("picture");
      this.pictureButton.textContent = shown ? "Chart" : "Picture";
    }, {className: "chart-picture"});
    tools.append(this.pictureButton);
    this.at = element("span", {className: "chart-at"});
    this.head = element("tr");
    this.rows = new Map(this.names.map(name => {
      const pressed = button(name, () => this.toggle(name), {"aria-pressed": "true"});
      pressed.prepend(element("canvas", {className: "chart-swatch", width: 56, height: 20}));
      return [name, element("tr", {}, element("th", {scope: "row"}, pressed))];
    }));
    this.table = element("table", {}, element("caption", {}, this.at), element("thead", {}, this.head),
      element("tbody", {}, ...this.rows.values()));
    this.spoken = element("p", {className: "chart-spoken", "aria-live": "polite"});
    this.grid = element("div", {className: "chart-cells"});
    const columns = new Set(this.cells.map(cell => cell.column)).size;
    this.grid.style.setProperty("--columns", columns);
    for (const cell of this.cells) {
      cell.body = element("div", {className: "chart-panels"});
      cell.box = element("div", {className: "chart-cell", tabIndex: 0, role: "group", "aria-roledescription": "chart",
        "aria-label": `${label} ${cell.name}. Left and right arrows move the cursor, with Shift by ten; plus and ` +
        "minus zoom, 0 shows the whole."}, element("p", {className: "chart-title"}, cell.title), cell.body);
      cell.box.addEventListener("keydown", event => { this.cell = cell; pressed(event, this); });
      cell.box.addEventListener("focus", () => { this.cell = cell; this.read(); });
      this.grid.append(cell.box);
    }
    const box = element("div", {className: "chart"}, tools,
      element("div", {className: "chart-read"}, this.table), this.grid, this.spoken);
    this.figure.prepend(box);
  }

  draw() {
    if (this.logButton) this.logButton.textContent = this.log ? "x: log" : "x: linear";
    if (this.linearButton) this.linearButton.textContent = this.linear ? "y: linear"
      : this.panels.some(panel => panel.decibel) ? "y: dB" : "y: log";
    for (const panel of this.panels) {
      panel.plot?.destroy();
      const {cell} = panel, last = cell.panels.at(-1) === panel, angle = panel.y.endsWith("(°)");
      const described = {
        width: this.width(), height: panel.height + (last ? BELOW : 8),
        x: {size: last ? BELOW - LABEL : 8, label: last ? panel.x : null, log: this.log, bare: !last,
          range: (_, low, high) => [low, high]},
        y: {size: LEFT - LABEL, label: fitting(this.quantity(panel, panel.y), panel.height), angle,
          log: panel.level && !this.linear, range: () => panel.window},
        series: panel.lines.map(drawn => {
          const {label, colour, width, dash, joined, points} = this.series[drawn.series], stroke = readable(colour);
          return {label, stroke, width: joined ? Math.max(1, 1.2 * width) : 0, dash: dash.map(v => 1.4 * v),
            show: !this.hidden.has(label), paths: joined ? line(angle) : () => null,
            points: joined && !points ? {show: panel.data[0].length === 1} : {show: true, size: 4, width: 0,
              fill: stroke}};
        }),
        cursor: {y: false, move: (plot, left, top) => [left < 0 ? left : snapped(plot, left), top], drag: {x: true, y: true, uni: 30, setScale: true}, focus: {prox: -1},
          bind: {dblclick: () => () => this.whole(), mouseleave: () => null}, points: {size: 7, width: 1.5}},
        hooks: {
          setCursor: [plot => this.moved(panel, plot)],
          setScale: [(plot, key) => this.scaled(panel, plot, key)]},
        marks: () => panel.marks,
      };
      this.busy = true;
      panel.plot = plotted(cell.body, described, this.data(panel));
      this.busy = false;
      panel.plot.setScale("x", {min: panel.span[0], max: panel.span[1]});
      this.touch(panel);
      panel.plot.over.style.touchAction = "pan-y";
    }
    this.swatches();
    this.read();
  }

  quantity(panel, words = panel.read) {
    if (!this.linear || !panel.decibel) return words;
    return words.replace(/ ?\(dB re .*\)/, ` (${panel.decibel})`);
  }

  data(panel) {
    if (!this.linear || !panel.decibel) return panel.drawn;
    return [panel.data[0], ...panel.data.slice(1).map(values => values.map(v => v == null ? v : 10 ** (v / 20)))];
  }

  limits(panel) {
    const [low, high] = panel.limits[1];
    return this.linear && panel.decibel ? [0, 10 ** (high / 20)] : [low, high];
  }

  width() {
    const columns = innerWidth <= NARROW * 16 ? 1 : new Set(this.cells.filter(cell => !cell.hidden).map(c => c.column)).size;
    return Math.max(200, Math.floor((this.grid.clientWidth - GAP * (columns - 1)) / columns));
  }

  fit() {
    for (const panel of this.panels) {
      const height = panel.plot.height, width = this.width();
      if (!panel.cell.hidden && this.grid.clientWidth && width !== panel.plot.width) panel.plot.setSize({width, height});
    }
  }

  swatches() {
    for (const [name, row] of this.rows) {
      const {colour, width, dash, joined} = this.series.find(one => one.label === name);
      const ctx = row.querySelector("canvas").getContext("2d");
      ctx.reset();
      ctx.scale(2, 2);
      ctx.strokeStyle = ctx.fillStyle = readable(colour);
      ctx.lineWidth = Math.max(1.5, width);
      ctx.setLineDash(dash);
      ctx.beginPath();
      if (joined) ctx.moveTo(1, 5), ctx.lineTo(27, 5), ctx.stroke();
      else ctx.arc(14, 5, 3, 0, 7), ctx.fill();
    }
  }

  // The cursor.

  moved(panel, plot) {
    const {idx, left} = plot.cursor;
    if (this.busy || idx == null || left < 0) return;
    this.cell = panel.cell;
    this.point(panel, idx, panel);
  }

  // Put the cursor of all panels with this one's x at one of its points.
  point(panel, index, source = null) {
    this.x = panel.data[0][index];
    this.group = panel.group;
    this.busy = true;
    for (const other of this.panels)
      if (other !== source && other.group === panel.group && !other.cell.hidden)
        other.plot.setCursor({left: other.plot.valToPos(this.x, "x"), top: 0});
    this.busy = false;
    this.read();
  }

  // Value of a line of a panel at the cursor; the nearest where lines have points of their own.
  value(panel, values) {
    const at = nearest(panel.data[0], this.x);
    for (let away = 0; away < SEARCHED; away++)
      for (const index of [at - away, at + away])
        if (values[index] !== undefined) return values[index];
    return null;
  }

  read() {
    const {cell} = this, here = this.group === cell.panels[0].group;
    const unit = cell.panels[0].x || "x";
    const [quantity, , of] = unit.match(/^(.*?)( \((.*)\))?$/).slice(1);
    this.at.textContent = [cell.title, here && this.x != null
      ? `${quantity} ${Number(this.x.toPrecision(6))}${of ? " " + of : ""}` : "point, or press arrow keys, to read"]
      .filter(Boolean).join(" · ");
    this.head.replaceChildren(element("th", {scope: "col"}, "Show"),
      ...cell.panels.map(panel => element("th", {scope: "col", className: "number"}, this.quantity(panel))));
    const shown = cell.panels.map(panel => this.linear && panel.decibel ? this.data(panel) : panel.data);
    for (const [name, row] of this.rows) {
      const cells = cell.panels.map((panel, i) => {
        const k = panel.lines.findIndex(line => this.series[line.series].label === name);
        const text = k < 0 ? "" : here ? sig(this.value(panel, shown[i][k + 1]), 5) : "";
        return element("td", {className: "number"}, text);
      });
      row.replaceChildren(row.firstElementChild, ...cells);
    }
  }

  speak() {
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => {
      const heads = [...this.head.cells].slice(1).map(cell => cell.textContent);
      this.spoken.textContent = [this.at.textContent, ...[...this.rows].filter(([name]) => !this.hidden.has(name)).map(
        ([name, row]) => `${name}: ` + [...row.cells].slice(1).map((cell, i) => `${heads[i]} ${cell.textContent}`).join(", "))]
        .join("; ");
    }, 400);
  }

  // Move the cursor along the first panel of the cell by a number of points.
  step(size) {
    const panel = this.cell.panels[0], x = panel.data[0], [low, high] = panel.span;
    const first = x.findIndex(value => value >= low), last = x.findLastIndex(value => value <= high);
    const from = this.x != null && this.group === panel.group ? nearest(x, this.x)
      : size > 0 ? first - Math.sign(size) : last - Math.sign(size);
    const to = Number.isFinite(size) ? Math.min(x.length - 1, Math.max(0, from + size)) : size > 0 ? last : first;
    if (x[to] < low || x[to] > high) this.span(panel, this.log ? [low * x[to] / x[from], high * x[to] / x[from]]
      : [low + x[to] - x[from], high + x[to] - x[from]]);
    this.point(panel, to);
    this.speak();
  }

  touch(panel) {
    const over = panel.plot.over;
    const follow = event => {
      if (event.pointerType !== "touch") return;
      const box = over.getBoundingClientRect();
      panel.plot.setCursor({left: event.clientX - box.left, top: event.clientY - box.top});
    };
    over.addEventListener("pointerdown", follow);
    over.addEventListener("pointermove", follow);
  }

  // The axes.

  // Somebody has drawn a box: panels with the same x follow.
  scaled(panel, plot, key) {
    const {min, max} = plot.scales[key];
    if (key === "y") panel.window = [min, max];
    else if (min !== panel.span[0] || max !== panel.span[1]) this.span(panel, [min, max]);
  }

  span(panel, [low, high]) {
    const [least, most] = panel.limits[0];
    const range = [Math.max(low, least), Math.min(high, most)];
    if (range[0] >= range[1]) return;
    for (const other of this.panels) if (other.group === panel.group) {
      other.span = range;
      other.plot.setScale("x", {min: range[0], max: range[1]});
    }
  }

  zoom(factor) {
    const panel = this.cell.panels[0], place = this.group === panel.group ? this.x : null;
    this.span(panel, zoomed(panel.span, panel.limits[0], factor, place, this.log));
  }

  whole() {
    for (const panel of this.panels) {
      [panel.span, panel.window] = [panel.limits[0], this.limits(panel)];
      panel.plot.batch(() => {
        panel.plot.setScale("x", {min: panel.span[0], max: panel.span[1]});
        panel.plot.setScale("y", {min: panel.window[0], max: panel.window[1]});
      });
    }
  }

  // What is shown.

  toggle(name) {
    const shown = this.hidden.delete(name) || !this.hidden.add(name);
    this.rows.get(name).querySelector("button").setAttribute("aria-pressed", shown);
    for (const panel of this.panels) panel.lines.forEach((line, i) => {
      if (this.series[line.series].label === name) panel.plot.setSeries(i + 1, {show: shown});
    });
  }

  toggleCell(cell, pressed) {
    cell.hidden = !cell.hidden;
    cell.box.hidden = cell.hidden;
    pressed.setAttribute("aria-pressed", !cell.hidden);
    this.grid.style.setProperty("--columns", new Set(this.cells.filter(c => !c.hidden).map(c => c.column)).size || 1);
    this.fit();
  }
}

const snapped = (plot, left) => plot.valToPos(plot.data[0][plot.posToIdx(left)], "x");

// Charts are made as their figures come near: those in folded parts when they are opened.
const near = new IntersectionObserver(entries => {
  for (const {target, isIntersecting} of entries) if (isIntersecting) {
    near.unobserve(target);
    const data = JSON.parse(target.querySelector("script").textContent);
    decoded(data).then(arrays => { target.chart = new Chart(target, data, arrays); });
  }
}, {rootMargin: "800px"});
for (const script of document.querySelectorAll("figure > script")) near.observe(script.parentElement);
})();
