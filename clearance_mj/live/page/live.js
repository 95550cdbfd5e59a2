"use strict";
// The page: controls, what the server answers, and the figures of both.

const $ = (id) => document.getElementById(id);
const make = (tag, properties = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
};
const state = { values: {}, controls: [], sensors: [], shown: new Set(), memory: {}, order: 0, last: null, pending: new Map(), busy: "" };
const charts = {}, LONG = ["branch", "steps", "sweep"];
let shaft, socket;
window.live = { drawn: 0, milliseconds: null, state, charts };

// ---- the server ----
function unpacked(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  let at = 4 + length;
  const arrays = {};
  for (const [name, shape] of head.arrays) {
    const count = shape.reduce((a, b) => a * b, 1);
    arrays[name] = new Float32Array(buffer, at, count);
    arrays[name].rows = shape.length > 1 ? shape[0] : 1;
    at += 4 * count;
  }
  return { head, arrays, rest: new Uint8Array(buffer, at) };
}
const row = (array, i) => array.subarray(i * array.length / array.rows, (i + 1) * array.length / array.rows);
const send = (message) => socket.readyState === WebSocket.OPEN && socket.send(JSON.stringify(message));

function connect() {
  socket = new WebSocket(location.href.replace(/^http/, "ws").replace(/[#?].*$/, "") + "socket");
  socket.binaryType = "arraybuffer";
  socket.onmessage = (event) => {
    const { head, arrays, rest } = unpacked(event.data);
    ({ hello, figures, window: finer, problem, progress, branch, steps, sweep, ended, export: saved, hear: heard })[head.type](head, arrays, rest);
  };
  socket.onclose = () => { told("Not connected"); trouble("The connection to clearance-mj live is lost. Start it again if it has ended, then open its new address."); };
}
const told = (text) => { $("status").textContent = text; };
function trouble(text) {
  $("problem").hidden = !text;
  $("problem").textContent = text;
  $("figures").classList.toggle("stale", Boolean(text) && state.last === null);
}

// ---- controls ----
function hello(head) {
  Object.assign(state, { controls: head.controls, sensors: head.sensors, clearances: head.clearances, rows: head.rows, orbits: head.orbits, prefix: head.record_prefix });
  $("rig").textContent = head.rig;
  document.title = `${head.rig} – clearance-mj live`;
  state.shown = new Set(head.sensors.map((_, i) => i).slice(0, 8));
  const groups = new Map();
  for (const control of head.controls) {
    state.values[control.name] = control.value;
    if (!groups.has(control.group)) {
      const box = make("details", { open: groups.size < (innerWidth < 900 ? 0 : 20) }, make("summary", { textContent: control.group }));
      groups.set(control.group, box);
      $("controls").append(box);
    }
    groups.get(control.group).append(widget(control));
    if (!control.choices.length) $("sweep-name").append(make("option", { value: control.name, textContent: control.name.includes("[") ? `${control.group}: ${control.label}` : control.label }));
  }
  const first = $("controls").querySelectorAll("details")[1];
  if (first) first.open = true;
  const swept = head.controls.find((c) => c.name.endsWith(".gap")) || head.controls.find((c) => c.name === "level");
  $("sweep-name").value = swept.name;
  sweepRange();
  if (head.clearances.length < 2) $("together").parentElement.hidden = true;
  $("record-label").hidden = !head.records.length;
  for (const name of head.records) $("record").append(make("option", { value: name, textContent: name }));
  sensorTable();
  build();
  changed();
}

function widget(control) {
  const id = `c-${control.name}`;
  const box = make("div", { className: "control" }, make("label", { htmlFor: id, textContent: control.label }));
  control.box = box;
  if (control.choices.length) {
    const select = make("select", { id }, ...control.choices.map((c) => make("option", { value: c, textContent: c })));
    select.addEventListener("change", () => set(control, select.value));
    control.put = (value) => { select.value = value; };
    box.append(select);
  } else {
    const field = make("input", { type: "number", step: "any", id });
    const slider = make("input", { type: "range", min: 0, max: 1000, step: 1 });
    slider.setAttribute("aria-label", `${control.label}, ${control.group}`);
    const at = (p) => control.log ? control.low * (control.high / control.low) ** (p / 1000) : control.low + (control.high - control.low) * p / 1000;
    const place = (v) => 1000 * (control.log ? Math.log(v / control.low) / Math.log(control.high / control.low) : (v - control.low) / (control.high - control.low));
    slider.addEventListener("input", () => set(control, tidy(control, at(Number(slider.value))), slider));
    slider.addEventListener("change", () => set(control, tidy(control, at(Number(slider.value))), slider));
    field.addEventListener("change", () => field.value !== "" && Number.isFinite(field.valueAsNumber) && set(control, field.valueAsNumber / control.scale));
    control.put = (value, from) => {
      field.value = sig(value * control.scale, 5);
      if (from !== slider) slider.value = Number.isFinite(place(value)) ? place(value) : 0;
      slider.setAttribute("aria-valuetext", `${sig(value * control.scale)} ${control.unit}`);
    };
    box.append(field, make("span", { className: "unit", textContent: control.unit }), slider);
  }
  control.put(control.value);
  return box;
}
// Controls of the excitation that do nothing with its kind are not there.
function idle() {
  const kind = state.values.excitation, record = kind.startsWith(state.prefix), sine = kind === "sine", impacts = kind === "impacts";
  const off = { duration: record, fs: record, frequency: !sine, seed: record || sine || impacts || kind.startsWith("sweep"),
    peak: !impacts, width: !impacts, band_low: record || sine, band_high: record || sine, resolution: sine };
  for (const control of state.controls) if (control.name in off) control.box.hidden = off[control.name];
}
const tidy = (control, value) => (control.whole ? Math.round(value) : Number(value.toPrecision(4)));

function set(control, value, from) {
  const names = [control.name];
  const place = /^bushings\[\d+\]/;
  if ($("together").checked && place.test(control.name))
    for (const other of state.controls) if (other.name !== control.name && other.name.replace(place, "") === control.name.replace(place, "")) names.push(other.name);
  if (names.every((name) => state.values[name] === value) && state.order) return;
  for (const name of names) put(name, value, name === control.name ? from : undefined);
  changed();
}
function put(name, value, from) {
  const control = state.controls.find((c) => c.name === name);
  state.values[name] = value;
  control.put(value, from);
  control.box.classList.toggle("moved", value !== control.value);
}
function putAll(values) {
  for (const [name, value] of Object.entries(values)) put(name, value);
  changed();
}
function changed() {
  idle();
  state.order += 1;
  state.pending.set(state.order, performance.now());
  send({ type: "set", id: state.order, values: state.values, record: $("record").value });
}

// ---- figures ----
function figures(head, arrays) {
  for (const key of [...state.pending.keys()]) if (key < head.id) state.pending.delete(key);
  state.last = { head, arrays };
  trouble("");
  document.body.classList.toggle("with-record", Boolean(head.record));
  draw();
  const since = state.pending.get(head.id);
  const rattling = head.clearances.filter((c) => c.rattle === "rattles").map((c) => c.where);
  told(`Simulated ${sig(head.duration, 3)} s in ${sig(head.seconds, 2)} s; ${rattling.length ? `rattles at ${rattling.join(" and ")}` : "no rattle"}`);
  requestAnimationFrame(() => setTimeout(() => { // after the picture is painted
    window.live.milliseconds = performance.now() - since;
    window.live.drawn = head.id;
    state.pending.delete(head.id);
  }));
}

function build() {
  const cursor = (idx) => reading(idx);
  const unit = () => state.last && state.last.head.spectrum ? "Amplitude (m/s²)" : state.last && state.last.head.kind === "force" ? "|H| ((m/s²)/N)" : "|H| (1)";
  charts.magnitude = new LiveChart("magnitude", { label: "Magnitude of the frequency response functions over frequency", x: "Frequency (Hz)", get y() { return unit(); }, height: 290, logY: true, sync: "f", onCursor: cursor });
  charts.phase = new LiveChart("phase", { label: "Phase over frequency", x: "Frequency (Hz)", y: "Phase (°)", height: 170, sync: "f", range: [-190, 190], angle: true });
  charts.coherence = new LiveChart("coherence", { label: "Coherence over frequency", x: "Frequency (Hz)", y: "Coherence", height: 140, sync: "f", range: [0, 1.03] });
  charts.history = new LiveChart("history", { label: "Displacement at the clearances over time", x: "Time (s)", y: "Displacement (mm)", height: 230, onZoom: finely });
  charts.portrait = new LiveChart("portrait", { label: "Velocity over displacement at the clearances", x: "Displacement (mm)", y: "Velocity (mm/s)", height: 260, free: true });
  $("orbits").hidden = !state.orbits.length;
  charts.orbit = new LiveChart("orbit", { label: "Displacement over displacement in two directions", get x() { return `${orbitOf(0)} (mm)`; }, get y() { return `${orbitOf(1)} (mm)`; }, square: true, free: true, range: () => [-charts.orbit.reach, charts.orbit.reach] });
  charts.branch = new LiveChart("branch", { label: "Amplitude of the periodic vibration over frequency", x: "Frequency (Hz)", y: "Amplitude (m/s²)", height: 260, free: true, logY: true });
  charts.share = new LiveChart("sweep-share", { label: "Share of time in contact over the swept value", get x() { return state.sweptLabel || ""; }, y: "In contact (%)", height: 180, free: true });
  charts.rms = new LiveChart("sweep-rms", { label: "RMS of the acceleration over the swept value", get x() { return state.sweptLabel || ""; }, y: "RMS (m/s²)", height: 180, free: true, logY: true });
  shaft = new ShaftView();
  for (const [id, key] of [["log-x", "logX"], ["log-y", "logY"]])
    $(id).addEventListener("change", () => {
      for (const name of key === "logX" ? ["magnitude", "phase", "coherence"] : ["magnitude"]) charts[name].options[key] = $(id).checked;
      draw();
    });
  darkness.addEventListener("change", () => { draw(); sensorColours(); drawBranch(); drawSweep(); });
}

// Values of another frequency grid on this one; a gap beyond its ends. Angles (°) go the shorter way round.
function onGrid(x, from, values, angles = false) {
  if (from.length === x.length && from[0] === x[0] && from[from.length - 1] === x[x.length - 1]) return values;
  const resampled = new Float32Array(x.length);
  for (let i = 0, k = 0; i < x.length; i++) {
    while (k + 1 < from.length && from[k + 1] <= x[i]) k++;
    const next = Math.min(k + 1, from.length - 1), width = from[next] - from[k];
    const fraction = width ? (x[i] - from[k]) / width : 0;
    let step = values[next] - values[k];
    if (angles) step -= 360 * Math.round(step / 360);
    resampled[i] = x[i] < from[0] || x[i] > from[from.length - 1] ? NaN : values[k] + fraction * step;
    if (angles) resampled[i] -= 360 * Math.round(resampled[i] / 360);
  }
  return resampled;
}
function sources() {
  const { arrays } = state.last;
  const curves = [["model", "", arrays]];
  if (arrays.test_frequency) curves.push(["record", "test_", arrays]);
  for (const slot of "AB") if (state.memory[slot] && $(`over-${slot}`).checked) curves.push([slot, "", state.memory[slot].arrays]);
  return curves;
}
function drawFrf(name, filter) {
  const { arrays } = state.last, x = arrays.frequency, series = [], data = [Array.from(x)];
  for (const [source, prefix, from] of sources()) {
    const values = from[prefix + name];
    if (!values) continue;
    for (const i of state.shown) {
      if (i >= values.rows) continue;
      series.push({ label: `${state.sensors[i]} ${source}`, stroke: colour(i), dash: DASHES[source], width: source === "model" ? 1.5 : 1.2 });
      data.push(filter(onGrid(x, from[prefix + "frequency"], row(values, i), name === "phase")));
    }
  }
  if (series.length) charts[name].show(series, data); else charts[name].clear();
}
function draw() {
  if (!state.last) return;
  const { head, arrays } = state.last;
  drawFrf("magnitude", $("log-y").checked ? positive : nulls);
  drawFrf("phase", nulls);
  drawFrf("coherence", nulls);
  $("h-frf").textContent = head.spectrum ? "Spectra of the accelerations" : "Frequency response functions";
  const walls = head.walls || [], many = walls.length;
  const milli = (values) => Array.from(values, (v) => 1e3 * v);
  const shown = [...new Set(walls.flat().filter((w) => w !== null))];
  const lines = (key) => shown.map((w) => ({ [key]: 1e3 * w }));
  const series = state.rows.map((label, i) => ({ label, stroke: colour(i), width: 1 }));
  if (many && arrays.displacement) {
    charts.history.full = [arrays.time[0], arrays.time[arrays.time.length - 1]];
    charts.history.show(series, [Array.from(arrays.time), ...series.map((_, i) => milli(row(arrays.displacement, i)))], lines("y"));
    if (charts.history.shown) finely(charts.history.shown);
    drawOrbits(arrays, walls, milli);
    charts.portrait.show(series, [null, ...series.map((_, i) => [milli(row(arrays.x, i)), milli(row(arrays.v, i))])], lines("x"));
  }
  contact(head);
  shaft.show(head.shaft, arrays);
  reading();
}
const orbitOf = (k) => (state.orbits.length === 1 ? state.rows[state.orbits[0][k]].replace(/^.*?, /, "") : k ? "second" : "first");
// Displacements of one clearance over those of another one, where they are two directions of the same. Walls are a box or, of round clearances, a circle.
const turn = Array.from({ length: 73 }, (_, i) => (2 * Math.PI * i) / 72);
function drawOrbits(arrays, walls, milli) {
  if (!state.orbits.length) return;
  const corners = state.orbits.map(([i, j]) => [walls[i], walls[j]].map((pair) => milli(pair.map((w) => (w === null ? NaN : w)))));
  const boxes = corners.map(([[left, right], [low, high]], k) => ({ label: `walls ${k + 1}`, stroke: ink("--ink"), dash: DASHES.A, data: state.orbits[k][2] ? [turn.map((a) => right * Math.cos(a)), turn.map((a) => high * Math.sin(a))] : [[left, right, right, left, left], [low, low, high, high, low]].map(nulls) }));
  const motions = state.orbits.map(([i, j], k) => ({ label: state.rows[i], stroke: colour(k), width: 1, data: [milli(row(arrays.x, i)), milli(row(arrays.x, j))] }));
  const reach = 1.05 * [...boxes, ...motions].reduce((most, one) => one.data.flat().reduce((m, v) => Math.max(m, Math.abs(v)), most), 0);
  const all = [{ label: "ends", stroke: "transparent", data: [[-reach, reach], [-reach, reach]] }, ...motions, ...boxes];
  charts.orbit.reach = reach;
  charts.orbit.show(all.map(({ data, ...one }) => one), [null, ...all.map((one) => one.data)]);
}
let waiting;
function finely(zoom) {
  clearTimeout(waiting);
  waiting = setTimeout(() => send(zoom ? { type: "window", low: zoom.min, high: zoom.max } : { type: "window", low: 0, high: 1e9 }), 120);
}
function finer(head, arrays) {
  const plot = charts.history.plot;
  if (!plot || !arrays.time || plot.series.length !== arrays.displacement.rows + 1) return;
  const { min, max } = plot.scales.x;
  plot.setData([Array.from(arrays.time), ...Array.from({ length: arrays.displacement.rows }, (_, i) => Array.from(row(arrays.displacement, i), (v) => 1e3 * v))], false);
  plot.setScale("x", { min, max });
}

function contact(head) {
  $("clearances").tBodies[0].replaceChildren(...head.clearances.map((c, i) => {
    const mark = make("span", { className: "swatch" });
    mark.style.background = colour(c.row);
    return make("tr", {}, make("th", { scope: "row" }, mark, c.where),
      make("td", { textContent: c.rattle, className: c.rattle === "rattles" ? "rattles" : "" }),
      ...[100 * c.share, c.impacts, c.force, 1e6 * c.peak, 1e6 * c.rms].map((value) => sig(value, 3)).map((textContent) => make("td", { className: "n", textContent })));
  }));
  const none = head.clearances.length ? "" : "The rig has no clearance. ";
  $("natural").textContent = `${none}Natural frequencies in the gaps: ${head.natural.map((f) => sig(f, 4)).join(", ")} Hz. Time step ${sig(1e6 * head.step, 3)} µs.`;
}

function sensorTable() {
  $("sensors").tBodies[0].replaceChildren(...state.sensors.map((name, i) => {
    const tick = make("input", { type: "checkbox", checked: state.shown.has(i), id: `s-${i}` });
    tick.addEventListener("change", () => { tick.checked ? state.shown.add(i) : state.shown.delete(i); draw(); drawBranch(); drawSweep(); });
    const label = make("label", { htmlFor: tick.id }, make("span", { className: "swatch" }), name);
    return make("tr", {}, make("th", { scope: "row" }, tick, label), ...["n", "n", "n", "n test", "n test"].map((className) => make("td", { className })));
  }));
  sensorColours();
}
const sensorColours = () => document.querySelectorAll("#sensors .swatch").forEach((mark, i) => { mark.style.background = colour(i); });
function reading(idx) {
  if (!state.last) return;
  const { head, arrays } = state.last, x = arrays.frequency;
  if (idx === undefined) idx = charts.magnitude.plot ? charts.magnitude.plot.cursor.idx : null;
  const on = idx !== null && idx !== undefined && idx < x.length;
  const of = (name, i) => { const a = arrays[name]; return a && on && i < a.rows ? row(a, i)[idx] : NaN; };
  const test = (i) => (arrays.test_frequency && on ? onGrid([x[idx], x[idx] + 1e-3], arrays.test_frequency, row(arrays.test_magnitude, i))[0] : NaN);
  const agreement = head.agreement;
  [...$("sensors").tBodies[0].rows].forEach((line, i) => {
    const words = [sig(of("magnitude", i)), Number.isFinite(of("phase", i)) ? `${of("phase", i).toFixed(1)}°` : "–", Number.isFinite(of("coherence", i)) ? of("coherence", i).toFixed(3) : "–", sig(test(i)), agreement ? `${agreement.rmse_db[i].toFixed(2)} dB` : "–"];
    words.forEach((text, k) => { line.cells[k + 1].textContent = text; });
  });
  const near = agreement ? ` Agreement with ${head.record}: CSAC ${agreement.csac.toFixed(3)} (mean over lines).` : head.record ? ` ${head.record} is on other lines than the simulation: no measure of agreement. Drive the rig with the record.` : "";
  $("at").textContent = (on ? `At ${sig(x[idx], 5)} Hz.` : "Move the cursor over a figure.") + near;
}

// ---- what goes wrong, and what takes long ----
function problem(head) {
  if (head.of === "set" && head.id < state.order) return;
  trouble(head.text);
  if (head.of === "set") { told("This setting cannot be shown"); window.live.drawn = head.id; state.pending.delete(head.id); }
  if (head.of === state.busy) finished(head.text);
}
function progress(head) {
  if (head.of === "set") { told(`Simulating … ${Math.round(100 * head.share)} %`); return; }
  if (head.of === state.busy) $(`${head.of}-progress`).value = head.share;
}
function ended() {
  if (state.busy) finished("Cancelled.");
}
// Numbers that a long computation needs, if all of them are there.
const asked = (...ids) => { const numbers = ids.map((id) => $(id).valueAsNumber); return numbers.every(Number.isFinite) ? numbers : null; };
function begin(type, more) {
  if (!more) return;
  state.busy = type;
  running(true);
  $(`${type}-words`).textContent = "Working; the first time after an installation it compiles, for up to a minute.";
  send({ type, values: state.values, ...more });
}
function finished(words) {
  $(`${state.busy}-words`).textContent = words;
  running(false);
  state.busy = "";
}
function running(on) {
  $(`${state.busy}-progress`).value = 0;
  $(`${state.busy}-progress`).hidden = !on;
  for (const what of LONG) $(`${what}-go`).disabled = on;
  for (const button of document.querySelectorAll(".cancel")) button.disabled = !on || button.parentElement !== $(`${state.busy}-go`).parentElement;
}
function branch(head, arrays) {
  state.branch = { head, arrays };
  const kinds = [...new Set(head.special.map((p) => p.kind))];
  const special = head.special.length <= 6 ? head.special.map((p) => `${p.kind} at ${sig(p.frequency, 5)} Hz`).join(", ")
    : kinds.map((kind) => `${kind} ${head.special.filter((p) => p.kind === kind).length} times`).join(", ");
  finished(`Branch at ${amplitude(head)}; dashed: unstable. ${special ? `Special points: ${special}.` : "No folds."} ${head.ended ? `Ended early: ${head.ended}.` : ""}`);
  drawBranch();
}
function steps(head, arrays) {
  state.steps = arrays;
  const where = head.differ && [...new Set(head.differ.map((f) => sig(f, 5)))].join(" to ");
  finished(`Steps at ${amplitude(head)}; ▲ upwards, ▽ downwards. ${where ? `They differ by more than 5 % at ${where} Hz: there it matters where the sine comes from.` : "Both ways show the same."}`);
  drawBranch();
}
const amplitude = (head) => `${sig(head.level, 4)} ${state.last.head.kind === "force" ? "N" : "m/s²"} amplitude`;
function drawBranch() {
  const series = [], data = [null], lines = state.branch ? state.branch.head.special.filter((p) => p.kind === "fold").map((p) => ({ x: p.frequency })) : [];
  for (const i of state.shown) {
    const look = { label: state.sensors[i], stroke: colour(i) };
    if (state.branch) {
      const { arrays } = state.branch;
      series.push(look);
      data.push([nulls(arrays.frequency), positive(row(arrays.amplitude, i)), Array.from(arrays.stable)]);
    }
    for (const way of state.steps ? ["up", "down"] : []) {
      series.push({ ...look, mark: way });
      data.push([Array.from(state.steps.frequency), positive(row(state.steps[way], i))]);
    }
  }
  charts.branch.show(series, data, lines);
}
function sweep(head, arrays) {
  state.sweep = { head, arrays };
  finished(head.failed ? `At some values: ${head.failed}` : "Every value is simulated as the setting above.");
  drawSweep();
}
function drawSweep() {
  if (!state.sweep) return;
  const { head, arrays } = state.sweep, control = state.controls.find((c) => c.name === head.name);
  state.sweptLabel = `${control.label}${control.unit ? ` (${control.unit})` : ""}`;
  const x = Array.from(arrays.at, (v) => v * control.scale), shown = [...state.shown];
  for (const chart of [charts.share, charts.rms]) chart.options.logX = head.log;
  charts.share.show(state.clearances.map((label, i) => ({ label, stroke: colour(i) })), [null, ...state.clearances.map((_, i) => [x, Array.from(row(arrays.share, i), (v) => (Number.isFinite(v) ? 100 * v : null))])]);
  charts.rms.show(shown.map((i) => ({ label: state.sensors[i], stroke: colour(i) })), [null, ...shown.map((i) => [x, positive(row(arrays.rms, i))])]);
}
function sweepRange() {
  const control = state.controls.find((c) => c.name === $("sweep-name").value);
  $("sweep-low").value = sig(control.low * control.scale, 3);
  $("sweep-high").value = sig(control.high * control.scale, 3);
}
function saved(head, arrays, rest) {
  const link = make("a", { href: URL.createObjectURL(new Blob([rest], { type: "application/zip" })), download: "clearance-mj-live.zip" });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

// ---- what A and B sound like ----
let audio, playing;
function heard(head, arrays) {
  const kept = state.memory[head.slot];
  if (!kept || JSON.stringify(kept.values) !== JSON.stringify(head.values)) return;
  kept.sound = { rate: head.rate, samples: arrays.samples.slice(), of: head.of, unit: head.unit };
  $(`hear-${head.slot}`).disabled = false;
}
const peak = (samples) => samples.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
// One full scale for both, so that the louder one is heard louder.
function hear(slot) {
  const kept = state.memory[slot].sound;
  const scale = Math.max(...[..."AB"].map((s) => state.memory[s]?.sound).filter((s) => s && s.unit === kept.unit).map((s) => peak(s.samples))) || 1;
  audio ??= new AudioContext();
  if (playing) playing.stop();
  const buffer = audio.createBuffer(1, kept.samples.length, kept.rate);
  buffer.copyToChannel(kept.samples.map((value) => value / scale), 0);
  playing = audio.createBufferSource();
  playing.buffer = buffer;
  playing.connect(audio.destination);
  playing.start();
  told(`${slot}: ${kept.of}, full scale ${sig(scale, 3)} ${kept.unit}, peak ${sig(peak(kept.samples), 3)} ${kept.unit}`);
}

// ---- buttons ----
addEventListener("DOMContentLoaded", () => {
  $("controls").addEventListener("submit", (event) => event.preventDefault());
  $("reset").addEventListener("click", () => putAll(Object.fromEntries(state.controls.map((c) => [c.name, c.value]))));
  $("record").addEventListener("change", changed);
  $("export").addEventListener("click", () => send({ type: "export", record: $("record").value }));
  for (const slot of "AB") {
    $(`keep-${slot}`).addEventListener("click", () => {
      if (!state.last) return;
      state.memory[slot] = { values: { ...state.last.head.values }, arrays: state.last.arrays };
      $(`back-${slot}`).disabled = $(`over-${slot}`).disabled = false;
      $(`over-${slot}`).checked = true;
      $(`hear-${slot}`).disabled = true;
      send({ type: "hear", slot, sensor: Math.max(0, Math.min(...state.shown)) || 0 });
      draw();
    });
    $(`hear-${slot}`).addEventListener("click", () => hear(slot));
    $(`back-${slot}`).addEventListener("click", () => putAll(state.memory[slot].values));
    $(`over-${slot}`).addEventListener("change", draw);
  }
  $("branch-go").addEventListener("click", () => {
    const ends = asked("branch-low", "branch-high");
    begin("branch", ends && { low: ends[0], high: ends[1] });
  });
  $("steps-go").addEventListener("click", () => {
    const inputs = asked("branch-low", "branch-high", "steps-count", "steps-hold");
    begin("steps", inputs && { low: inputs[0], high: inputs[1], count: Math.max(0, Math.round(inputs[2])), hold: inputs[3] });
  });
  $("sweep-name").addEventListener("change", sweepRange);
  $("sweep-go").addEventListener("click", () => {
    const control = state.controls.find((c) => c.name === $("sweep-name").value);
    const inputs = asked("sweep-low", "sweep-high", "sweep-count");
    begin("sweep", inputs && { name: control.name, low: inputs[0] / control.scale, high: inputs[1] / control.scale, count: Math.max(0, Math.round(inputs[2])) });
  });
  for (const button of document.querySelectorAll(".cancel")) button.addEventListener("click", () => send({ type: "cancel" }));
  connect();
});
