"use strict";
// Charts of reports and of the live page: what all of uPlot's plots have in common, their colours, axes, lines and keys.

const LABEL = 18, FONT = "12px system-ui, sans-serif", JUMP = 180;
const darkness = matchMedia("(prefers-color-scheme: dark)");
const ink = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const channels = hex => (hex.length < 6 ? [1, 2, 3].map(i => hex[i] + hex[i]) : [1, 3, 5].map(i => hex.slice(i, i + 2)))
  .map(pair => parseInt(pair, 16));
const luminance = rgb => rgb.map(v => v / 255).map(v => v <= .03928 ? v / 12.92 : ((v + .055) / 1.055) ** 2.4)
  .reduce((sum, v, i) => sum + v * [.2126, .7152, .0722][i], 0);
const contrast = (a, b) => (Math.max(a, b) + .05) / (Math.min(a, b) + .05);

// A colour, moved towards the ink of the page until it stands out from its paper (WCAG 2, 1.4.11: 3 to 1; more on dark
// paper, where thin lines look fainter). Black and greys turn about there.
function readable(hex) {
  const paper = luminance(channels(ink("--paper"))), towards = channels(ink("--ink")), least = paper < .2 ? 4.5 : 3;
  let rgb = channels(hex);
  if (paper < .2 && Math.max(...rgb) - Math.min(...rgb) < 16) rgb = rgb.map(v => 255 - v);
  for (let i = 0; i < 20 && contrast(luminance(rgb), paper) < least; i++)
    rgb = rgb.map((v, k) => v + .15 * (towards[k] - v));
  return `rgb(${rgb.map(Math.round).join(" ")})`;
}

// A number in a few digits; "–" for none.
function sig(value, digits = 4) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  return size && (size < 1e-3 || size >= 1e6) ? value.toExponential(digits - 1) : String(Number(value.toPrecision(digits)));
}
const short = value => value == null ? "" : String(Number(value.toPrecision(4)));

// Ticks at 1, 2 and 5 over a decade or more of a logarithmic axis, else even ones; at quarter turns of a whole one.
function ticks(low, high, log, room, angle = false) {
  const values = [];
  if (log && high / low > 5) {
    for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++)
      for (const digit of high / low > 1e3 ? [1] : [1, 2, 5]) values.push(Number(`${digit}e${power}`));
  } else {
    const rough = (high - low) / Math.max(2, Math.floor(room)), power = 10 ** Math.floor(Math.log10(rough));
    const even = power * ([1, 2, 5].find(digit => digit * power >= rough) ?? 10);
    const step = angle && high - low > 200 ? (room < 4 ? 180 : 90) : even;
    for (let i = Math.ceil(low / step); i * step <= high; i++) values.push(Number((i * step).toPrecision(12)));
  }
  return values.filter(value => low <= value && value <= high);
}

// A line over rising points, with a gap where a value is missing and, of an angle (°), where it wraps. uPlot's own line
// clips gaps, which leaves slivers of dense ones.
const line = angle => (plot, number, first, last) => {
  const stroke = new Path2D();
  uPlot.orient(plot, number, (_series, x, y, scaleX, scaleY, toX, toY, left, top, width, height, moveTo, lineTo) => {
    let before = null;
    for (let i = first; i <= last; i++) if (y[i] !== undefined) {
      const joined = before != null && y[i] != null && !(angle && Math.abs(y[i] - before) > JUMP);
      if (y[i] != null) (joined ? lineTo : moveTo)(stroke, toX(x[i], scaleX, width, left), toY(y[i], scaleY, height, top));
      before = y[i];
    }
  });
  return {stroke, fill: null, clip: null, band: null, gaps: null, flags: 1};
};

// A dashed line across a plot, at one x or one y.
function mark(plot, {x, y, colour}) {
  const {ctx, bbox} = plot, upright = x != null, at = plot.valToPos(upright ? x : y, upright ? "x" : "y", true);
  const [from, room] = upright ? [bbox.left, bbox.width] : [bbox.top, bbox.height];
  if (at < from || at > from + room) return;
  ctx.save();
  ctx.strokeStyle = colour ? readable(colour) : ink("--soft");
  ctx.lineWidth = devicePixelRatio;
  ctx.setLineDash([4, 4].map(v => v * devicePixelRatio));
  ctx.beginPath();
  ctx.moveTo(upright ? at : bbox.left, upright ? bbox.top : at);
  ctx.lineTo(upright ? at : bbox.left + bbox.width, upright ? bbox.top + bbox.height : at);
  ctx.stroke();
  ctx.restore();
}

// A plot in an element. Of each axis, x and y: label, size, log, angle, bare (without words), range as uPlot takes it.
// Besides: width, height, series, cursor, hooks, padding, mode and marks(), lines across the plot.
function plotted(host, {width, height, x, y, series, marks, hooks = {}, ...more}, data) {
  const axis = (side, room) => ({stroke: ink("--ink"), font: FONT, labelFont: FONT, labelSize: LABEL, gap: 3,
    size: side.size, label: side.label, grid: {stroke: ink("--line"), width: 1},
    ticks: {stroke: ink("--line"), width: 1, size: 4}, filter: (_, splits) => splits,
    splits: (plot, _, low, high) => ticks(low, high, side.log, room(plot), side.angle),
    values: (_, splits) => splits.map(value => side.bare ? "" : short(value))});
  const scale = side => ({time: false, distr: side.log ? 3 : 1, ...(side.range ? {range: side.range} : {})});
  return new uPlot({width, height, legend: {show: false}, padding: [6, 12, 0, 0], scales: {x: scale(x), y: scale(y)},
    axes: [axis(x, plot => plot.width / 60), axis(y, plot => plot.bbox.height / devicePixelRatio / 26)], series: [{}, ...series],
    hooks: {...hooks, drawAxes: [plot => marks().forEach(one => mark(plot, one))]}, ...more}, data, host);
}

// Index of the value of an increasing sequence that is nearest to one.
function nearest(x, value) {
  let low = 0, high = x.length - 1;
  while (high - low > 1) { const middle = low + high >> 1; x[middle] < value ? low = middle : high = middle; }
  return value - x[low] <= x[high] - value ? low : high;
}

// What is shown of an axis after a zoom by a factor, about a place if that is shown, and within limits.
function zoomed([low, high], [least, most], factor, place, log) {
  const to = log ? Math.log : v => v, back = log ? Math.exp : v => v, [from, end] = [low, high].map(to);
  const middle = place >= low && place <= high ? to(place) : (from + end) / 2;
  const range = [middle - factor * (middle - from), middle + factor * (end - middle)].map(back);
  return [Math.max(range[0], least), Math.min(range[1], most)];
}

// Keys of a chart: plus and minus zoom, 0 shows the whole, arrows move the cursor, with Shift by ten.
function pressed(event, chart) {
  const step = {ArrowRight: 1, ArrowLeft: -1, Home: -Infinity, End: Infinity}[event.key];
  const zoom = {"+": .5, "=": .5, "-": 2}[event.key], whole = event.key === "0" || event.key === "Escape";
  if (event.ctrlKey || event.metaKey || event.altKey || !(zoom || whole || step && chart.step)) return;
  event.preventDefault();
  if (zoom) chart.zoom(zoom);
  else if (whole) chart.whole();
  else chart.step(event.shiftKey ? 10 * step : step);
}
