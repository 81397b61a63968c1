// The keys of the viewer, and what the help says of them; then the page begins.
const help = document.querySelector("dialog.help");

function nextOf(list, one, step) {
  return list[(list.indexOf(one) + step + list.length) % list.length];
}

function move(columns, rows, event) {
  const [column, row] = state.pixel ?? [Math.floor(camera.x), Math.floor(camera.y)], far = event.shiftKey ? 10 : 1;
  if (state.pixel) choose(column + columns * far, row + rows * far);
  else choose(column, row);
}

function zoomBy(factor) {
  const [left, top] = [stage.clientWidth / 2, stage.clientHeight / 2];
  zoomAt(2 ** (factor > 1 ? Math.floor(Math.log2(camera.zoom) + 1.001) : Math.ceil(Math.log2(camera.zoom) - 1.001)), left, top);
  if (state.pixel && factor > 1) lookAt(...state.pixel, 0);
  change({});
}

const bounded = (value, low, high) => Math.min(high, Math.max(low, value));

const KEYS = [
  ...Object.entries(MODES).map(([mode, title], i) => [[String(i + 1)], title, () => change({ mode })]),
  [[" "], "Flip between A and B", () => flip()],
  [["b"], "Blink: flip twice a second, or stop", () => blink()],
  [["x"], "Exchange A and B", () => change({ a: state.b, b: state.a })],
  [["]"], "Next renderer as B", () => change({ b: nextOf(drawable(state.scene), state.b, 1) })],
  [["["], "Previous renderer as B", () => change({ b: nextOf(drawable(state.scene), state.b, -1) })],
  [["}"], "Next scene", () => changeScene(nextOf(data.scenes.filter((scene) => drawable(scene).length), state.scene, 1))],
  [["{"], "Previous scene", () => changeScene(nextOf(data.scenes.filter((scene) => drawable(scene).length), state.scene, -1))],
  [["n"], "Next marked pixel, worst first", () => visit(1)],
  [["p"], "Previous marked pixel", () => visit(-1)],
  [["ArrowLeft"], "One pixel to the left; with Shift ten", (event) => move(-1, 0, event)],
  [["ArrowRight"], "One pixel to the right", (event) => move(1, 0, event)],
  [["ArrowUp"], "One pixel up", (event) => move(0, -1, event)],
  [["ArrowDown"], "One pixel down", (event) => move(0, 1, event)],
  [["+", "="], "Larger", () => zoomBy(2)],
  [["-"], "Smaller", () => zoomBy(0.5)],
  [["0"], "Fit the picture to the window", () => { fit(); change({}); }],
  [["e"], "Brighter by half a stop", () => change({ exposure: bounded(state.exposure + 0.5, -8, 12) })],
  [["E"], "Darker by half a stop", () => change({ exposure: bounded(state.exposure - 0.5, -8, 12) })],
  [["g"], "Amplify differences twice as much", () => change({ gain: bounded(state.gain + 1, 0, 16) })],
  [["G"], "Amplify differences half as much", () => change({ gain: bounded(state.gain - 1, 0, 16) })],
  [[","], "Divider to the left", () => change({ mode: "slider", split: bounded(state.split - 5, 0, 100) })],
  [["."], "Divider to the right", () => change({ mode: "slider", split: bounded(state.split + 5, 0, 100) })],
  [["m"], "Show or hide all markers", () => change({ hidden: state.hidden.size ? new Set() : new Set(Object.keys(SHAPES)) })],
  [["r"], "Exposure, amplification, divider as at first", () => change({ exposure: START.exposure, gain: START.gain, split: START.split })],
  [["?", "h"], "These keys", () => help.showModal()],
  [["q"], "Back to the overview, as Escape does", () => closeViewer()],
];
const actions = new Map(KEYS.flatMap(([keys, , action]) => keys.map((key) => [key, action])));
const NAMES = { " ": "Space", ArrowLeft: "←", ArrowRight: "→", ArrowUp: "↑", ArrowDown: "↓", "-": "−" };

for (const [keys, text] of KEYS) {
  const term = element("dt");
  keys.forEach((key, i) => term.append(i ? " " : "", element("kbd", { textContent: NAMES[key] ?? key })));
  help.querySelector("dl").append(element("div", {}, term, element("dd", { textContent: text })));
}
help.querySelector(".close").addEventListener("click", () => help.close());

// Fields keep the keys that they need themselves.
function wantsKey(target, key) {
  if (target.matches("select, input[type=search]")) return true;
  if (target.matches("input[type=range]")) return key.startsWith("Arrow");
  return target.matches("button, input, summary") && (key === " " || key === "Enter");
}

viewer.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const radios = [...viewer.querySelectorAll(".modes button")];
  if (radios.includes(event.target) && event.key.startsWith("Arrow")) {
    const next = nextOf(radios, event.target, ["ArrowRight", "ArrowDown"].includes(event.key) ? 1 : -1);
    next.click();
    next.focus();
    event.preventDefault();
    return;
  }
  const action = actions.get(event.key);
  if (!action || wantsKey(event.target, event.key) || (event.target.matches("pre, .scroll") && event.key.startsWith("Arrow"))) return;
  event.preventDefault();
  action(event);
});
for (const button of viewer.querySelectorAll("[data-key]")) button.addEventListener("click", (event) => actions.get(button.dataset.key)(event));

window.addEventListener("popstate", () => { filtersFromAddress(); showAddress(); });
filtersFromAddress();
showAddress();
