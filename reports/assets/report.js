"use strict";
// Full size view of a scene's pictures: they take each other's place, so that a difference blinks.
const dialog = document.querySelector("dialog");
const stage = dialog.querySelector(".stage");
const view = stage.querySelector("img");
let series = [], marks = [], current = 0, mark = -1, zoom = 1;

function draw() {
  const shown = series[current];
  view.src = shown.src;
  view.alt = shown.alt;
  view.style.width = `${shown.naturalWidth * zoom}px`;
  view.style.height = `${shown.naturalHeight * zoom}px`;
  const place = mark < 0 ? "" : ` · column ${marks[mark].column}, row ${marks[mark].row}`;
  dialog.querySelector(".caption").textContent = `${shown.alt} · ${current + 1} of ${series.length} · × ${zoom}${place}`;
}

function open(image) {
  series = [...image.closest(".pictures").querySelectorAll("img.picture")];
  marks = JSON.parse(image.closest(".pictures").dataset.marks);
  [current, mark, zoom] = [series.indexOf(image), -1, 1];
  dialog.showModal();
  draw();
}

function visit(step) {
  if (!marks.length) return;
  mark = (mark + step + marks.length) % marks.length;
  zoom = Math.max(zoom, 16);
  draw();
  stage.scrollLeft = (marks[mark].column + 0.5) * zoom - stage.clientWidth / 2;
  stage.scrollTop = (marks[mark].row + 0.5) * zoom - stage.clientHeight / 2;
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
  n: () => visit(1),
  p: () => visit(-1),
};
keys["="] = keys["+"];

dialog.querySelector(".close").addEventListener("click", () => dialog.close());
for (const button of dialog.querySelectorAll("[data-key]")) button.addEventListener("click", keys[button.dataset.key]);
dialog.addEventListener("keydown", (event) => {
  if (!keys[event.key]) return;
  event.preventDefault();
  keys[event.key]();
});
