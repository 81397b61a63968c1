// The filters of the overview, kept in the address.
const form = document.querySelector(".filters");
const bodies = [...document.querySelectorAll(".comparisons tbody")];
const texts = new Map();

// Everything that is written about a renderer on a scene, its log included.
function wordsOf(body, row) {
  if (!texts.has(row)) texts.set(row, gatherWords(body, row));
  return texts.get(row);
}

function gatherWords(body, row) {
  const section = [...document.querySelectorAll("section.scene")].find((one) => one.dataset.scene === body.dataset.scene);
  const title = row.cells[2].textContent;
  const details = [...section.querySelectorAll("details")].filter((one) => one.firstChild.textContent.startsWith(`${title}:`));
  return [body.dataset.scene, row.textContent, ...details.map((one) => one.textContent)].join(" ").toLowerCase();
}

function passes(body, row, wanted) {
  if (wanted.scene && body.dataset.scene !== wanted.scene) return false;
  if (wanted.renderer && row.dataset.renderer !== wanted.renderer) return false;
  if (wanted.failed && !["failed", "disagree"].includes(row.dataset.outcome)) return false;
  if (wanted.class && !row.dataset.classes.split(" ").includes(wanted.class)) return false;
  return !wanted.search || wanted.search.toLowerCase().split(/\s+/).every((word) => wordsOf(body, row).includes(word));
}

function filter(wanted) {
  const narrow = FILTERS.some((name) => wanted[name]);
  let shown = 0, all = 0;
  for (const body of bodies) {
    let any = false;
    for (const row of body.rows) {
      const passing = passes(body, row, wanted), compared = row.dataset.kind === "comparison";
      row.hidden = !passing;
      any ||= passing;
      all += compared;
      shown += compared && passing;
    }
    if (any) body.rows[0].hidden = false;  // the reference, with the scene's name
    body.hidden = !any;
    for (const section of document.querySelectorAll("section.scene")) {
      if (section.dataset.scene === body.dataset.scene) section.hidden = !any;
    }
  }
  form.querySelector("output").textContent = narrow ? `${shown} of ${all} comparisons` : `${all} comparisons`;
  document.querySelector(".nothing").hidden = bodies.some((body) => !body.hidden);
}

function filtersFromForm() {
  return Object.fromEntries(FILTERS.map((name) => {
    const field = form.elements[name];
    return [name, field.type === "checkbox" ? (field.checked ? "1" : "") : field.value.trim()];
  }));
}

function filtersFromAddress() {
  const known = readAddress();
  for (const name of FILTERS) {
    const field = form.elements[name];
    if (field.type === "checkbox") field.checked = Boolean(known[name]);
    else field.value = known[name] ?? "";
  }
  filter(filtersFromForm());
}

form.addEventListener("submit", (event) => event.preventDefault());
form.addEventListener("input", () => { const wanted = filtersFromForm(); writeAddress(wanted); filter(wanted); });
form.addEventListener("reset", () => setTimeout(() => { const wanted = filtersFromForm(); writeAddress(wanted); filter(wanted); }));

for (const link of document.querySelectorAll("[data-jump]")) {
  link.addEventListener("click", (event) => {
    event.preventDefault();
    const target = document.getElementById(link.dataset.jump);
    target.scrollIntoView();
    target.focus();
  });
}
