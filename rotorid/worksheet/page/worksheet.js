/* It shows the HTML of the server, and sends every cell that changes, by its id; buttons and forms have
`data-edits`, or the rows that are then `data-gone`; what has `data-keep` is filled here. */
const $ = (id) => document.getElementById(id);
const typed = new Map(); // id of a cell → its change, until the page has it; with `why` if it was refused
let last = Promise.resolve(); // of what is still to be sent, in order
let waiting = 0;
const token = location.hash.slice(1);
let version = -1;
let online = true;
let savedWords = "all is saved";

/* A message in words of the page, not of files and options. */
const WORDS = {
  amplitude_percent: "reading, %",
  phase_deg: "phase, °",
  run_percent: "run to run, %",
  placement_deg: "place of a weight, °",
  placement_percent: "weight, %",
  "[errors]": "errors",
  check_weights: "weights of the check run",
  max_weight: "largest",
};
const inWords = (text) => (
  Object.entries(WORDS).reduce((all, [key, words]) => all.replaceAll(key, `“${words}”`), text));

/* Make elements as they come from the server; focus stays, and what is being typed. */
function morph(old, now) {
  if ("keep" in old.dataset) return;
  const idle = isIdle(old);
  if (isCell(old)) old.saved ??= old.defaultValue; // what it showed when somebody began to type
  for (const { name } of [...old.attributes]) {
    if (!now.hasAttribute(name) && name !== "open") old.removeAttribute(name);
  }
  for (const { name, value } of now.attributes) if (name !== "open") old.setAttribute(name, value);
  if (idle) fill(old);
  if (!("picture" in old.dataset)) morphChildren(old, now);
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
  if (online && news.version < version) return; // the other request was faster
  const first = version < 0;
  [online, version] = [true, news.version];
  const { body } = new DOMParser().parseFromString(news.html, "text/html");
  for (const one of body.querySelectorAll("#result li, #result li *, #result p, #result p *")) {
    if (!one.children.length) one.textContent = inWords(one.textContent);
  }
  morphChildren(document.body, body);
  if (first) restoreTrial();
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
  for (;;) {
    const problem = await ask(path, body).then(() => null, (error) => error);
    if (!problem) break;
    if (problem.status && problem.status !== 403) throw problem;
    await away(problem);
  }
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

function add(parent, tag, text, dataset) {
  const made = parent.appendChild(document.createElement(tag));
  made.textContent = text;
  Object.assign(made.dataset, dataset);
  return made;
}

function showConflicts() {
  const box = document.createElement("div");
  for (const { id, text, why, status } of [...typed.values()].filter((one) => one.why)) {
    const theirs = $(id)?.defaultValue ?? "";
    const words = `another window (or program) wrote “${theirs}” here; you typed “${text}”. `;
    const line = add(box, "p", `${$(id)?.ariaLabel ?? id}: ${status === 409 ? words : inWords(why)} `);
    add(line, "button", `Keep “${theirs}”`, { theirs: id });
    add(line, "button", `Write “${text}”`, { mine: id });
    $(id)?.setAttribute("aria-invalid", "true");
  }
  morphChildren($("conflicts"), box);
}

function tell(text) {
  $("message").replaceChildren();
  if (text) add($("message"), "p", inWords(text));
}

function showSaved() {
  const words = waiting ? "saving…" : savedWords;
  $("saved").textContent = online ? words : `not saved: ${waiting} wait here, the program is not running`;
  $("saved").className = online ? "" : "why";
}

async function draw() {
  const slot = $("overview");
  const address = slot.dataset.picture;
  if (slot.drawn === address) return;
  slot.drawn = address;
  slot.replaceChildren(); // no old picture stands beside new numbers
  const svg = address && (await ask(address).then((drawing) => drawing.text(), () => ""));
  if (slot.drawn === address) slot.innerHTML = svg;
  if (!svg) slot.drawn = null; // the next state asks again
}

/* Edits of a form, of its rows, and of its ticked boxes; {form_field} stands for what is typed there. */
function editsOf(form, fields) {
  const typedIn = (_, value) => (value?.form_field ? fields[value.form_field].trim() : value);
  const read = ({ dataset }) => JSON.parse(dataset.edits ?? "[]", typedIn);
  const rows = JSON.parse(form.dataset.rows, typedIn);
  const boxes = [...form.querySelectorAll("input:checked[data-edits]")];
  return [...read(form), ...rowsOf(rows, fields), ...boxes.flatMap(read)];
}

/* Rows of runs at the places of other rows, or at each speed and sensor that is typed: they make a table. */
function rowsOf({ table, columns, runs, like }, fields) {
  const { run, speed, sensor } = columns ?? { run: "run", speed: fields.speed, sensor: "sensor" };
  const each = (name) => [...new Set(fields[name].split(/[,;]/).map((word) => word.trim()).filter(Boolean))];
  const places = like
    ? like.filter((row) => row.place === row.speed).map((row) => [row.speed, row.sensor])
    : each("speeds").flatMap((at) => each("sensors").map((name) => [at, name]));
  const cells = runs.flatMap((name) => (
    places.map(([at, where]) => ({ [run]: name, [speed]: at, [sensor]: where }))));
  const header = [run, speed, sensor, fields.amplitude, ...(fields.no_phase ? [] : ["phase_deg"])];
  return [...(columns ? [] : [{ create: table, header }]), ...cells.map((row) => ({ table, cells: row }))];
}

/* What a person does. */
document.addEventListener("click", ({ target }) => {
  const button = target.closest("button");
  const { edits, gone, go, theirs, mine } = button?.dataset ?? {};
  if (edits) act("/edit", { edits: JSON.parse(edits) });
  if (gone) act("/edit", { edits: JSON.parse(gone).map((row) => ({ delete: row })) });
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
  if (!(await act("/edit", { edits: editsOf(form, fields) }))) return;
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
const trialKey = () => `trial weight of ${$("job").textContent}`;
function restoreTrial() {
  const kept = JSON.parse(localStorage.getItem(trialKey()) || "[]");
  for (const [name, value] of kept) if ($("trial").elements[name]) $("trial").elements[name].value = value;
}
async function propose(fields) {
  const [box, answer] = [$("trial-answer"), ask("/trial", fields)];
  box.innerHTML = await answer.then((one) => one.text(), () => "");
  await answer.catch(({ message }) => add(box, "p", inWords(message)));
}

async function print() {
  const opened = window.open("", "_blank");
  const sheet = await ask("/sheet").then((one) => one.blob(), ({ message }) => tell(message));
  if (sheet) opened.location = URL.createObjectURL(sheet);
  else opened.close();
}
window.addEventListener("beforeunload", (event) => waiting && event.preventDefault());
for (;;) await refresh(online ? version : -1).catch(away);
