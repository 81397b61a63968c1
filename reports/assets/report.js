"use strict";
// Full size view: arrows switch between the pictures of a scene in place (flip), + and - zoom, Escape closes.
const dialog = document.querySelector("dialog");
const stage = dialog.querySelector(".stage");
const view = stage.querySelector("img");
let series = [], current = 0, zoom = 1;

function draw() {
  const shown = series[current];
  view.src = shown.src;
  view.alt = shown.alt;
  view.width = shown.naturalWidth * zoom;
  view.height = shown.naturalHeight * zoom;
  dialog.querySelector(".caption").textContent =
    `${shown.alt} · ${current + 1} of ${series.length} · × ${zoom} · ← → switch, + − zoom, Esc closes`;
}

function open(image) {
  series = [...image.closest(".pictures").querySelectorAll("img.picture")];
  current = series.indexOf(image);
  zoom = 1;
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

dialog.querySelector(".close").addEventListener("click", () => dialog.close());
dialog.addEventListener("keydown", (event) => {
  const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  const scale = { "+": 2, "=": 2, "-": 0.5 }[event.key];
  if (step) current = (current + step + series.length) % series.length;
  else if (scale) zoom = Math.min(32, Math.max(0.25, zoom * scale));
  else return;
  event.preventDefault();
  draw();
});
