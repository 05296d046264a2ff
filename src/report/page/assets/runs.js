// The table of the runs: filtered by words; a click on a run opens its page, or shows how to repeat it.

const filter = byId("filter");
const runRows = [...document.querySelectorAll("#runs tbody tr")];
const runWords = runRows.map((row) => row.textContent.toLowerCase());
const runColumns = [...document.querySelectorAll("#runs thead th")].map((header) => header.textContent);
// Called when other runs are shown.
const onFilter = [];

function showMatching() {
  const words = filter.value.toLowerCase().split(/\s+/).filter(Boolean);
  let shown = 0;
  runRows.forEach((row, k) => {
    row.hidden = !words.every((word) => runWords[k].includes(word));
    if (!row.hidden) shown += 1;
  });
  byId("shown").textContent = `${shown} of ${runRows.length} runs`;
  onFilter.forEach((update) => update());
}

filter.addEventListener("input", showMatching);
showMatching();

const runName = (k) => runRows[k].cells[0].textContent;
// A word of a command for a POSIX shell.
const shellWord = (word) => (/^[\w./+:@-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);

// The folder of the study: that of this file, or else the one in which zsim puts it by default.
const studyFolder = () =>
  location.protocol === "file:" ? decodeURIComponent(location.pathname).replace(/\/[^/]*$/, "") : data.folder;

// Shows settings and figures of a run, and the command that repeats it.
function showRun(k) {
  const section = byId("run");
  section.hidden = false;
  section.querySelector("h2").textContent = `Run ${runName(k)}`;
  const rows = [...runRows[k].cells].slice(1).map((cell, column) => {
    const row = document.createElement("tr");
    const name = row.appendChild(document.createElement("th"));
    name.scope = "row";
    name.textContent = runColumns[column + 1];
    row.appendChild(document.createElement("td")).textContent = cell.textContent;
    return row;
  });
  section.querySelector("tbody").replaceChildren(...rows);
  byId("repeat").hidden = data.folder === null;
  section.querySelector("code").textContent = `zsim sweep repeat ${shellWord(studyFolder() ?? "")} --run ${runName(k)}`;
  section.querySelector("output").textContent = "";
  section.focus();
}

// The page of a run that the study keeps.
const runPage = (k) => runRows[k].querySelector("th a")?.href;

function openRun(k) {
  const page = runPage(k);
  if (page) location.assign(page);
  else showRun(k);
}

byId("copy").addEventListener("click", async () => {
  const code = document.querySelector("#repeat code");
  const output = document.querySelector("#repeat output");
  try {
    await navigator.clipboard.writeText(code.textContent);
    output.textContent = "copied";
  } catch {
    // Without access to the clipboard, the command is selected.
    getSelection().selectAllChildren(code);
    output.textContent = "selected";
  }
});

runRows.forEach((row, k) => {
  const name = row.cells[0];
  if (!runPage(k)) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = name.textContent;
    name.replaceChildren(button);
  }
  row.addEventListener("click", (event) => {
    if (!event.target.closest("a")) openRun(k);
  });
});
