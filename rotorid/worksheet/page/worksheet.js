/* The worksheet's page: it shows the state that the server sends, and sends every cell that changes.

For tests: data-cell="runs|RUN|SPEED|SENSOR|COLUMN" of a reading ("check|…"; "|2" behind it: its second repeat),
"weights|ROWID|COLUMN" of a weight ("check_weights|…"); data-key of an input: key of the job file,
"planes.left.radius_mm"; data-key of a .value: path in the document, "corrections.0.mass", its number in
data-value, the document in data-doc around it (answer, pieces, trim). data-run: card of a run, .gauge[data-run] its
effect; data-type, data-remove, data-add, data-import: its buttons; data-keep, data-write: buttons at a refused
cell. Ids: those of index.html, and convention-lead-with (…), add-check, check-others, missing, drop-empty. */

const $ = (id) => document.getElementById(id);
let token = location.hash.slice(1);
const typed = new Map(); // key of a cell → its change, until the state has it; with `why` if it was refused
const queue = []; // what is still to be sent, in order
let state = null;
let data = {}; // the tables of the state, read
let online = true;
let said = "all is saved";

/* Elements: `h` describes one, `patch` makes children so; focus and what is being typed stay. */

const h = (tag, props, ...children) => ({ tag, props, children: children.flat(4).filter((one) => one) });

function patch(parent, nodes) {
  const keys = nodes.map((node, i) => `${node.tag || "#"} ${node.props?.key ?? i}`);
  const kept = new Map([...parent.childNodes].map((child) => [child.vKey, child]));
  for (const child of [...parent.childNodes]) if (!keys.includes(child.vKey)) child.remove();
  nodes.forEach((node, i) => {
    const child = kept.get(keys[i]) || (node.tag ? document.createElement(node.tag) : new Text());
    child.vKey = keys[i];
    if (parent.childNodes[i] !== child) parent.insertBefore(child, parent.childNodes[i] || null);
    if (node.tag) update(child, node);
    else if (child.data !== node) child.data = node;
  });
}

function update(element, { props, children }) {
  if (!props?.own) patch(element, children); // others fill an `own` one
  for (const [name, value] of Object.entries(props || {})) {
    if (name === "cell" || name === "onclick") element[name] = value;
    else if (name === "value") setValue(element, value);
    else if (value === null || value === undefined) element.removeAttribute(name);
    else if (element.getAttribute(name) !== String(value)) element.setAttribute(name, value);
  }
}

function setValue(element, value) {
  if (element.saved !== undefined && element.value !== element.saved) return; // somebody is typing here
  if (element.value !== value) element.value = value;
  element.saved = value;
}

const show = (id, ...nodes) => patch($(id), h("", {}, nodes).children);
const tell = (text) => show("message", text && h("p", {}, text.message || text));
const button = (text, onclick, props) => h("button", { type: "button", onclick, ...props }, text);
const table = (heads, rows) => h("div", { class: "scroll" }, h("table", {}, h("thead", {}, heads.map((line) =>
  h("tr", {}, line.map(([text, colspan]) => h("th", { colspan }, text || "\u00a0"))))), h("tbody", {}, rows)));

/* The server. What changes the job is sent one after the other, and again when the program was away. */

async function ask(path, body) {
  const headers = { "X-Rotorid-Token": token, "Content-Type": "application/json" };
  const answer = await fetch(path, { headers, ...(body && { method: "POST", body: JSON.stringify(body) }) });
  if (answer.ok) return answer;
  const told = await answer.json().catch(() => ({ error: `${answer.status} ${answer.statusText}` }));
  throw Object.assign(new Error(told.error), { status: answer.status, now: told.now });
}

async function refresh(after) {
  const found = await (await ask(`/state?after=${after}`)).json();
  if (online && state && found.version < state.version) return; // the other request was faster
  online = true;
  state = found;
  data = Object.fromEntries(Object.entries(state.tables).map(([name, one]) => [name, read(one)]));
  render();
}

async function away(problem) {
  online = false;
  renderHeader();
  const why = token ? "This page belongs to a program that has ended." : "This address lacks its token.";
  if (problem.status === 403) tell(`${why} Open the address that “rotorid worksheet” shows now.`);
  await new Promise((resolve) => setTimeout(resolve, 1000));
}

function send(path, body) {
  tell("");
  return new Promise((done, failed) => {
    if (queue.push({ path, body, done, failed }) === 1) drain();
  });
}

async function drain() {
  for (; queue.length; renderHeader()) {
    const { path, body, done, failed } = queue[0];
    renderHeader();
    try {
      await ask(path, body);
      said = `saved ${new Date().toTimeString().slice(0, 8)}`;
      while (!(await refresh(-1).then(() => true, away)));
      done(queue.shift());
    } catch (problem) {
      if (problem.status && problem.status !== 403) failed(problem, queue.shift());
      else await away(problem);
    }
  }
}

const edit = (...edits) => send("/edit", { edits }).catch(tell);

/* Changes {cell, old, text} of cells, as one step. */
function save(changes) {
  const edits = changes.map(({ cell: { path, table: name, row, column }, old, text }) => path
    ? { key: path, old: jsonOf(path, old), new: jsonOf(path, text) }
    : { table: name, row, column, old, new: text });
  for (const change of changes) typed.set(change.cell.key, change);
  const forget = () => changes.filter(({ cell }) => changes.includes(typed.get(cell.key)))
    .forEach(({ cell }) => typed.delete(cell.key));
  const refuse = ({ message, now }) => Object.assign(changes[0], { why: message, now, changes });
  send("/edit", { edits }).then(forget, refuse).then(render);
}

/* The tables of the job. */

const number = (text) => Number(String(text).trim().replace(",", "."));
const each = (values) => [...new Set(values)].filter((value) => value);
const listOf = (text, by = /[,;]/) => each(text.split(by).map((one) => one.trim()));
const whatOf = (name) => name.replace(/^(mass|unbalance).*/, "weight").replace(/[_ ].*/, "");
const unitOf = (column) => (column || "").replace(/^(amplitude|speed|mass|unbalance)_?/, "").replace("um", "µm")
  .replace(/_(pp|rms)$/, " $1").replace(/(m|in)_s/, "$1/s").replace("_", "·");

function read({ header, rows, read_only: closed }) {
  const times = {};
  const named = (cells) => Object.fromEntries(header.map((name, i) => [whatOf(name), cells[i] || ""]));
  const found = rows.map(({ id, cells }) => {
    const row = { ...named(cells), id, cells };
    const place = `${row.run}|${row.speed}|${row.sensor}`;
    times[place] = (times[place] || 0) + 1;
    return { ...row, time: times[place] };
  });
  return { header, rows: found, closed, names: named(header) };
}

const allRows = (...tables) => tables.flatMap((name) => data[name]?.rows || []);
const rowsOf = (name, run) => allRows(name).filter((row) => row.run === run);
const valuesOf = (what, ...tables) => each(allRows(...tables).map((row) => row[what]));
const sensors = () => valuesOf("sensor", "runs", "check");
const runs = () => valuesOf("run", "runs", "weights");
const planes = () => each([...Object.keys(state.settings.planes || {}), ...valuesOf("plane", "weights")]);
const baseline = () =>
  state.results.runs?.baseline || runs().find((run) => !rowsOf("weights", run).length) || "baseline";
const usual = () => rowsOf("runs", baseline()).filter((row) => row.time === 1);
const remove = (name, rows) => rows.map((row) => ({ table: name, delete: row.id, old: row.cells }));
const add = (name, cells, after = null) => ({ table: name, after, cells });
const addRows = (name, run, places, speedName = data.runs?.names.speed) =>
  places.map(({ speed, sensor }) => add(name, { run, [speedName]: speed, sensor }));

function cellOf(name, row, what, more) {
  const column = data[name].names[what];
  const place = row.sensor ? [row.run, row.speed, row.sensor, column] : [row.id, column];
  const key = [name, ...place, ...(row.sensor && row.time > 1 ? [row.time] : [])].join("|");
  return { key, table: name, row: row.id, what, column, text: row[what], label: `${what}, ${row.run}, ${more}` };
}

/* Values of the job file: numbers, words, lists "5; 10", values by speed "3000: 20; 4500: 30". */

const settingOf = (path) => path.reduce((one, key) => one?.[key], state.settings);

function textOf(value) {
  if (value === null || typeof value !== "object") return String(value ?? "");
  return (Array.isArray(value) ? value : Object.entries(value).map((pair) => pair.join(": "))).join("; ");
}

function jsonOf(path, text) {
  const one = (word) => (Number.isNaN(number(word)) ? word.trim() : number(word));
  const parts = listOf(text, /;/);
  if (text === textOf(settingOf(path))) return settingOf(path) ?? null;
  if (text.includes(":")) return Object.fromEntries(parts.map((part) => part.split(":").map(one)));
  if (parts.length > 1 || (text && /^(available|stock|holes_)/.test(path.at(-1)))) return parts.map(one);
  return text ? one(text) : null;
}

function setting(above, begin, usualName, label) {
  const name = Object.keys(settingOf(above) || {}).find((key) => key.startsWith(begin)) || usualName;
  const path = [...above, name];
  return { key: path.join("."), path, text: textOf(settingOf(path)), label: `${label}, ${above[1]}` };
}

/* Cells to type in. */

const problems = (missing) => state.results.problems.filter((one) => one.missing === missing);
const idOf = (cell) => encodeURIComponent(cell.key);
const textNow = (cell) => cell.path ? textOf(settingOf(cell.path))
  : allRows(cell.table).find((row) => row.id === cell.row)?.[cell.what] ?? "";
const whyOf = ({ key, table: name, row, column }) => typed.get(key)?.why || (row && problems(false).find((one) =>
  one.table === name && one.row === row && (one.column || column) === column)?.text);

function field(cell) {
  const why = whyOf(cell);
  return h("input", {
    id: idOf(cell), cell, value: typed.get(cell.key)?.text ?? cell.text, "aria-label": cell.label,
    [cell.path ? "data-key" : "data-cell"]: cell.key, "data-at": `${cell.table} ${cell.row} ${cell.column}`,
    inputmode: cell.list ? "text" : "decimal", list: cell.list, autocomplete: "off",
    disabled: state.read_only || data[cell.table]?.closed ? "" : null,
    "aria-invalid": why ? "true" : null, "aria-describedby": why ? `why-${idOf(cell)}` : null,
  });
}

function whyLine(cell) {
  const { changes, now, text = "" } = typed.get(cell.key) || {};
  const quoted = (word) => word || "nothing";
  const keep = () => {
    changes.forEach((change) => typed.delete(change.cell.key));
    render();
  };
  const write = () => save(changes.map((one) => ({ cell: one.cell, text: one.text, old: textNow(one.cell) })));
  return h("p", { key: cell.key, class: "why", id: `why-${idOf(cell)}` }, `${cell.label}: `, now === undefined
    ? whyOf(cell) : `another window (or program) wrote ${quoted(now)} here; you typed ${quoted(text)}. `,
  changes && [button(`Keep ${quoted(textNow(cell))}`, keep, { "data-keep": cell.key }),
    button(`Write ${quoted(text)}`, write, { "data-write": cell.key })]);
}

/* A table of cells; each line is [heading, cells, what stands behind them]. */
function cellTable(heads, lines) {
  const rows = lines.map(([head, cells, behind]) => h("tr", { key: cells.find((cell) => cell)?.key },
    h("th", { scope: "row" }, head), cells.map((cell) => h("td", {}, cell ? field(cell) : "–")),
    behind && h("td", {}, behind)));
  const wrong = lines.flatMap((line) => line[1]).filter((cell) => cell && whyOf(cell));
  return h("div", { key: lines[0]?.[1][0]?.key }, table(heads, rows), wrong.map(whyLine));
}

function grid(name, run) {
  const { amplitude, speed: speedName } = data[name].names;
  const own = rowsOf(name, run).sort((a, b) => number(a.speed) - number(b.speed) || a.time - b.time);
  const lines = each(own.map(({ speed, time }) => `${speed}|${time}`)).map((place) => {
    const [speed, time] = place.split("|");
    const label = `${speed} ${unitOf(speedName)}${time > 1 ? `, repeat ${time}` : ""}`;
    return [speed, sensors().flatMap((sensor) => {
      const row = own.find((one) => one.sensor === sensor && `${one.speed}|${one.time}` === place);
      return ["amplitude", "phase"].map((what) => row && cellOf(name, row, what, `${sensor}, ${label}`));
    })];
  });
  const units = sensors().flatMap(() => [[unitOf(amplitude)], ["°"]]);
  return cellTable([[[unitOf(speedName)], ...sensors().map((sensor) => [sensor, 2])], [[""], ...units]], lines);
}

function weights(name, run) {
  const own = rowsOf(name, run);
  const lines = own.map((row, i) => {
    const cells = ["plane", "weight", "angle"].map((what) => cellOf(name, row, what, `weight ${i + 1}`));
    cells[0].list = "planes";
    const label = { "aria-label": `Remove weight ${i + 1} of ${run}` };
    return [`${i + 1}`, cells, button("Remove", () => edit(...remove(name, [row])), label)];
  });
  const heads = [["Mounted"], ["plane"], [unitOf(data[name].names.weight)], ["at °"], [""]];
  return [own.length > 0 && cellTable([heads], lines),
    button("Add a weight", () => edit(add(name, { run }, own.at(-1)?.id)), { "data-add": run })];
}

function card(name, run) {
  const mounted = name === "runs" ? "weights" : "check_weights";
  const free = run === baseline();
  const all = () => [...remove(name, rowsOf(name, run)), ...remove(mounted, rowsOf(mounted, run))];
  const drop = () => confirm(`Remove ${run} with its readings and weights?`) && edit(...all());
  return h("article", { key: run, "data-run": run }, !free && h("h3", {}, run),
    !free && data[mounted] && weights(mounted, run),
    rowsOf(name, run).length ? grid(name, run)
      : button("Type its readings", () => edit(...addRows(name, run, usual())), { "data-type": run }),
    name === "runs" && h("label", { class: "button" }, "Take from a file…",
      h("input", { type: "file", class: "unseen", "data-import": run })),
    !free && button("Remove this run", drop, { "data-remove": run }));
}

/* The steps. */

function renderMachine() {
  const column = data.weights?.names.weight || $("setup-weight-unit").value;
  const unit = unitOf(column);
  const keys = [["max_", `max_${column}`, `largest, ${unit}`], ["radius_", "radius_mm", "radius, mm"],
    ["holes", "holes", "holes"], ["first_hole", "first_hole_deg", "first hole, °"], ["per_hole", "per_hole", "per hole"],
    ["available", column.replace(/mass|unbalance/, "available"), `pieces, ${unit}`], ["stock", "stock", "stock"]];
  const lines = planes().map((plane) => [plane, keys.map((key) => setting(["planes", plane], ...key))]);
  const limits = sensors().map((sensor) => setting(["sensors", sensor], "limit", "limit", "largest amplitude"));
  const closed = [state.read_only, ...Object.values(data).map((one) => one.closed)];
  $("setup").open ||= !data.runs;
  $("new-unit").hidden = Boolean(data.weights);
  show("planes", planes().map((plane) => h("option", { value: plane })));
  show("machine", each(closed).map((text) => h("p", { class: "why" }, text)),
    lines.length > 0 && cellTable([[["planes"], ...keys.map((key) => [key[2]])]], lines),
    limits.length > 0 && cellTable([[["sensors"], ...sensors().map((one) => [one])]], [["largest", limits]]));
}

function renderConventions() {
  const { phase, angles } = state.settings;
  const four = [["lead", "with"], ["lead", "against"], ["lag", "with"], ["lag", "against"]];
  show("convention-said", phase && angles ? `The job says: phase ${phase}, angles ${angles}.`
    : "Not chosen yet. Until then the answer assumes that phase leads and angles count with rotation.");
  show("conventions", four.map(([way, side]) => button(
    [h("b", {}, `Phase ${way}s, angles ${side} rotation`), h("div", { id: `drawing-${way}-${side}`, own: "" })],
    () => edit({ key: ["phase"], old: phase ?? null, new: way },
      { key: ["angles"], old: angles ?? null, new: `${side} rotation` }),
    { id: `convention-${way}-${side}`, "aria-pressed": phase === way && angles === `${side} rotation` })));
  for (const [way, side] of four) draw(`drawing-${way}-${side}`, `/convention/${way}-${side}`);
}

function renderRuns() {
  const trials = runs().filter((run) => run !== baseline());
  const checks = valuesOf("run", "check");
  const create = () => edit({ create: "check", header: data.runs.header }, ...addRows("check", "check", usual()));
  const others = () => edit({ create: "check_weights", header: data.weights.header },
    ...planes().map((plane) => add("check_weights", { run: checks[0], plane })));
  show("baseline", data.runs ? card("runs", baseline()) : "First make the table, in step 1.");
  show("runs", trials.map((run) => card("runs", run)));
  $("new-run").hidden = !data.runs;
  setValue($("new-name"), `trial ${trials.length + 1}`);
  show("check", checks.map((run) => card("check", run)),
    data.runs && !data.check && button("Add a check run", create, { id: "add-check" }),
    data.check && data.weights && !data.check_weights && h("p", {}, "Were the proposed weights mounted? If not: ",
      button("Other weights were mounted", others, { id: "check-others" })));
}

/* The answer: every number of a document stands with its path. */

const at = (doc, path) => path.split(".").reduce((one, key) => one?.[key], doc);

function value(doc, path, std) {
  const raw = at(doc, path);
  const size = Math.floor(Math.log10(Math.abs(std || raw) || 1));
  const text = typeof raw === "number" ? raw.toFixed(Math.min(Math.max((std ? 1 : 2) - size, 0), 6)) : raw ?? "–";
  return h("span", { class: "value", "data-key": path, "data-value": raw, title: `${path}: ${raw}` }, String(text));
}

/* Rows of a list in a document; a column is [heading, key, key of its ±]. */
function listing(doc, path, heads, order = Object.keys(at(doc, path))) {
  const rows = order.map((i) => h("tr", {}, heads.map(([, key, std]) => {
    const error = at(doc, `${path}.${i}`)[std];
    return h("td", {}, value(doc, `${path}.${i}.${key}`, error), error && [" ± ", value(doc, `${path}.${i}.${std}`, error)]);
  })));
  return table([heads.map((head) => [head[0]])], rows);
}

function answer(name, title, { document: doc, judgement, warnings, notes }) {
  const [weight, vibration] = [doc.conventions.weight_unit, doc.conventions.vibration_unit].map(unitOf);
  const holes = doc.mounting?.holes;
  const list = name === "trim" ? "add_to_mounted" : holes ? "mounting.holes" : "corrections";
  const what = holes ? [["hole", "hole"], [weight, "pieces"]] : [[weight, "mass", "mass_std"]];
  const left = doc.mounting ? "mounting.residuals" : "residuals";
  const after = (i) => at(doc, left)[i].after;
  const largest = Object.keys(at(doc, left)).sort((a, b) => after(b) - after(a)).slice(0, 5);
  return h("section", { key: name, "data-doc": name }, h("h3", {}, title), h("p", {}, judgement),
    listing(doc, list, [["plane", "plane"], ["", "action"], ...what, ["at °", "angle_deg", "angle_std_deg"]]),
    listing(doc, left, [["largest left", "sensor"], ["rpm", "speed_rpm"], [vibration, "after"]], largest),
    doc.check && h("p", { class: "verdict" }, "Check run: ", value(doc, "check.verdict"), "; rms ",
      value(doc, "check.rms_before"), " → ", value(doc, "check.rms_achieved"),
      ", predicted ", value(doc, "check.rms_predicted")),
    warnings.map((one) => h("p", {}, h("b", {}, "Warning: "), one)), notes.map((one) => h("p", {}, `Note: ${one}`)));
}

/* What is not typed yet, counted for each run: "3 phases of trial 2". */
function missing() {
  const groups = {};
  for (const one of problems(true)) {
    const row = allRows(one.table).find(({ id }) => id === one.row);
    const text = row ? [whatOf(one.column || "reading"), `of ${row.run}`] : [one.text];
    (groups[text] ||= { ...one, words: text, count: 0 }).count += 1;
  }
  return Object.values(groups).map((one) => ({ ...one, text: one.words.length === 1 ? one.words[0]
    : `${one.count} ${one.words[0]}${one.count > 1 ? "s" : ""} ${one.words[1]}` }));
}

function renderNow() {
  const { refused, pieces, trim, answer: first } = state.results;
  const best = trim || pieces || first;
  const refusals = [...typed.values()].filter((one) => one.why).map(({ cell, why }) => ({ ...cell, text: why }));
  const go = (one) => document.querySelector(`[data-at^="${one.table} ${one.row} ${one.column || ""}"]`).focus();
  const list = (those) => h("ul", {}, those.map((one) =>
    h("li", {}, one.row ? button(one.text, () => go(one), { class: "link" }) : one.text)));
  const [wrong, left] = [[...problems(false), ...refusals], missing()];
  const empty = allRows("runs").filter((row) => !row.amplitude && !row.phase);
  show("now", h("h2", {}, best ? "Answer" : "So far"), best && h("p", { class: "judgement" }, best.judgement),
    wrong.length > 0 && h("div", { class: "why", key: "wrong" }, list(wrong)), refused && h("p", {}, refused),
    left.length > 0 && h("div", { id: "missing", key: "missing" }, "Still missing:", list(left), empty.length > 0
      && button("Not measured: remove the empty rows", () => edit(...remove("runs", empty)), { id: "drop-empty" })));
}

function renderAnswer() {
  const { runs: found, pictures, ...documents } = state.results;
  const titles = { answer: "Weights", pieces: "Pieces in the holes", trim: "Trim after the check run" };
  const channels = found?.channels || [];
  for (const key of ["speed", "sensor"]) {
    show(`channel-${key}`, each(channels.map((one) => one[key])).map((one) => h("option", { key: one }, one)));
  }
  $("live").hidden = !channels.length;
  const [speed, sensor] = ["channel-speed", "channel-sensor"].map((id) => encodeURIComponent($(id).value));
  draw("polar", channels.length && `/picture/runs?speed=${speed}&sensor=${sensor}&v=${state.version}`);
  show("gauges", (found?.runs || []).map(({ run, level, words, share_percent: share }) => h("div",
    { key: run, class: level, "data-run": run }, h("p", {}, h("b", {}, `${run}: ${level}. `), words),
    h("div", { role: "meter", "aria-label": `effect of ${run}, percent`, "aria-valuenow": Math.min(share, 100),
      "aria-valuemin": 0, "aria-valuemax": 100 },
      h("div", { style: `width: ${Math.min(share, 100)}%` })))));
  show("answer", Object.entries(titles).map(([name, title]) => documents[name] && answer(name, title, documents[name])));
  for (const name of ["discs", "overview"]) draw(name, pictures[name] && `/picture/${name}?v=${pictures[name]}`);
}

async function draw(id, address) {
  const slot = $(id);
  slot.hidden = !address;
  if (!address || slot.address === address) return;
  slot.address = address;
  await new Promise((next) => setTimeout(next, 150)); // who goes through the cells wants the last one
  if (slot.address !== address) return;
  const svg = await ask(address).then((found) => found.text(), () => "");
  if (slot.address === address) slot.innerHTML = svg;
}

function renderHeader() {
  const lost = `not saved — the program is not running${queue.length ? `; ${queue.length} waiting here` : ""}`;
  $("saved").textContent = online ? (queue.length ? "saving…" : said) : lost;
  $("saved").classList.toggle("why", !online);
}

function render() {
  renderHeader();
  $("job").textContent = `${state.folder} / ${state.job}`;
  $("busy").textContent = state.results.busy;
  show("notice", state.notice && h("p", {}, state.notice));
  for (const id of ["undo", "redo"]) $(id).disabled = !state[id];
  for (const part of [renderMachine, renderConventions, renderRuns, renderNow, renderAnswer]) part();
}

/* What a person does. */

document.addEventListener("change", ({ target }) => {
  if (target.files) take(target);
  if (target.id.startsWith("channel")) renderAnswer();
  if (!target.cell || target.value === target.saved) return;
  const old = typed.get(target.cell.key)?.why ? textNow(target.cell) : target.saved;
  target.saved = target.value;
  save([{ cell: target.cell, old, text: target.value.trim() }]);
});

document.addEventListener("keydown", (event) => {
  const { target, key } = event;
  const step = { Enter: 1, ArrowDown: 1, ArrowUp: -1 }[key];
  if (target.cell && step) {
    const column = `td:nth-child(${target.parentNode.cellIndex + 1}) > input`;
    const cells = [...target.closest("table").querySelectorAll(column)];
    const next = cells[cells.indexOf(target) + step];
    if (next) event.preventDefault();
    next?.select();
  } else if (key.toLowerCase() === "z" && (event.ctrlKey || event.metaKey)) {
    if (target.matches("input") && target.value !== (target.saved ?? "")) return;
    event.preventDefault();
    send(event.shiftKey ? "/redo" : "/undo", {}).catch(tell);
  }
});

document.addEventListener("focusin", ({ target }) => {
  const [name, , speed, sensor] = target.dataset.cell?.split("|") || [];
  if ($("live").hidden || !["runs", "check"].includes(name)) return;
  $("channel-speed").value = speed;
  $("channel-sensor").value = sensor;
  renderAnswer();
});

document.addEventListener("paste", (event) => {
  const { target } = event;
  const text = event.clipboardData.getData("text").replace(/[\r\n]+$/, "");
  const lines = text.split(/\r?\n/).map((line) => line.split(text.includes("\t") ? "\t" : ";"));
  if (!target.cell?.row || (lines.length < 2 && lines[0].length < 2)) return;
  event.preventDefault();
  const rows = [...target.closest("tbody").rows].slice(target.closest("tr").sectionRowIndex);
  const words = lines.flatMap((line, i) => line.map((word, j) =>
    [word.trim(), rows[i]?.cells[target.parentNode.cellIndex + j]?.querySelector("input")])).filter(([word]) => word);
  const fit = words.filter(([, input]) => input);
  save(fit.map(([word, input]) => ({ cell: input.cell, old: input.saved, text: word })));
  for (const [word, input] of fit) input.value = input.saved = word;
  if (words.length > fit.length) tell(`Not written: ${words.length - fit.length} values outside of the table.`);
});

async function take(input) {
  const [file] = input.files;
  const bytes = Array.from(new Uint8Array(await file.arrayBuffer()), (byte) => String.fromCharCode(byte));
  const content = { table: "runs", run: input.dataset.import, name: file.name, data: btoa(bytes.join("")) };
  input.value = "";
  send("/import", content).catch(tell);
}

function makeRows() {
  const header = ["run", $("setup-speed-unit").value, "sensor", $("setup-amplitude-unit").value, "phase_deg"];
  const places = listOf($("setup-speeds").value).flatMap((speed) =>
    listOf($("setup-sensors").value).map((sensor) => ({ speed, sensor })));
  if (data.runs) edit(...runs().flatMap((run) => addRows("runs", run, places)));
  else edit({ create: "runs", header }, ...addRows("runs", "baseline", places, header[1]));
}

function addRun() {
  const [run, plane, unit] = ["new-name", "new-plane", "setup-weight-unit"].map((id) => $(id).value.trim());
  const create = { create: "weights", header: ["run", "plane", unit, "angle_deg"] };
  edit(...(data.weights ? [] : [create]), add("weights", { run, plane }), ...addRows("runs", run, usual()));
}

async function propose() {
  const options = { with_job: $("trial-with-job").checked };
  for (const { name, value: text, dataset } of options.with_job ? [] : $("trial").querySelectorAll("[name]")) {
    if (text) options[name] = dataset.unit ? number(text) + dataset.unit : number(text) || text;
  }
  const found = await ask("/trial", { options }).then((one) => one.json(), ({ message }) => ({ judgement: message }));
  const words = [found.judgement, found.found, ...(found.warnings || []), ...(found.notes || [])];
  show("trial-answer", words.map((one) => one && h("p", {}, one)));
  $("trial-picture").innerHTML = found.picture || "";
}

async function open({ target }) {
  const opened = window.open("", "_blank");
  const found = await ask(target.dataset.opens).then((one) => one.blob(), tell);
  if (found) opened.location = URL.createObjectURL(found);
  else opened.close();
}

for (const [id, act] of [["setup-form", makeRows], ["trial", propose], ["new-run", addRun]]) {
  $(id).addEventListener("submit", (event) => act(event.preventDefault()));
}
for (const id of ["undo", "redo"]) $(id).onclick = () => send(`/${id}`, {}).catch(tell);
for (const id of ["print", "whole"]) $(id).onclick = open;
window.addEventListener("hashchange", () => tell((token = location.hash.slice(1)) && ""));
window.addEventListener("beforeunload", (event) => queue.length && event.preventDefault());
for (;;) await refresh(online && state ? state.version : -1).catch(away);
