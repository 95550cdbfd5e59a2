"use strict";
// Figures of the live page: charts that take new data, and the bending shafts.

const DASHES = { model: [], record: [2, 3], A: [9, 4], B: [9, 3, 2, 3] };
const LIGHT = ["#0072b2", "#d55e00", "#882255", "#00805c", "#b3508f", "#a06a00", "#2f86b8", "#6b4f2a"];
const DARK = ["#56b4e9", "#ff9a4d", "#e58bb5", "#3ddc9f", "#f0b7d6", "#ffc940", "#9ad4ff", "#d2a679"];
const colour = (i) => (darkness.matches ? DARK : LIGHT)[i % LIGHT.length];
const nulls = (values) => Array.from(values, (v) => (Number.isFinite(v) ? v : null));
const positive = (values) => Array.from(values, (v) => (v > 0 && Number.isFinite(v) ? v : null));

// Lines through points in any order: solid where the third row is not 0, dashed elsewhere. Or triangles that point
// upwards, filled, or downwards, hollow.
function curve(u, i) {
  uPlot.orient(u, i, (series, dx, dy, sx, sy, toX, toY, left, top, width, height) => {
    const [x, y, solid] = u.data[i], ctx = u.ctx;
    ctx.save();
    ctx.beginPath();
    ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
    ctx.clip();
    ctx.strokeStyle = typeof series.stroke === "function" ? series.stroke(u, i) : series.stroke;
    ctx.lineWidth = series.width * devicePixelRatio;
    if (series.mark) {
      const up = series.mark === "up", size = (up ? -4 : 4) * devicePixelRatio;
      ctx.fillStyle = up ? ctx.strokeStyle : ink("--paper");
      ctx.beginPath();
      for (let k = 0; k < x.length; k++) if (y[k] !== null) {
        const px = toX(x[k], sx, width, left), py = toY(y[k], sy, height, top);
        ctx.moveTo(px, py + size); ctx.lineTo(px - 4 * devicePixelRatio, py - size); ctx.lineTo(px + 4 * devicePixelRatio, py - size); ctx.closePath();
      }
      ctx.fill(); ctx.stroke(); ctx.restore();
      return;
    }
    for (const wanted of solid ? [true, false] : [true]) {
      ctx.setLineDash(wanted ? (series.dash || []).map((d) => d * devicePixelRatio) : [4 * devicePixelRatio, 4 * devicePixelRatio]);
      ctx.beginPath();
      let down = false;
      for (let k = 0; k < x.length; k++) {
        const on = x[k] !== null && y[k] !== null && (!solid || (solid[k] !== 0) === wanted);
        if (!on) { if (down && solid && y[k] !== null) ctx.lineTo(toX(x[k], sx, width, left), toY(y[k], sy, height, top)); down = false; continue; }
        const px = toX(x[k], sx, width, left), py = toY(y[k], sy, height, top);
        if (down) ctx.lineTo(px, py); else ctx.moveTo(px, py);
        down = true;
      }
      ctx.stroke();
    }
    ctx.restore();
  });
  return null;
}

const padded = (u, low, high) => {
  if (low === null || high === null) return [0, 1];
  if (low === high) return [low - 1, high + 1];
  return [low, high];
};

class LiveChart {
  // options: label, x, y (axis labels), height, square, logX, logY, free (points in any order), sync, range, angle, onCursor, onZoom
  constructor(id, options) {
    this.host = document.getElementById(id);
    this.options = options;
    this.key = "";
    this.host.tabIndex = 0;
    this.host.setAttribute("role", "img");
    this.host.setAttribute("aria-label", options.label);
    this.host.addEventListener("keydown", (event) => this.plot && pressed(event, this));
    if (options.free) this.step = null; // no cursor goes along points in any order
    new ResizeObserver(() => this.plot && this.plot.setSize(this.size())).observe(this.host);
  }
  size() {
    const width = Math.max(this.host.clientWidth, 200);
    return { width, height: this.options.square ? width - 26 : this.options.height || 200 }; // square within its axes
  }
  // series: [{label, stroke, dash, width}], data as uPlot takes it, lines across the plot: [{x} or {y}]
  show(series, data, lines = []) {
    const o = this.options;
    this.lines = lines;
    const key = JSON.stringify([series, o.logX, o.logY, o.y, darkness.matches]);
    const empty = o.free ? !data.slice(1).some((d) => d[0].length) : !data[0].length;
    if (empty) { this.clear(); return; }
    this.data = data;
    if (this.plot && key === this.key) {
      const window = this.shown;
      this.plot.setData(data, !window);
      if (window) this.plot.setScale("x", window);
      return;
    }
    if (this.plot) this.plot.destroy();
    this.key = key;
    const free = { facets: [{ scale: "x", auto: true }, { scale: "y", auto: true }], paths: curve };
    const range = o.range || (o.free && !o.logY ? (u, a, b) => uPlot.rangeNum(a, b, 0.06, true) : null);
    this.plot = plotted(this.host, {
      ...this.size(), mode: o.free ? 2 : 1, padding: [8, 10, 0, 0],
      x: { label: o.x, size: 34, log: o.logX, range: o.free ? padded : null },
      y: { label: o.y, size: 58, log: o.logY, angle: o.angle, range },
      series: series.map((s) => ({ ...s, width: s.width || 1.3, points: { show: false }, ...(o.free ? free : { paths: line(o.angle) }) })),
      cursor: { drag: { x: true, y: false, setScale: true }, points: { show: !o.free }, ...(o.sync ? { sync: { key: o.sync } } : {}) },
      hooks: { setCursor: [(u) => o.onCursor && o.onCursor(u.cursor.idx)], setScale: [(u, name) => name === "x" && this.scaled(u)] },
      marks: () => this.lines,
    }, data);
    this.shown = null;
    this.plot.over.addEventListener("dblclick", () => this.whole());
  }
  clear() {
    if (this.plot) this.plot.destroy();
    this.plot = null;
    this.key = "";
  }
  ends() {
    if (!this.options.free) return [this.data[0][0], this.data[0][this.data[0].length - 1]];
    const x = this.data.slice(1).flatMap((d) => d[0].filter((v) => v !== null));
    return [x.reduce((a, b) => Math.min(a, b), Infinity), x.reduce((a, b) => Math.max(a, b), -Infinity)];
  }
  scaled(u) {
    const { min, max } = u.scales.x, [low, high] = this.full || this.ends();
    const slack = 1e-6 * (high - low);
    const shown = min > low + slack || max < high - slack ? { min, max } : null;
    if (JSON.stringify(shown) === JSON.stringify(this.shown || null)) return;
    this.shown = shown;
    if (this.options.onZoom) this.options.onZoom(shown);
  }
  whole() {
    this.shown = null;
    const [min, max] = this.full || this.ends();
    this.plot.setScale("x", { min, max });
  }
  zoom(factor) {
    const u = this.plot, { min, max } = u.scales.x, idx = u.cursor.idx;
    const place = this.options.free || idx == null ? null : u.data[0][idx];
    const [low, high] = zoomed([min, max], this.full || this.ends(), factor, place, this.options.logX);
    u.setScale("x", { min: low, max: high });
  }
  // Move the cursor by a number of points among those that are shown.
  step(by) {
    const u = this.plot, x = u.data[0], first = u.valToIdx(u.scales.x.min), last = u.valToIdx(u.scales.x.max);
    const idx = Math.min(Math.max((u.cursor.idx ?? Math.round((first + last) / 2)) + by, first), Math.min(last, x.length - 1));
    u.setCursor({ left: u.valToPos(x[idx], "x"), top: u.over.clientHeight / 2 }, true, true);
  }
}

// The shafts, bending, and the walls of their clearances.
class ShaftView {
  constructor() {
    this.canvas = document.getElementById("shaft");
    this.slider = document.getElementById("picture");
    this.button = document.getElementById("play");
    this.picture = 0;
    this.playing = false;
    this.slider.addEventListener("input", () => { this.play(false); this.picture = Number(this.slider.value); this.draw(); });
    this.button.addEventListener("click", () => this.play(!this.playing));
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) this.play(true);
  }
  play(on) {
    this.playing = on;
    this.button.textContent = on ? "Pause" : "Play";
    this.button.setAttribute("aria-pressed", String(on));
    clearInterval(this.timer);
    if (on) this.timer = setInterval(() => this.next(), 50);
  }
  next() {
    if (!this.lift || document.hidden) return;
    this.picture = (this.picture + 1) % this.count;
    this.slider.value = this.picture;
    this.draw();
  }
  show(facts, arrays) {
    const words = document.getElementById("shaft-words");
    this.lift = null;
    this.canvas.parentElement.classList.toggle("shaftless", typeof facts === "string");
    if (typeof facts === "string") { words.textContent = facts; this.draw(); return; }
    this.facts = facts;
    this.walls = facts.walls;
    this.position = arrays.position;
    this.number = arrays.number;
    this.lift = arrays.lift;
    this.pressed = arrays.pressed;
    this.count = this.lift.length / this.position.length;
    this.picture %= this.count;
    this.slider.max = this.count - 1;
    this.largest = 0;
    for (const v of this.lift) this.largest = Math.max(this.largest, Math.abs(v));
    for (const pair of facts.walls) for (const wall of pair) if (wall !== null) this.largest = Math.max(this.largest, Math.abs(wall));
    this.force = 1e-9;
    for (const v of this.pressed) this.force = Math.max(this.force, Math.abs(v));
    words.textContent = `${facts.slow} times slower, from ${sig(facts.starts)} s on, about the strongest contact; relative to the base. ${facts.views || ""}` +
      `Height of the picture: ±${sig(1e3 * this.largest, 3)} mm. Dashed: the clearances’ walls; arrows: contact forces, up to ${sig(this.force, 3)} N.`;
    this.draw();
  }
  draw() {
    const box = this.canvas.getBoundingClientRect(), ratio = devicePixelRatio || 1;
    const width = Math.round(box.width * ratio), height = Math.round(box.height * ratio);
    if (this.canvas.width !== width || this.canvas.height !== height) { this.canvas.width = width; this.canvas.height = height; }
    const ctx = this.canvas.getContext("2d");
    ctx.clearRect(0, 0, width, height);
    if (!this.lift) return;
    const n = this.position.length, lanes = this.number[n - 1] + 1;
    const low = Math.min(...this.position), high = Math.max(...this.position), edge = 12 * ratio;
    const x = (at) => edge + (at - low) / (high - low) * (width - 2 * edge);
    const y = (lane, v) => height * (lane + 0.5) / lanes - v / this.largest * (height / lanes / 2 - edge);
    ctx.lineWidth = ratio;
    ctx.strokeStyle = ink("--line");
    for (let lane = 0; lane < lanes; lane++) { ctx.beginPath(); ctx.moveTo(x(low), y(lane, 0)); ctx.lineTo(x(high), y(lane, 0)); ctx.stroke(); }
    ctx.lineWidth = 2 * ratio;
    this.facts.places.forEach(([lane, at, length], i) => {
      const half = Math.max(length / 2, 0.02 * (high - low));
      ctx.setLineDash([5 * ratio, 3 * ratio]);
      ctx.strokeStyle = ink("--soft");
      for (const wall of this.walls[i]) if (wall !== null) { ctx.beginPath(); ctx.moveTo(x(at - half), y(lane, wall)); ctx.lineTo(x(at + half), y(lane, wall)); ctx.stroke(); }
      ctx.setLineDash([]);
      const force = this.pressed[this.picture * this.facts.places.length + i];
      if (Math.abs(force) > 0.01 * this.force) {
        const wall = this.walls[i][force > 0 ? 1 : 0], from = y(lane, wall === null ? 0 : wall), tip = from + Math.sign(force) * (8 + 22 * Math.abs(force) / this.force) * ratio;
        ctx.strokeStyle = ctx.fillStyle = colour(1);
        ctx.beginPath(); ctx.moveTo(x(at), from); ctx.lineTo(x(at), tip); ctx.stroke();
        ctx.beginPath(); ctx.arc(x(at), from, 3.5 * ratio, 0, 7); ctx.fill();
      }
    });
    ctx.strokeStyle = colour(0);
    ctx.lineWidth = 2.5 * ratio;
    for (let k = 0; k < n; k++) {
      const lane = this.number[k], px = x(this.position[k]), py = y(lane, this.lift[this.picture * n + k]);
      if (k === 0 || this.number[k - 1] !== lane) { if (k) ctx.stroke(); ctx.beginPath(); ctx.moveTo(px, py); } else ctx.lineTo(px, py);
    }
    ctx.stroke();
  }
}
