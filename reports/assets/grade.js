"use strict";
// The class's table: sorted by a click on a heading, filtered, with the filters kept in the address.
const table = document.querySelector("table.class");
const form = document.querySelector("form.filters");

function compare(a, b) {
  return a !== "" && b !== "" && !isNaN(a) && !isNaN(b) ? a - b : a.localeCompare(b);
}

function sort(heading) {
  const column = heading.cellIndex;
  const order = heading.getAttribute("aria-sort") === "ascending" ? "descending" : "ascending";
  for (const other of table.tHead.rows[0].cells) other.setAttribute("aria-sort", "none");
  heading.setAttribute("aria-sort", order);
  const sign = order === "ascending" ? 1 : -1;
  const rows = [...table.tBodies[0].rows];
  rows.sort((a, b) => sign * compare(a.cells[column].dataset.key, b.cells[column].dataset.key));
  table.tBodies[0].append(...rows);
}

function filter() {
  const { name, verdict, mistake } = Object.fromEntries(new FormData(form));
  let shown = 0;
  for (const row of table.tBodies[0].rows) {
    row.hidden = !(row.dataset.name.includes(name.trim().toLowerCase())
      && (!verdict || row.dataset.verdicts.split(" ").includes(verdict))
      && (!mistake || row.dataset.mistakes.split(" ").includes(mistake)));
    const link = row.querySelector("a");
    document.querySelector(link.getAttribute("href")).hidden = row.hidden;
    shown += !row.hidden;
  }
  form.querySelector("output").textContent = `${shown} of ${table.tBodies[0].rows.length} students`;
  const kept = new URLSearchParams([...new FormData(form)].filter(([, value]) => value));
  history.replaceState(null, "", `#${kept.size ? `?${kept}` : ""}`);
}

function reveal() {
  const target = location.hash.startsWith("#student-") && document.querySelector(location.hash);
  const closed = target && target.querySelector("details.one");
  if (!closed) return;
  closed.open = true;
  target.scrollIntoView();
}

if (table) {
  for (const heading of table.tHead.rows[0].cells) heading.querySelector("button").addEventListener("click", () => sort(heading));
  for (const button of document.querySelectorAll("[data-mistake]")) {
    button.addEventListener("click", () => {
      form.reset();
      form.elements.mistake.value = button.dataset.mistake;
      filter();
      document.querySelector("#who").scrollIntoView();
    });
  }
  if (location.hash.startsWith("#?")) {
    for (const [name, value] of new URLSearchParams(location.hash.slice(2))) if (form.elements[name]) form.elements[name].value = value;
    filter();
  }
  form.addEventListener("input", filter);
  form.addEventListener("reset", () => setTimeout(filter));
  form.addEventListener("submit", (event) => event.preventDefault());
  addEventListener("hashchange", reveal);
  reveal();
}

// Full size view of a picture and its companions: they take each other's place, so that a difference blinks.
const dialog = document.querySelector("dialog");
const view = dialog.querySelector(".stage img");
let series = [], current = 0, zoom = 1;

function draw() {
  const shown = series[current];
  view.src = shown.src;
  view.alt = shown.alt;
  view.style.width = `${shown.naturalWidth * zoom}px`;
  dialog.querySelector(".caption").textContent = `${shown.alt} · ${current + 1} of ${series.length} · × ${zoom}`;
}

function open(image) {
  series = [...image.closest(".pictures").querySelectorAll("img.picture")];
  [current, zoom] = [series.indexOf(image), 1];
  dialog.showModal();
  draw();
}

for (const image of document.querySelectorAll("img.picture")) {
  image.tabIndex = 0;
  image.setAttribute("role", "button");
  image.addEventListener("click", () => open(image));
  image.addEventListener("keydown", (event) => {
    if (event.key === "Enter" || event.key === " ") { event.preventDefault(); open(image); }
  });
}

const keys = {
  ArrowRight: () => { current = (current + 1) % series.length; draw(); },
  ArrowLeft: () => { current = (current - 1 + series.length) % series.length; draw(); },
  "+": () => { zoom = Math.min(32, zoom * 2); draw(); },
  "-": () => { zoom = Math.max(0.25, zoom / 2); draw(); },
};
keys["="] = keys["+"];

dialog.querySelector(".close").addEventListener("click", () => dialog.close());
for (const button of dialog.querySelectorAll("[data-key]")) button.addEventListener("click", keys[button.dataset.key]);
dialog.addEventListener("keydown", (event) => {
  if (!keys[event.key]) return;
  event.preventDefault();
  keys[event.key]();
});
