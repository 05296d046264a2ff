// Tables that are sorted by a click on a column's name.

// The sorting key of a cell: numbers by value, "lost" above all, text by letters, missing ones last.
function sortingKey(text) {
  if (text === "" || text === "-") return [3, 0];
  if (text === "lost") return [1, 0];
  const number = Number.parseFloat(text);
  return Number.isNaN(number) ? [2, text] : [0, number];
}

function compared(a, b) {
  const [kindA, valueA] = sortingKey(a);
  const [kindB, valueB] = sortingKey(b);
  if (kindA !== kindB) return kindA - kindB;
  if (kindA === 2) return valueA.localeCompare(valueB);
  return valueA - valueB;
}

function sortBy(table, column, button) {
  const header = button.closest("th");
  const ascending = header.getAttribute("aria-sort") !== "ascending";
  for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
  header.setAttribute("aria-sort", ascending ? "ascending" : "descending");
  const body = table.tBodies[0];
  const rows = [...body.rows];
  const sign = ascending ? 1 : -1;
  rows.sort((a, b) => sign * compared(a.cells[column].textContent, b.cells[column].textContent));
  body.append(...rows);
}

for (const table of document.querySelectorAll("table.sortable")) {
  [...table.tHead.rows[0].cells].forEach((header, column) => {
    if (header.tagName !== "TH") return;
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = header.textContent;
    header.replaceChildren(button);
    button.addEventListener("click", () => sortBy(table, column, button));
  });
}
