/* The worksheet's page: it shows the state that the server sends, and sends every cell that changes.
For tests: data-cell "runs|RUN|SPEED|SENSOR|COLUMN" is a reading ("check|…"; "1220 (2)": a repeat), and
"weights|ROWID|COLUMN" a weight ("check_…"); data-key a key of the job or, of a .value, the path in the document
of data-doc, its number in data-value; data-run a run's card or gauge; others (data-add, …) are on buttons. */
const $ = (id) => document.getElementById(id);
let token = location.hash.slice(1);
const typed = new Map(); // key of a cell → its change, until the state has it; with `why` if it was refused
const queue = []; // what is still to be sent, in order
let state = null;
let data = {}; // the tables of the state, read
let online = true;
let savedWords = "all is saved";
let focused = {}; // speed and sensor of the cell that was entered last

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
    if (!node.tag && child.data !== node) child.data = node;
    if (node.tag && !node.props.filled) patch(child, node.children); // others fill a `filled` one
    for (const [name, value] of Object.entries(node.props || {})) put(child, name, value);
  });
}

function put(element, name, value) {
  if (name === "value" && element.value !== (element.saved ?? element.value)) return; // somebody types here
  if (name === "value") element.value = element.saved = value;
  else if (name === "cell" || name === "onclick") element[name] = value;
  else if (value === null || value === undefined) element.removeAttribute(name);
  else if (element.getAttribute(name) !== String(value)) element.setAttribute(name, value);
}
const show = (id, ...nodes) => patch($(id), h("", {}, nodes).children);
const tell = (text) => show("message", text && h("p", {}, text.message || text));
const button = (text, onclick, props) => h("button", { type: "button", onclick, ...props }, text);
const heading = (line) => h("tr", {}, line.map(([text, colspan]) => h("th", { colspan }, text || "\u00a0")));
const table = (heads, rows) => h("div", { class: "scroll" },
  h("table", {}, h("thead", {}, heads.map(heading)), h("tbody", {}, rows)));

/* The server. What changes the job is sent one after the other, and again when the program was away. */
async function ask(path, body) {
  const headers = { "X-Rotorid-Token": token, "Content-Type": "application/json" };
  const answer = await fetch(path, { headers, ...(body && { method: "POST", body: JSON.stringify(body) }) });
  if (answer.ok) return answer;
  const refusal = await answer.json().catch(() => ({ error: `${answer.status} ${answer.statusText}` }));
  throw Object.assign(new Error(refusal.error), { status: answer.status, now: refusal.now });
}

async function refresh(after) {
  const news = await (await ask(`/state?after=${after}`)).json();
  if (online && state && news.version < state.version) return; // the other request was faster
  const first = !state;
  online = true;
  state = news;
  if (first) restoreTrial();
  data = Object.fromEntries(Object.entries(state.tables).map(([name, one]) => [name, read(one)]));
  render();
}

async function away({ status }) {
  online = false;
  renderHeader();
  if (status === 403) tell("This address is of no running worksheet: open the one that the program shows.");
  await new Promise((resolve) => setTimeout(resolve, 1000));
}

const send = (path, body) => new Promise((done, failed) => {
  tell("");
  if (queue.push({ path, body, done, failed }) === 1) drain();
  renderHeader();
});
const edit = (...edits) => send("/edit", { edits }).catch(tell);

async function drain() {
  for (; queue.length; renderHeader()) {
    const { path, body, done, failed } = queue[0];
    try {
      await ask(path, body);
      savedWords = `saved ${new Date().toTimeString().slice(0, 8)}`;
      while (!(await refresh(-1).then(() => true, away)));
      done(queue.shift());
    } catch (problem) {
      if (problem.status && problem.status !== 403) failed(problem, queue.shift());
      else await away(problem);
    }
  }
}

/* Changes {cell, old, text} of cells, as one step; what was refused before replaces what is there now. */
function save(changes) {
  const again = changes.some(({ cell }) => typed.get(cell.key)?.why);
  const edits = changes.map(({ cell, old: shown, text }) => {
    const { path, table: name, row, column } = cell;
    const old = again ? textNow(cell) : shown;
    return path ? { key: path, old: jsonOf(path, old), new: jsonOf(path, text) }
      : { table: name, row, column, old, new: text };
  });
  const drop = () => changes.forEach((one) => typed.get(one.cell.key) === one && typed.delete(one.cell.key));
  const refuse = ({ message, now }) => Object.assign(changes[0], { why: message, now, changes, drop });
  changes.forEach((one) => typed.set(one.cell.key, one));
  send("/edit", { edits }).then(drop, refuse).then(render);
}

/* Words of the page for the keys of files. */
const ERRORS = { amplitude_percent: "reading, %", phase_deg: "phase, °", run_percent: "run to run, %",
  placement_deg: "place of a weight, °", placement_percent: "weight, %" };
const WORDS = { ...ERRORS, "[errors]": "errors", check_weights: "weights of the check run", max_weight: "largest" };
const inWords = (text) => Object.entries(WORDS).reduce((all, [key, word]) => all.replaceAll(key, `“${word}”`), text);

/* The tables of the job. */
const number = (text) => Number(String(text).trim().replace(",", "."));
const each = (values) => [...new Set(values)].filter((value) => value);
const partsOf = (text, by) => text.split(by).map((one) => one.trim()).filter((one) => one);
const whatOf = (name) => name.replace(/^(mass|unbalance).*/, "weight").replace(/[_ ].*/, "");
const unitOf = (column) => (column || "").replace(/^(amplitude|speed|mass|unbalance)_?/, "")
  .replace("um", "µm").replace(/_(pp|rms)$/, " $1").replace(/(m|in)_s/, "$1/s").replace("_", "·");

function read({ header, rows, read_only: closed }) {
  const times = {};
  const named = (cells) => Object.fromEntries(header.map((name, i) => [whatOf(name), cells[i] || ""]));
  const placed = (row) => {
    const time = (times[[row.run, row.speed, row.sensor]] ||= []).push(row);
    return { ...row, place: time > 1 ? `${row.speed} (${time})` : row.speed };
  };
  const shown = rows.map(({ id, cells }) => placed({ ...named(cells), id, cells }));
  return { header, closed, names: named(header), rows: shown };
}
const allRows = (...tables) => tables.flatMap((name) => data[name]?.rows || []);
const rowsOf = (name, run) => allRows(name).filter((row) => row.run === run);
const valuesOf = (what, ...tables) => each(allRows(...tables).map((row) => row[what]));
const sensors = () => valuesOf("sensor", "runs", "check");
const runs = () => valuesOf("run", "runs", "weights");
const planes = () => each([...Object.keys(state.settings.planes || {}), ...valuesOf("plane", "weights")]);
const baseline = () =>
  state.results.runs?.baseline || runs().find((run) => !rowsOf("weights", run).length) || "baseline";
const isEmpty = (row) => row.amplitude === "" && row.phase === "";
const usual = () => rowsOf("runs", baseline()).filter((row) => row.place === row.speed);
const remove = (name, rows) => rows.map((row) => ({ table: name, delete: row.id, old: row.cells }));
const add = (name, cells, after = null) => ({ table: name, after, cells });
const create = (name, { header }) => ({ create: name, header });
const addRows = (name, run, places, speedName = data.runs.names.speed) =>
  places.map(({ speed, sensor }) => add(name, { run, [speedName]: speed, sensor }));

function cellOf(name, row, what, more) {
  const column = data[name].names[what];
  const key = [name, ...(row.sensor ? [row.run, row.place, row.sensor] : [row.id]), column].join("|");
  const label = `${what}, ${row.run}, ${more}`;
  return { key, table: name, row: row.id, what, column, text: row[what], label };
}

/* Values of the job file: numbers, words, lists "5; 10", values by speed "3000: 20; 4500: 30". */
const at = (doc, path) => path.reduce((one, key) => one?.[key], doc);
const textOf = (value) => value === null || typeof value !== "object" ? String(value ?? "")
  : (Array.isArray(value) ? value : Object.entries(value).map((pair) => pair.join(": "))).join("; ");

function jsonOf(path, text) {
  const now = at(state.settings, path);
  const one = (word) => (Number.isNaN(number(word)) ? word.trim() : number(word));
  const parts = partsOf(text, ";");
  if (text === textOf(now)) return now ?? null;
  if (text.includes(":")) return Object.fromEntries(parts.map((part) => part.split(":").map(one)));
  if (parts.length > 1 || (text && /^(available|stock|holes_)/.test(path.at(-1)))) return parts.map(one);
  return text ? one(text) : null;
}

function setting(top, begin, usualName, label) {
  const there = Object.keys(at(state.settings, top) || {}).find((key) => key.startsWith(begin));
  const path = [...top, there || usualName];
  const text = textOf(at(state.settings, path));
  return { key: path.join("."), path, text, label: `${label}, ${top.at(-1)}` };
}

/* Cells to type in. */
const problems = (missing) => state.results.problems.filter((one) => one.missing === missing);
const idOf = (cell) => encodeURIComponent(cell.key);
const textNow = (cell) => cell.path ? textOf(at(state.settings, cell.path))
  : allRows(cell.table).find((row) => row.id === cell.row)?.[cell.what] ?? "";
const isAt = (problem, { table: name, row, column }) =>
  row && problem.table === name && problem.row === row && (problem.column || column) === column;
const whyOf = (cell) => typed.get(cell.key)?.why || problems(false).find((one) => isAt(one, cell))?.text;

const field = (cell, why = whyOf(cell)) => h("input", {
  id: idOf(cell), cell, value: typed.get(cell.key)?.text ?? cell.text, "aria-label": cell.label,
  [cell.path ? "data-key" : "data-cell"]: cell.key, "data-at": `${cell.table} ${cell.row} ${cell.column}`,
  inputmode: cell.list ? "text" : "decimal", list: cell.list, autocomplete: "off",
  disabled: state.read_only || data[cell.table]?.closed ? "" : null,
  "aria-invalid": why ? "true" : null, "aria-describedby": why ? `why-${idOf(cell)}` : null,
});

function whyLine(cell) {
  const { changes, now, drop, text: mine = "" } = typed.get(cell.key) || {};
  const theirs = textNow(cell);
  const write = () => save(changes.map((one) => ({ cell: one.cell, text: one.text })));
  return h("p", { key: cell.key, class: "why", id: `why-${idOf(cell)}` }, `${cell.label}: `, now === undefined
    ? whyOf(cell) : `another window (or program) wrote “${theirs}” here; you typed “${mine}”. `,
  changes && button(`Keep “${theirs}”`, () => render(drop()), { "data-keep": cell.key }),
  changes && button(`Write “${mine}”`, write, { "data-write": cell.key }));
}

/* A table of cells; each line is [heading, cells, what stands behind them]. */
function cellTable(heads, lines) {
  const rows = lines.map(([head, cells, behind]) => h("tr", { key: cells.find((cell) => cell)?.key },
    h("th", { scope: "row" }, head), cells.map((cell) => h("td", {}, cell ? field(cell) : "–")),
    behind && h("td", {}, behind)));
  const wrong = lines.flatMap((line) => line[1]).filter((cell) => cell && whyOf(cell));
  return lines.length > 0 && h("div", {}, table(heads, rows), wrong.map(whyLine));
}

function grid(name, run) {
  const { amplitude, speed } = data[name].names;
  const rows = rowsOf(name, run).sort((a, b) => number(a.speed) - number(b.speed));
  const lines = each(rows.map((row) => row.place)).map((place) => [place, sensors().flatMap((sensor) => {
    const row = rows.find((one) => one.sensor === sensor && one.place === place);
    const label = `${sensor}, ${place} ${unitOf(speed)}`;
    return ["amplitude", "phase"].map((what) => row && cellOf(name, row, what, label));
  })]);
  const units = sensors().flatMap(() => [[unitOf(amplitude)], ["°"]]);
  return cellTable([[[unitOf(speed)], ...sensors().map((sensor) => [sensor, 2])], [[""], ...units]], lines);
}

function weights(name, run) {
  const rows = rowsOf(name, run);
  const columns = ["plane", "weight", "angle", ...(data[name].names.action ? ["action"] : [])];
  const lines = rows.map((row, i) => {
    const label = `weight ${i + 1}`;
    const [plane, ...more] = columns.map((what) => cellOf(name, row, what, label));
    return [`${i + 1}`, [{ ...plane, list: "planes" }, ...more],
      button("Remove", () => edit(...remove(name, [row])), { "aria-label": `Remove ${label} of ${run}` })];
  });
  const heads = ["mounted", "plane", unitOf(data[name].names.weight), "at °", ...columns.slice(3), ""];
  const more = () => edit(add(name, { run }, rows.at(-1)?.id));
  return [cellTable([heads.map((word) => [word])], lines), button("Add a weight", more, { "data-add": run })];
}

function card(name, run) {
  const mounted = name === "runs" ? "weights" : "check_weights";
  const free = run === baseline();
  const all = () => [name, mounted].flatMap((one) => remove(one, rowsOf(one, run)));
  const drop = () => confirm(`Remove ${run} with its readings and weights?`) && edit(...all());
  return h("article", { key: run, "data-run": run }, !free && h("h3", {}, run),
    !free && data[mounted] && weights(mounted, run),
    grid(name, run),
    !free && button("Remove this run", drop, { "data-remove": run }));
}

/* The steps. */
function renderMachine() {
  const column = data.weights?.names.weight || $("setup-weight-unit").value;
  const [unit, pieces] = [unitOf(column), column.replace(/mass|unbalance/, "available")];
  const keys = [["max_", `max_${column}`, `largest, ${unit}`], ["radius_", "radius_mm", "radius, mm"],
    ["holes", "holes", "holes"], ["first_hole", "first_hole_deg", "first hole, °"],
    ["available", pieces, `pieces, ${unit}`], ["per_", "per_hole", "per hole"], ["stock", "stock", "stock"]];
  const lines = planes().map((plane) => [plane, keys.map((key) => setting(["planes", plane], ...key))]);
  const limits = sensors().map((sensor) => setting(["sensors", sensor], "limit", "limit", "largest"));
  const errors = Object.entries(ERRORS).map(([key, label]) => setting(["errors"], key, key, label));
  const closed = each([state.read_only, ...Object.values(data).map((one) => one.closed)]);
  if (!data.runs && !queue.length) $("setup").open = true;
  $("new-unit").hidden = Boolean(data.weights);
  show("planes", planes().map((plane) => h("option", { value: plane })));
  show("machine", closed.map((text) => h("p", { class: "why" }, text)),
    cellTable([[["planes"], ...keys.map((key) => [key[2]])]], lines),
    limits.length > 0 && cellTable([[["sensors"], ...sensors().map((one) => [one])]], [["largest", limits]]),
    cellTable([[["errors"], ...Object.values(ERRORS).map((word) => [word])]], [["standard", errors]]));
}

function renderConventions() {
  const { phase = null, angles = null } = state.settings;
  const four = ["lead-with", "lead-against", "lag-with", "lag-against"];
  $("choice").open ||= !(phase && angles);
  show("convention-said", phase && angles ? `The job says: phase ${phase}, angles ${angles}`
    : "Not chosen yet. Until then the answer assumes that phase leads and angles count with rotation.");
  show("conventions", four.map((name) => {
    const [way, side] = [name.split("-")[0], `${name.split("-")[1]} rotation`];
    const edits = [{ key: ["phase"], old: phase, new: way }, { key: ["angles"], old: angles, new: side }];
    return button([h("b", {}, `Phase ${way}s, angles ${side}`), h("span", { id: `drawing-${name}`, filled: true })],
      () => edit(...edits), { id: `convention-${name}`, "aria-pressed": phase === way && angles === side });
  }));
  four.forEach((name) => draw(`drawing-${name}`, `/convention/${name}`));
}

function renderRuns() {
  const trials = runs().filter((run) => run !== baseline());
  const free = ["", ...trials].map((_, i) => `trial ${i + 1}`).find((name) => !trials.includes(name));
  const checks = valuesOf("run", "check");
  $("new-run").hidden = !data.runs;
  put($("new-name"), "value", free);
  show("baseline", data.runs ? card("runs", baseline()) : "First make the table, in step 1.");
  show("runs", trials.map((run) => card("runs", run)));
  show("check", checks.map((run) => card("check", run)), data.runs && !data.check && tickList());
}

/* What was mounted for the check run: the proposed pieces or weights, ticked; where they were, exactly. */
function tickList() {
  const { mounting, corrections = [], conventions: { weight_unit: unit } = {} } = state.results.answer?.document || {};
  const rows = mounting ? mounting.holes : corrections.filter(({ mass }) => mass);
  const placeOf = (row) => row.remove_at_deg ?? row.angle_deg; // where it is drilled or mounted
  const ticks = rows.map((row, i) => {
    const what = `${row.pieces ?? row.mass.toPrecision(4)} ${unitOf(unit)} ${row.hole ? `in hole ${row.hole} ` : ""}`;
    return h("label", { class: "check", key: `${row.plane} ${row.hole}` },
      h("input", { type: "checkbox", checked: "", "data-mounted": i }),
      `${row.plane}: ${row.action === "remove" ? "remove " : ""}${what}at ${degrees(placeOf(row))}°`);
  });
  const begin = () => {
    const { run, plane, weight: column } = data.weights.names;
    const weight = column?.endsWith(unit) ? column : `${unit.includes("_") ? "unbalance" : "mass"}_${unit}`;
    const action = rows.some((row) => row.action === "remove") && "action"; // without it all would be added
    const mounted = rows.filter((_, i) => document.querySelector(`[data-mounted="${i}"]`).checked);
    edit(create("check", data.runs), ...addRows("check", "check", usual()),
      create("check_weights", { header: [run, plane, weight, "angle_deg", action].filter((one) => one) }),
      ...mounted.map((row) => add("check_weights", { [run]: "check", [plane]: row.plane, [weight]: `${row.mass}`,
        angle_deg: `${placeOf(row)}`, ...(action && { action: row.action }) })));
  };
  return rows.length > 0 && data.weights && h("div", { key: state.results.answer.judgement },
    h("p", {}, "Mount what the answer says, run, then say what was mounted:"), ticks,
    button("Type the check run", begin, { id: "add-check" }));
}

/* The answer: every number of a document stands with its path. */
function value(doc, path, digits) {
  const raw = at(doc, path.split("."));
  const places = digits ?? 2 - Math.floor(Math.log10(Math.abs(raw) || 1));
  const text = typeof raw === "number" ? Number(raw.toFixed(Math.min(Math.max(places, 0), 6))) : raw ?? "";
  return h("span", { class: "value", "data-key": path, "data-value": raw, title: raw }, `${text}`);
}
const degrees = (angle) => Number(angle.toFixed(4));

/* Rows of a list in a document, largest `size` first; a column is [key, heading]; `within`: 95 % of the rows. */
function listing(doc, path, columns, { size = () => 0, count = Infinity, within } = {}) {
  const rows = at(doc, path.split("."));
  const heads = columns.filter(([key]) => rows.some((row) => key in row));
  const order = Object.keys(rows).sort((a, b) => size(rows[b]) - size(rows[a])).slice(0, count);
  return table([heads.map(([key, name = key]) => [name])], order.map((i) => h("tr", {}, heads.map(([key]) => {
    const place = key === "angle_deg" && Number.isFinite(rows[i].remove_at_deg) ? "remove_at_deg" : key;
    const digits = key !== "angle_deg" ? undefined : rows[i].hole ? 4 : 1; // holes are where they are
    const more = Number.isFinite(within?.[i]?.[key]) && ` ± ${Number(within[i][key].toPrecision(2))}`;
    return h("td", {}, value(doc, `${path}.${i}.${place}`, digits), more);
  }))));
}

const judged = (text) => h("p", { class: /^(do not|measure|fail|not as)|Take off what|Add nothing yet/im.test(text) ? "why" : "judgement" }, text);

function renderAnswer() {
  const { answer } = state.results;
  if (!answer) return show("answer");
  const { document: doc, within, warnings, notes } = answer;
  const { conventions, left_to_do: left, mounted_in_last_run: last } = doc;
  const pieces = left ? null : doc.mounting; // after a check run these are not what is to be done
  const [weight, unit] = [conventions.weight_unit, conventions.vibration_unit].map(unitOf);
  const columns = [["plane"], ["action", ""], ["hole"], ["pieces"], ["mass", weight], ["angle_deg", "at °"]];
  const place = [["sensor", "largest"], ["speed_rpm", "rpm"], ["before"], ["after", `after, ${unit}`]];
  const limits = [["name", "limit of"], ["speed_rpm", "rpm"], ["size"], ["limit"], ["verdict", ""]];
  show("answer", h("section", { "data-doc": "answer" },
    left ? [left.word === "trim" && [h("b", {}, "To add:"),
      listing(doc, left.holes?.length ? "left_to_do.holes" : "left_to_do.add", columns)],
    h("b", {}, `Mounted in ${left.run}:`), listing(doc, "left_to_do.mounted", columns)]
      : pieces ? listing(doc, "mounting.holes", columns) : listing(doc, "corrections", columns, { within }),
    h("p", {}, left ? "" : `For ${doc.corrections_refer_to}. `, `Angles count ${conventions.angles}, phase `,
      `${conventions.phase}. `, !left && !pieces && "95 of 100 such weights lie within ±."),
    !left && !pieces && last?.weights.some(({ mass }) => mass) && [
      h("b", {}, `If the weights of ${last.run} stay, instead:`), listing(doc, "add_to_mounted", columns)],
    !pieces && doc.other_readings.length > 0 && listing(doc, "other_readings", [["if"], ...columns]),
    doc.verdict && listing(doc, "verdict.rows", limits, { size: (row) => row.size / row.limit, count: 5 }),
    listing(doc, pieces ? "mounting.residuals" : "residuals", place, { size: (row) => row.after, count: 5 }),
    warnings.map((one) => h("p", {}, h("b", {}, "Warning: "), inWords(one))),
    notes.map((one) => h("p", {}, `Note: ${inWords(one)}`))));
}

function renderNow() {
  const { refused: why, answer } = state.results;
  const refused = [...typed.values()].filter((it) => it.why).map((it) => ({ ...it.cell, text: it.why }));
  const nameOf = ({ table: name, row, column }) =>
    `${whatOf(column || "reading")} of ${allRows(name).find(({ id }) => id === row)?.run}`;
  const wrong = [...problems(false).map((one) =>
    (one.row ? { ...one, text: `${nameOf(one)}: ${inWords(one.text)}` } : { ...one, text: inWords(one.text) })), ...refused];
  const counted = Object.groupBy(problems(true), (one) => (one.row ? nameOf(one) : one.text));
  const left = Object.entries(counted).map(([text, those]) =>
    ({ ...those[0], text: those[0].row ? `${those.length} × ${text}` : text }));
  const go = (it) => document.querySelector(`[data-at^="${it.table} ${it.row} ${it.column || ""}"]`).focus();
  const list = (those) => h("ul", {}, those.map((one) =>
    h("li", {}, one.row ? button(one.text, () => go(one), { class: "link" }) : one.text)));
  const empty = allRows("runs").filter(isEmpty);
  show("now", h("h2", {}, answer ? "Answer" : "So far"), answer && judged(answer.judgement),
    h("div", { class: "why" }, list(wrong), why && `No answer: ${inWords(why)}`),
    left.length > 0 && h("div", { id: "missing", key: "missing" }, "Still missing:", list(left)),
    empty.length > 0 && button("Not measured: remove the empty rows",
      () => edit(...remove("runs", empty)), { id: "drop-empty" }));
}

function renderPictures() {
  const { runs: soFar, answer } = state.results;
  const [shownAt = soFar?.channels[0]] = (soFar?.channels || []).filter(
    ({ speed, sensor }) => speed === focused.speed && sensor === focused.sensor);
  const [speed, sensor] = [shownAt?.speed, shownAt?.sensor].map(encodeURIComponent);
  draw("polar", shownAt && `/picture/runs?speed=${speed}&sensor=${sensor}&v=${state.version}`);
  show("gauges", (soFar?.runs || []).map(({ run, level, words, share_percent: share }) => h("div",
    { key: run, class: level, "data-run": run }, h("p", {}, h("b", {}, `${run}: ${level}. `), words),
    h("meter", { "aria-label": `effect of ${run}, percent`, max: 100, value: Math.min(share, 100) }))));
  draw("overview", answer && `/picture/answer?v=${state.version}`);
}

async function draw(id, address) {
  const slot = $(id);
  slot.hidden = !address;
  if (slot.address === address) return;
  slot.address = address;
  if (!address) return slot.replaceChildren(); // no old picture stands beside new numbers
  await new Promise((next) => setTimeout(next, 150)); // who goes through the cells wants the last one
  if (slot.address !== address) return;
  const svg = await ask(address).then((drawing) => drawing.text(), () => "");
  if (slot.address === address && svg) slot.innerHTML = svg;
  else if (slot.address === address) slot.address = ""; // the next state asks again
}

function renderHeader() {
  const lost = `not saved — the program is not running${queue.length ? `: ${queue.length} wait here` : ""}`;
  $("saved").textContent = online ? (queue.length ? "saving…" : savedWords) : lost;
  $("saved").className = online ? "" : "why";
}

function render() {
  renderHeader();
  $("job").textContent = `${state.folder} / ${state.job}`;
  $("answer").className = ($("busy").textContent = state.results.busy) === "computing" ? "old" : "";
  show("notice", state.notice && h("p", {}, state.notice));
  for (const id of ["undo", "redo"]) $(id).disabled = !state[id];
  for (const part of [renderMachine, renderConventions, renderRuns, renderNow, renderAnswer, renderPictures]) part();
}

/* What a person does. */
document.addEventListener("change", ({ target }) => {
  if (target.form?.id === "trial") localStorage.setItem(trialKey(), JSON.stringify(trialFields().map(fieldValue)));
  if (!target.cell || target.value === target.saved) return;
  save([{ cell: target.cell, old: target.saved, text: target.value.trim() }]);
  target.saved = target.value;
});
document.addEventListener("keydown", (event) => {
  const { target, key } = event;
  const step = { Enter: 1, ArrowDown: 1, ArrowUp: -1 }[key];
  const editing = target.matches("input") && target.value !== (target.saved ?? "");
  if (target.cell && step) {
    const column = `td:nth-child(${target.parentNode.cellIndex + 1}) > input`;
    const cells = [...target.closest("table").querySelectorAll(column)];
    const next = cells[cells.indexOf(target) + step];
    if (next) next.select(event.preventDefault());
  } else if (key.toLowerCase() === "z" && (event.ctrlKey || event.metaKey) && !editing) {
    event.preventDefault();
    send(event.shiftKey ? "/redo" : "/undo", {}).catch(tell);
  }
});
document.addEventListener("focusin", ({ target }) => {
  if (!/^(runs|check)\|/.test(target.dataset.cell)) return;
  const [, , place, sensor] = target.dataset.cell.split("|");
  focused = { speed: place.replace(/ .*/, ""), sensor };
  renderPictures();
});
document.addEventListener("paste", (event) => {
  const { target } = event;
  const text = event.clipboardData.getData("text").replace(/[\r\n]+$/, "");
  const lines = text.split(/\r?\n/).map((line) => line.split(text.includes("\t") ? "\t" : ";"));
  if (!target.cell?.row || (lines.length < 2 && lines[0].length < 2)) return;
  while (target.cell.what !== "plane" && lines[1] && lines[0].every((it) => isNaN(number(it)))) lines.shift();
  event.preventDefault();
  const rows = [...target.closest("tbody").rows].slice(target.closest("tr").sectionRowIndex);
  const inputAt = (i, j) => rows[i]?.cells[target.parentNode.cellIndex + j]?.querySelector("input");
  const words = lines.flatMap((line, i) => line.map((word, j) => [word.trim(), inputAt(i, j)]));
  const fit = words.filter(([word, input]) => word && input);
  save(fit.map(([word, input]) => ({ cell: input.cell, old: input.saved, text: word })));
  for (const [word, input] of fit) input.value = input.saved = word;
  if (words.some(([word, input]) => word && !input)) tell("Not written: the values outside of the table.");
});

/* The fields of a trial weight stay in this browser. */
const trialFields = () => [...$("trial").querySelectorAll("input, select")];
const fieldValue = (field) => (field.type === "checkbox" ? field.checked : field.value);
const trialKey = () => `trial weight of ${state.folder} / ${state.job}`;
function restoreTrial() {
  JSON.parse(localStorage.getItem(trialKey()) || "[]").forEach((value, i) => {
    const field = trialFields()[i];
    if (field) field[field.type === "checkbox" ? "checked" : "value"] = value;
  });
}

const submitted = {
  "setup-form"() {
    const [speedName, amplitude] = ["setup-speed-unit", "setup-amplitude-unit"].map((id) => $(id).value);
    const [speeds, names] = ["setup-speeds", "setup-sensors"].map((id) => each(partsOf($(id).value, /[,;]/)));
    const header = ["run", speedName, "sensor", amplitude, "phase_deg"];
    const places = speeds.flatMap((speed) => names.map((sensor) => ({ speed, sensor })));
    if (data.runs) edit(...runs().flatMap((run) => addRows("runs", run, places)));
    else edit(create("runs", { header }), ...addRows("runs", "baseline", places, speedName));
    $("setup").open = false;
  },
  "new-run"() {
    const [run, plane, unit] = ["new-name", "new-plane", "setup-weight-unit"].map((id) => $(id).value.trim());
    const made = data.weights ? [] : [create("weights", { header: ["run", "plane", unit, "angle_deg"] })];
    const enter = () => $("runs").lastChild?.querySelectorAll("input")[1]?.focus();
    edit(...made, add("weights", { run, plane }), ...addRows("runs", run, usual())).then(enter);
    $("new-plane").value = "";
  },
  async trial() {
    const options = { with_job: $("trial-with-job").checked };
    for (const { name, value: it, dataset } of $("trial").querySelectorAll("[name]")) {
      if (it && !options.with_job) options[name] = dataset.unit ? number(it) + dataset.unit : number(it) || it;
    }
    const { judgement, lines, warnings, notes, picture = "" } = await ask("/trial", { options })
      .then((one) => one.json(), (no) => ({ notes: no.message }));
    show("trial-answer", [judgement, lines, warnings, notes].flat().map((one) => one && h("p", {}, one)));
    $("trial-picture").innerHTML = picture;
  },
};
for (const id of Object.keys(submitted)) $(id).onsubmit = (event) => submitted[id](event.preventDefault());

$("print").onclick = async () => {
  const opened = window.open("", "_blank");
  const sheet = await ask("/sheet").then((one) => one.blob(), tell);
  if (sheet) opened.location = URL.createObjectURL(sheet);
  else opened.close();
};
for (const id of ["undo", "redo"]) $(id).onclick = () => send(`/${id}`, {}).catch(tell);
window.addEventListener("hashchange", () => tell((token = location.hash.slice(1)) && ""));
window.addEventListener("beforeunload", (event) => queue.length && event.preventDefault());
for (;;) await refresh(online && state ? state.version : -1).catch(away);
