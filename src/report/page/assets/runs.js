// Filters the table of the runs by words.

const filter = document.getElementById("filter");
const runRows = [...document.querySelectorAll("#runs tbody tr")];
const runWords = runRows.map((row) => row.textContent.toLowerCase());

function showMatching() {
  const words = filter.value.toLowerCase().split(/\s+/).filter(Boolean);
  let shown = 0;
  runRows.forEach((row, k) => {
    row.hidden = !words.every((word) => runWords[k].includes(word));
    if (!row.hidden) shown += 1;
  });
  document.getElementById("shown").textContent = `${shown} of ${runRows.length} runs`;
}

filter.addEventListener("input", showMatching);
showMatching();
