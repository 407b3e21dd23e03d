/* It shows the job, and sends every cell that changes, by its id, `data-edits` of buttons, and those of forms. */
const $ = (id) => document.getElementById(id);
const typed = new Map(); // id of a cell → its change, until the page has it; with `why` if it was refused
let last = Promise.resolve(); // of what is still to be sent, in order
let waiting = 0;
const token = location.hash.slice(1);
let state = { version: -1 }; // the job, as the server told it last
let problems; // [words, the cell that they are about]
let online = true;
let savedWords = "all is saved";

/* A message in words of the page, not of files and options. */
const WORDS = { "[errors]": "errors", check_weights: "weights of the check run", max_weight: "largest" };
for (const one of $("errors").querySelectorAll("[data-setting]")) WORDS[one.dataset.setting] = one.textContent;
const inWords = (text) => (
  Object.entries(WORDS).reduce((all, [key, words]) => all.replaceAll(key, `“${words}”`), text));

/* HTML with values in it, of which all but HTML is text; none of false, null, undefined, 0. */
const html = (parts, ...values) => ({ html: String.raw({ raw: parts }, ...values.map(asHtml)) });
function asHtml(value) {
  if (Array.isArray(value)) return value.map(asHtml).join("");
  return value?.html ?? String(value || "").replace(/[&<>"]/g, (sign) => `&#${sign.charCodeAt()};`);
}
const paragraph = (text, kind) => html`<p>${kind && html`<b>${kind}</b> `}${inWords(text)}</p>`;
const button = (words, edits) => html`<button data-edits="${JSON.stringify(edits)}">${words}</button>`;
const remove = (words, rows) => button(words, rows.map(({ id }) => ({ delete: id })));
const figures = (value) => (Math.abs(value) < 9999.5 ? value.toPrecision(4) : value.toFixed(0));

/* Settings [name, text, settings in it], and rows of tables. */
const within = (...path) => (
  path.reduce((inner, name) => inner.find((one) => one[0] === name)?.[2] ?? [], state.settings));
const names = (...path) => within(...path).map(([name]) => name);
const rowsOf = (key) => state.tables[key]?.rows ?? [];
const rowsOfRun = (key, run) => rowsOf(key).filter((row) => row.run === run);
const each = (words) => [...new Set(words)].filter(Boolean);
const values = (what, ...keys) => each(keys.flatMap((key) => rowsOf(key).map((row) => row[what])));
const allRuns = () => values("run", "runs", "weights");
const baselineRun = () => allRuns().find((run) => !values("run", "weights").includes(run)) ?? "baseline";
const weightColumn = () => state.tables.weights?.columns.weight ?? "mass_g";
const isFirst = ({ id }) => id.endsWith("|1"); // of those at its speed and sensor
const placeOf = (row) => (isFirst(row) ? row.speed : `${row.speed ?? ""} (${row.id.split("|").at(-1)})`);
const angleOf = (row) => row.remove_at_deg ?? row.angle_deg ?? 0;
const content = (column) => (/^(mass|unbalance)/.test(column) ? "weight" : column.split(/[_ ]/)[0]);
const afterContent = (column) => column.slice(column.indexOf("_") + 1);
/* The unit of a column, in the words of the choice of it. */
const unit = (column = "") => (
  document.querySelector(`select [value="${CSS.escape(column)}"]`)?.text
  ?? afterContent(column).replaceAll("_", " "));

function problemInWords({ at, row, column, value, expected, text }) {
  const table = Object.values(state.tables).find(({ rows }) => rows.some((one) => one.at === at));
  if (!table) return [row === null && column === "weights" ? "no trial run yet" : text];
  const { id } = table.rows.find((one) => one.at === at);
  const there = value ? `'${value.slice(0, 60)}' stands here; expected` : "still missing:";
  const words = `${content(column ?? "reading")} of ${id.split("|")[1]}: ${there} ${expected}`;
  return [words, `${id}|${column ?? table.columns.amplitude ?? table.columns.plane}`];
}

function input(id, text, label) {
  const closed = state.read_only || state.tables[id.split("|")[0]]?.read_only;
  const why = text && each(problems.map(([words, cell]) => cell === id && words)).join("; ");
  return html`<input id="${id}" value="${text}" class="cell" autocomplete="off"
    aria-label="${label}${why && `: ${why}`}" ${why && html`aria-invalid="true"`} ${closed && html`disabled`}
    ${id.endsWith("|plane") ? html`list="plane-names"` : html`inputmode="decimal"`}>`;
}

const cell = (columns, row, what, place) => (
  input(`${row.id}|${columns[what]}`, row[what], `${what}, ${row.run}, ${place}`));

const line = (id, head, cells) => (
  html`<tr id="row ${id}"><th>${head}</th>${cells.map((one) => html`<td>${one}</td>`)}</tr>`);

/* A table; each but the first of upper headings stands above some columns. */
function grid(heads, lines, upper = [], wide = 1) {
  const above = upper.map((text, k) => html`<th ${k && html`colspan="${wide}"`}>${text}</th>`);
  return html`<div class="scroll"><table><thead>${upper.length && html`<tr>${above}</tr>`}
    <tr>${heads.map((text) => html`<th>${text}</th>`)}</tr></thead><tbody>${lines}</tbody></table></div>`;
}

/* A line for each path of settings; one that is stated in another unit has the key of that. */
function settings(top, paths) {
  const keys = { max: `max_${weightColumn()}`, available: `available_${afterContent(weightColumn())}` };
  const setting = (path, { dataset: { setting: usual }, textContent: words }) => {
    const isIt = ([key]) => key === usual || (path.length > 1 && content(key) === content(usual));
    const [key, text] = within(...path).find(isIt) ?? [keys[usual] ?? usual, ""];
    return input([...path, key].join("|"), text, `${words}, ${path.at(-1)}`);
  };
  const columns = [...$(top).querySelectorAll("[data-setting]")];
  return paths.map((path) => line(path.join(" "), path[1], columns.map((column) => setting(path, column))));
}

function readings(key, run) {
  const columns = state.tables[key]?.columns ?? {};
  const sensors = values("sensor", "runs", "check");
  const read = ["amplitude", "phase"].filter((what) => columns[what]);
  const heads = read.map((what) => (what === "phase" ? "°" : unit(columns[what])));
  const rows = rowsOfRun(key, run);
  const cells = (place) => sensors.flatMap((sensor) => {
    const row = rows.find((one) => one.sensor === sensor && placeOf(one) === place);
    return read.map((what) => (row ? cell(columns, row, what, `${sensor}, ${place}`) : "–"));
  });
  const lines = each(rows.map(placeOf)).map((place) => line(`${key} ${run} ${place}`, place, cells(place)));
  return grid(["", ...sensors.flatMap(() => heads)], lines, [unit(columns.speed), ...sensors], read.length);
}

function card(key, run) {
  const mounted = key === "runs" ? "weights" : "check_weights";
  const columns = state.tables[mounted]?.columns;
  const weights = rowsOfRun(mounted, run);
  const heads = { plane: "plane", weight: unit(columns?.weight), angle: "at °", action: "action" };
  const stated = Object.keys(heads).filter((what) => columns?.[what]);
  const cells = (row, k) => stated.map((what) => cell(columns, row, what, `weight ${k}`));
  const lines = weights.map((row, k) => line(row.id, k + 1, [...cells(row, k + 1), remove("Remove", [row])]));
  return html`<article id="run ${run}"><h3>${run}</h3>
    ${lines.length && grid(["", ...stated.map((what) => heads[what])], lines)}
    ${columns && button("Add a weight", [{ table: mounted, cells: { run } }])}
    ${readings(key, run)}${remove("Remove this run", [...rowsOfRun(key, run), ...weights])}</article>`;
}

/* A box for each weight that there is to mount; another answer has other boxes. */
function tick(row, k) {
  const where = row.hole ? `${row.plane}, hole ${row.hole}, ${row.pieces}` : row.plane;
  const what = `${row.action === "remove" ? "take away" : ""} ${figures(row.mass)} ${state.answer.unit}`;
  return html`<label class="check" id="${k + 1}: ${state.answer.judgement}">
    <input type="checkbox" name="${String(k)}" checked>
    ${where}: ${what} at ${Number(angleOf(row).toPrecision(6))}°</label>`;
}

function problem(words) {
  const [cell, ...others] = problems.filter((one) => one[0] === words).map((one) => one[1]);
  const link = html`<button class="link" data-go="${cell}">${others.length + 1} × ${inWords(words)}</button>`;
  return html`<li>${cell ? link : inWords(words)}</li>`;
}

/* What elements of the page hold, by their id. */
function shown() {
  const { tables, answer = { remarks: [] } } = state;
  const [baseline, groups] = [baselineRun(), names("groups")];
  const inGroups = groups.flatMap((name) => names("groups", name, "planes"));
  const all = each([...names("planes"), ...inGroups, ...values("plane", "weights")]);
  const planes = all.filter((name) => !groups.includes(name));
  return {
    job: state.name,
    busy: state.busy,
    notice: state.notice && html`<p>${state.notice}</p>`,
    "read-only": state.read_only || each(Object.values(tables).map((table) => table.read_only)).join("\n"),
    "of planes": settings("planes", planes.map((name) => ["planes", name])),
    "of sensors": settings("sensors", values("sensor", "runs", "check").map((name) => ["sensors", name])),
    "of errors": settings("errors", [["errors"]]),
    baseline: tables.runs ? readings("runs", baseline) : "First make the table, in step 1.",
    runs: allRuns().filter((run) => run !== baseline).map((run) => card("runs", run)),
    "plane-names": [...planes, ...groups].map((name) => html`<option value="${name}"></option>`),
    "check-runs": values("run", "check").map((run) => card("check", run)),
    ticks: tables.runs && tables.weights && !tables.check && answer.to_mount?.map(tick),
    judgement: inWords(answer.judgement ?? ""),
    problems: each(problems.map(([words]) => words)).map(problem),
    refused: state.refused && inWords(`No answer: ${state.refused}`),
    tables: { html: answer.tables?.join("\n") ?? "" }, // those of the sheet
    remarks: answer.remarks.map(([kind, text]) => paragraph(text, kind)),
  };
}

/* Make elements what new ones are; focus stays, and what is being typed. */
function morph(old, now) {
  const idle = isIdle(old);
  if (isCell(old)) old.saved ??= old.defaultValue; // what it showed when somebody began to type
  for (const { name } of [...old.attributes]) if (!now.hasAttribute(name)) old.removeAttribute(name);
  for (const { name, value } of now.attributes) old.setAttribute(name, value);
  if (idle) fill(old);
  morphChildren(old, now);
}

function morphChildren(old, now) {
  const named = new Map([...old.children].filter((one) => one.id).map((one) => [one.id, one]));
  const wanted = new Set([...now.children].map((one) => one.id));
  for (const [id, one] of named) if (!wanted.has(id)) one.remove();
  let place = old.firstChild;
  for (const one of [...now.childNodes]) {
    const alike = place && !place.id && place.nodeName === one.nodeName ? place : null;
    const same = one.id ? named.get(one.id) : alike;
    if (same === place) place = place?.nextSibling;
    if (!same) old.insertBefore(one, place);
    else if (same.nextSibling !== place) old.insertBefore(same, place);
    if (same?.dataset) morph(same, one);
    else if (same && same.data !== one.data) same.data = one.data;
  }
  while (place) [place] = [place.nextSibling, place.remove()];
}

function put(id, content) {
  const box = Object.assign(document.createElement("template"), { innerHTML: asHtml(content) });
  morphChildren($(id), box.content);
}

const isCell = (one) => one.matches("input.cell");
const isIdle = (one) => isCell(one) && one.value === (one.saved ?? one.defaultValue);
const fill = (cell) => (cell.value = cell.saved = typed.get(cell.id)?.text ?? cell.defaultValue);

/* The server. What changes the job is sent one after the other, and again when the program was away. */
async function ask(path, body) {
  const headers = { "X-Rotorid-Token": token };
  const answer = await fetch(path, { headers, ...(body && { method: "POST", body: JSON.stringify(body) }) });
  if (answer.ok) return answer;
  const refusal = await answer.json().catch(() => ({ error: `${answer.status} ${answer.statusText}` }));
  throw Object.assign(new Error(refusal.error), { status: answer.status });
}

async function refresh(after) {
  const news = await (await ask(`/state?after=${after}`)).json();
  if (online && news.version < state.version) return; // the other request was faster
  [online, state] = [true, news];
  problems = (state.problems ?? []).map(problemInWords);
  for (const id of ["weight-unit", "piece-unit"]) put(id, unit(weightColumn()));
  for (const [id, content] of Object.entries(shown())) put(id, content);
  if (!("has" in document.body.dataset)) begin();
  document.body.dataset.has = Object.keys(state.tables).join(" ");
  const conventions = within().map(([name, text]) => `${name} ${text}`);
  for (const one of $("conventions").children) one.ariaPressed = conventions.includes(one.id);
  showSaved();
  showConflicts();
  draw();
}

async function away({ status }) {
  online = false;
  showSaved();
  if (status === 403) tell("This address is of no running worksheet: open the one that the program shows.");
  await new Promise((resolve) => setTimeout(resolve, 1000));
}

function send(path, body) {
  tell("");
  waiting += 1;
  const sent = last.then(() => deliver(path, body));
  last = sent.catch(() => {}).then(() => showSaved((waiting -= 1)));
  showSaved();
  return sent;
}

async function deliver(path, body) {
  const unlessRefused = (problem) => {
    if (problem.status && problem.status !== 403) throw problem;
    return away(problem);
  };
  while (!(await ask(path, body).then(() => true, unlessRefused)));
  savedWords = `saved ${new Date().toTimeString().slice(0, 8)}`;
  while (!(await refresh(-1).then(() => true, away)));
}

const act = (path, body) => send(path, body).then(() => true, ({ message }) => tell(message));

/* Changes {id, old, text} of cells, as one step. */
function save(changes) {
  const edits = changes.map(({ id, old, text }) => ({ cell: id, old, new: text }));
  const drop = () => changes.forEach((one) => typed.get(one.id) === one && typed.delete(one.id));
  const refuse = ({ message, status }) => Object.assign(changes[0], { why: message, status, changes, drop });
  changes.forEach((one) => typed.set(one.id, one));
  send("/edit", { edits }).then(drop, refuse).then(() => settle(changes));
}

function settle(changes) {
  for (const { id } of changes) if ($(id) && isIdle($(id))) fill($(id));
  showConflicts();
}

/* What was refused before replaces what is there now. */
const changeOf = ({ id, defaultValue, saved = defaultValue }, text) => (
  { id, old: typed.get(id)?.why ? defaultValue : saved, text });

function showConflicts() {
  const lines = [...typed.values()].filter((one) => one.why).map(({ id, text, why, status }) => {
    const theirs = $(id)?.defaultValue ?? "";
    const words = `another window (or program) wrote “${theirs}” here; you typed “${text}”. `;
    const line = `${$(id)?.ariaLabel ?? id}: ${status === 409 ? words : inWords(why)} `;
    $(id)?.setAttribute("aria-invalid", "true");
    return html`<p>${line}<button data-theirs="${id}">Keep “${theirs}”</button>
      <button data-mine="${id}">Write “${text}”</button></p>`;
  });
  put("conflicts", lines);
}

const tell = (text) => put("message", text && paragraph(text));

function showSaved() {
  const words = waiting ? "saving…" : savedWords;
  $("saved").textContent = online ? words : `not saved: ${waiting} wait here, the program is not running`;
  $("saved").className = online ? "" : "why";
}

async function draw() {
  const slot = $("overview");
  const address = state.asked ? `/picture?v=${state.asked[1]}` : "";
  if (slot.drawn === address) return;
  slot.drawn = address;
  slot.replaceChildren(); // no old picture stands beside new numbers
  const svg = address && (await ask(address).then((drawing) => drawing.text(), () => ""));
  if (slot.drawn === address) slot.innerHTML = svg;
  if (!svg) slot.drawn = null; // the next state asks again
}

/* Edits that add rows to a table, which is made, unless it is there. */
const added = (table, header, rows) => (
  [...(state.tables[table] ? [] : [{ create: table, header }]), ...rows.map((cells) => ({ table, cells }))]);

/* A row for the readings of a run at the place of another row; rows at all places of the baseline. */
const reading = (run, { speed, sensor }, columns = state.tables.runs.columns) => (
  { [columns.run]: run, [columns.speed]: speed, [columns.sensor]: sensor });
const likeBaseline = (run) => (
  rowsOfRun("runs", baselineRun()).filter(isFirst).map((row) => reading(run, row)));

/* Edits of forms with what is typed there. */
const FORMS = {
  "new-rows": ({ speeds, sensors, ...fields }) => {
    const words = (text) => each(text.split(/[,;]/).map((word) => word.trim()));
    const places = words(speeds).flatMap((speed) => words(sensors).map((sensor) => ({ speed, sensor })));
    const columns = state.tables.runs?.columns ?? { run: "run", speed: fields.speed, sensor: "sensor" };
    const header = ["run", fields.speed, "sensor", fields.amplitude, ...(fields.no_phase ? [] : ["phase_deg"])];
    const runs = allRuns().length ? allRuns() : ["baseline"];
    return added("runs", header, runs.flatMap((run) => places.map((place) => reading(run, place, columns))));
  },
  "new-run": (fields) => {
    const cells = { run: fields.name.trim(), plane: fields.plane.trim() };
    const weight = added("weights", ["run", "plane", fields.unit, "angle_deg"], [cells]);
    return [...weight, ...added("runs", [], likeBaseline(cells.run))];
  },
  "check-form": (fields) => {
    const isAway = state.answer.to_mount.some((row) => row.action === "remove");
    const all = state.answer.to_mount.map((row) => ({
      run: "check", plane: row.plane, [weightColumn()]: row.mass, angle_deg: angleOf(row),
      ...(isAway && { action: row.action }),
    }));
    const mounted = added("check_weights", Object.keys(all[0]), all.filter((_, k) => fields[k]));
    return [...added("check", state.tables.runs.header, likeBaseline("check")), ...mounted];
  },
};

/* What a person does. */
document.addEventListener("click", ({ target }) => {
  const button = target.closest("button");
  const { edits, go, theirs, mine } = button?.dataset ?? {};
  if (edits) act("/edit", { edits: JSON.parse(edits) });
  if (button?.dataset.do) act(`/${button.dataset.do}`, {});
  if (go) $(go)?.focus();
  if (button?.id === "print") print();
  const { changes, drop } = typed.get(theirs ?? mine) ?? {};
  if (mine) save(changes.map(({ id, text }) => ({ id, text, old: $(id)?.defaultValue })));
  if (theirs) settle(changes, drop());
});
document.addEventListener("submit", async (event) => {
  event.preventDefault();
  const form = event.target;
  const fields = Object.fromEntries(new FormData(form, event.submitter));
  if (form.id === "trial") return propose(fields);
  if (!(await act("/edit", { edits: FORMS[form.id](fields) }))) return;
  form.reset();
  $("setup").open = false;
});
document.addEventListener("change", ({ target }) => {
  if (target.form?.id === "trial") localStorage.setItem(trialKey(), JSON.stringify([...new FormData($("trial"))]));
  if (!isCell(target) || isIdle(target)) return;
  save([changeOf(target, target.value.trim())]);
  target.saved = target.value;
});
document.addEventListener("paste", (event) => {
  const { target } = event;
  const text = event.clipboardData.getData("text").replace(/[\r\n]+$/, "");
  const lines = text.split(/\r?\n/).map((line) => line.split(text.includes("\t") ? "\t" : ";"));
  if (!isCell(target) || (lines.length < 2 && lines[0].length < 2)) return;
  const isWord = (word) => Number.isNaN(Number(word.trim().replace(",", ".")));
  while (!target.list && lines[1] && lines[0].every(isWord)) lines.shift();
  event.preventDefault();
  const rows = [...target.closest("tbody").rows].slice(target.closest("tr").sectionRowIndex);
  const cellAt = (i, j) => rows[i]?.cells[target.parentNode.cellIndex + j]?.querySelector("input");
  const words = lines.flatMap((line, i) => line.map((word, j) => [word.trim(), cellAt(i, j)]));
  const fit = words.filter(([word, cell]) => word && cell);
  save(fit.map(([word, cell]) => changeOf(cell, word)));
  for (const [word, cell] of fit) cell.value = cell.saved = word;
  if (words.some(([word, cell]) => word && !cell)) tell("Not written: the values outside of the table.");
});

/* The fields of a trial weight stay in this browser. */
const trialKey = () => `trial weight of ${state.name}`;
function begin() {
  $("setup").open = !state.tables.runs;
  const kept = JSON.parse(localStorage.getItem(trialKey()) || "[]");
  for (const [name, value] of kept) if ($("trial").elements[name]) $("trial").elements[name].value = value;
}
async function propose(fields) {
  const lines = await ask("/trial", fields).then((one) => one.json(), ({ message }) => [message]);
  put("trial-answer", lines.filter(Boolean).map((line) => paragraph(line)));
}

async function print() {
  const opened = window.open("", "_blank");
  const sheet = await ask("/sheet").then((one) => one.blob(), ({ message }) => tell(message));
  if (sheet) opened.location = URL.createObjectURL(sheet);
  else opened.close();
}
window.addEventListener("beforeunload", (event) => waiting && event.preventDefault());
for (;;) await refresh(online ? state.version : -1).catch(away);
