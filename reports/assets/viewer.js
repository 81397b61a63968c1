// The viewer: its state, its panel, and pointers.
const MODES = {
  slider: "Slider", blink: "Flip", side: "Side by side", difference: "Difference", signed: "Signed", ssim: "SSIM map", flip: "FLIP map",
};
const BLINK = 500;  // milliseconds that each picture is seen
const START = { mode: "slider", exposure: 0, gain: Math.round(Math.log2(data.amplified)), split: 50 };
const state = { scene: null, a: null, b: null, ...START, pixel: null, hover: null, hidden: new Set(), flipped: false, timer: null };
const part = (name) => viewer.querySelector(name);
const control = (name) => viewer.querySelector(`[data-state=${name}]`);

function element(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

const kindOf = (mark) => mark.class ?? (mark.approved ? "approved" : "unexplained");
const APPROVED = "Nothing explains it, and somebody has approved it.";

// A level with as many digits as the page carries.
function written(value) {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? "not a number" : value > 0 ? "∞" : "−∞";
  return value.toFixed(data.digits);
}

// The pixels of A and B that differ from the reference, worst first.
function marks() {
  const places = new Map();
  for (const picture of [state.b, state.a]) {
    for (const mark of picture.worst) {
      const place = `${mark.column},${mark.row}`, known = places.get(place);
      if (!known || (known.class && !mark.class)) places.set(place, mark);
    }
  }
  return [...places.values()];
}

const drawable = (scene) => scene.pictures.filter((picture) => picture.block);

// The picture that another was compared with.
const againstOf = (picture) => state.scene.pictures.find((other) => other.renderer === picture.against) ?? state.scene.pictures[0];

function find(scene, renderer, otherwise) {
  return drawable(scene).find((picture) => picture.renderer === renderer) ?? otherwise;
}

const whole = (text, low, high, otherwise) => {
  const value = Number.parseFloat(text);
  return Number.isFinite(value) ? Math.min(high, Math.max(low, value)) : otherwise;
};

// Shows what the address says, or nothing.
function showAddress() {
  const known = readAddress();
  const scene = data.scenes.find((one) => one.scene === known.view && drawable(one).length);
  if (!scene) return viewer.open && hideViewer();
  const all = drawable(scene);
  const changed = state.scene !== scene;
  state.scene = scene;
  state.a = find(scene, known.a, all[0]);
  state.b = find(scene, known.b, all.find((picture) => picture !== state.a) ?? all[0]);
  state.mode = known.mode in MODES ? known.mode : START.mode;
  state.exposure = whole(known.exposure, -8, 12, START.exposure);
  state.gain = Math.round(whole(known.gain, 0, 16, START.gain));
  state.split = whole(known.split, 0, 100, START.split);
  state.hidden = new Set((known.hide ?? "").split(",").filter(Boolean));
  const pixel = /^(\d+),(\d+)$/.exec(known.pixel ?? "");
  state.pixel = pixel && pixel[1] < scene.width && pixel[2] < scene.height ? [Number(pixel[1]), Number(pixel[2])] : null;
  const first = !viewer.open;
  if (first) viewer.showModal();
  if (changed) { store.open(scene); layers.clear(); state.hover = null; }
  if (first || changed) {
    fit();
    if (known.zoom) zoomAt(whole(known.zoom, 0.01, LARGEST_ZOOM, camera.zoom), stage.clientWidth / 2, stage.clientHeight / 2);
    if (state.pixel && known.zoom) lookAt(...state.pixel, 0);
    stage.focus();
  }
  fillChoices();
  return refresh();
}

function openViewer(scene, renderer, pixel = "") {
  const [first] = drawable(data.scenes.find((one) => one.scene === scene));
  const b = first.renderer === renderer ? "" : renderer;
  const a = data.scenes.find((one) => one.scene === scene).pictures.find((picture) => picture.renderer === renderer)?.against ?? "";
  writeAddress({ ...Object.fromEntries(VIEW.map((name) => [name, ""])), view: scene, a, b, pixel, zoom: pixel && "24" }, true);
  showAddress();
}

function hideViewer() {
  stopBlinking();
  viewer.close();
}

function closeViewer() {
  writeAddress(Object.fromEntries(VIEW.map((name) => [name, ""])));
  hideViewer();
}

// Takes over changes, keeps them in the address and shows them.
function change(changes) {
  Object.assign(state, changes);
  const other = (name) => (state[name] === START[name] ? "" : String(state[name]));
  writeAddress({
    view: state.scene.scene, a: state.a.renderer, b: state.b.renderer, mode: other("mode"), exposure: other("exposure"),
    gain: other("gain"), split: other("split"), pixel: state.pixel ? state.pixel.join(",") : "",
    zoom: camera.fits ? "" : String(Math.round(camera.zoom * 1000) / 1000), hide: [...state.hidden].join(","),
  });
  return refresh();
}

function changeScene(scene) {
  writeAddress({ ...Object.fromEntries(VIEW.map((name) => [name, ""])), view: scene.scene, a: state.a.renderer, b: state.b.renderer, mode: state.mode });
  showAddress();
  change({});
}

// Draws at once what is decoded, and the rest as it becomes so.
let latest = 0;
async function refresh() {
  const now = ++latest, { scene } = state, need = [state.a, state.b];
  const map = ["ssim", "flip"].includes(state.mode) && mappedPicture(state.mode)?.maps[state.mode];
  const begun = [...need.map((picture) => store.picture(picture)), ...(map ? [store.bytes(map)] : []), ...(scene.offsets ? [store.bytes(scene.offsets)] : [])];
  const waiting = [...need.map((picture) => picture.block), ...(map ? [map] : [])].some((name) => !store.ready.has(name));
  const missing = ["ssim", "flip"].includes(state.mode) && !map;
  part(".wait").textContent = waiting ? "decoding …" : missing ? "There is no such map of these pictures." : "";
  showPanel();
  draw();
  if (waiting) {
    await Promise.all(begun);
    if (now === latest) await refresh();
    return;
  }
  stage.dataset.ready = `${scene.scene}`;
  for (const picture of drawable(scene)) {
    if (store.ready.has(picture.block)) continue;
    await store.picture(picture);
    if (state.scene !== scene) return;
    showValues();
  }
}

function fillChoices() {
  const options = (list, chosen) => list.map(([value, text]) => element("option", { value, textContent: text, selected: value === chosen }));
  const scenes = data.scenes.filter((scene) => drawable(scene).length);
  control("view").replaceChildren(...options(scenes.map((scene) => [scene.scene, scene.scene]), state.scene.scene));
  const pictures = drawable(state.scene).map((picture) => [picture.renderer, picture.title]);
  control("a").replaceChildren(...options(pictures, state.a.renderer));
  control("b").replaceChildren(...options(pictures, state.b.renderer));
}

function showPanel() {
  for (const name of ["exposure", "gain", "split"]) control(name).value = state[name];
  control("a").value = state.a.renderer;
  control("b").value = state.b.renderer;
  part("output.exposure").textContent = `${state.exposure > 0 ? "+" : ""}${state.exposure} EV`;
  part("output.gain").textContent = `× ${2 ** state.gain}`;
  part("output.split").textContent = `${Math.round(state.split)} %`;
  part("output.zoom").textContent = `× ${Number(camera.zoom.toPrecision(3))}`;
  for (const button of viewer.querySelectorAll(".modes button")) {
    button.setAttribute("aria-checked", String(button.value === state.mode));
    button.tabIndex = button.value === state.mode ? 0 : -1;
  }
  viewer.dataset.mode = state.mode;
  const map = ["ssim", "flip"].includes(state.mode) && mappedPicture(state.mode);
  const versus = `${state.b.title} less ${state.a.title}`;
  const texts = {
    slider: [`A ${state.a.title}`, `B ${state.b.title}`], side: [`A ${state.a.title}`, `B ${state.b.title}`],
    blink: [state.flipped ? `B ${state.b.title}` : `A ${state.a.title}`, ""], difference: [`|${versus}|`, ""], signed: [versus, ""],
  }[state.mode] ?? [map ? `${MODES[state.mode]}: ${map.title} against ${againstOf(map).title}` : "", ""];
  [part(".label-a").textContent, part(".label-b").textContent] = texts;
  showLegend();
  showMarks();
  showValues();
}

function showLegend() {
  const colours = state.mode === "signed" ? SIGNED : LINEAR, bar = part(".legend canvas").getContext("2d");
  const image = bar.createImageData(256, 1);
  for (let i = 0; i < 256; i++) image.data.set([...colours.slice(3 * i, 3 * i + 3), 255], 4 * i);
  bar.putImageData(image, 0, 0);
  const top = Number((({ difference: 255, signed: 255 })[state.mode] ?? 1) / 2 ** state.gain).toPrecision(3) * 1;
  part(".legend .low").textContent = state.mode === "signed" ? `−${top}` : "0";
  part(".legend .high").textContent = state.mode === "signed" ? `+${top}` : String(top);
}

function showMarks() {
  const all = marks(), counts = {};
  for (const mark of all) counts[kindOf(mark)] = (counts[kindOf(mark)] ?? 0) + 1;
  const boxes = Object.entries(counts).map(([kind, count]) => {
    const [sign, colour] = SHAPES[kind] ?? ["·", "#fff"];
    const box = element("input", { type: "checkbox", value: kind, checked: !state.hidden.has(kind) });
    const shape = element("span", { className: "shape", textContent: sign, ariaHidden: "true" });
    shape.style.setProperty("--mark", colour);
    return element("label", { title: data.classes[kind] ?? (kind === "approved" ? APPROVED : "Nothing explains it: somebody is wrong.") }, box, shape, ` ${kind} `, element("span", { className: "quiet", textContent: count }));
  });
  const differing = state.b.differing || state.a.differing;
  const note = differing > all.length ? [element("p", { className: "quiet", textContent: `The worst ${all.length} of ${differing} pixels that differ are marked.` })] : [];
  const none = all.length ? [] : [element("p", { className: "quiet", textContent: `No pixel of these differs by more than ${data.tolerance} level.` })];
  part(".marks").replaceChildren(element("legend", { textContent: "Markers" }), ...boxes, ...note, ...none);
  const at = state.pixel ? all.findIndex((mark) => mark.column === state.pixel[0] && mark.row === state.pixel[1]) : -1;
  part(".place").textContent = all.length ? `${at < 0 ? "–" : at + 1} of ${all.length} marked` : "none marked";
}

function errorOf(values, right) {
  return Math.max(...values.map((value, c) => (Number.isNaN(value - right[c]) && !(value === right[c]) ? 255 : Math.abs(clamped(value) - clamped(right[c])))));
}

const UNITS = { difference: "levels, worst channel", signed: "levels, worst channel", ssim: "1 − SSIM", flip: "FLIP error" };

// What a map's colours mean, with its value at a pixel of the picture.
function showUnit(place) {
  const bytes = store.ready.get(mappedPicture(state.mode)?.maps[state.mode]);
  const value = bytes && place ? ` ${(bytes[indexOf(state.scene, ...place)] / 255).toFixed(3)} here` : "";
  part(".legend .unit").textContent = (UNITS[state.mode] ?? "") + value;
}

// Every renderer's values at the pixel under the pointer, else at the chosen one, and why they differ.
function showValues() {
  const place = state.hover ?? state.pixel;
  showUnit(place);
  if (!place) {
    part("h2.pixel").textContent = "Point at a pixel";
    part(".values tbody").replaceChildren();
    part(".why").replaceChildren();
    return;
  }
  const { scene } = state, [column, row] = keptPixel(scene, ...place);
  part("h2.pixel").textContent = `Column ${column}, row ${row}`;
  const [reference] = scene.pictures, right = reference.block && valuesAt(scene, reference, column, row);
  part(".values tbody").replaceChildren(...scene.pictures.map((picture) => {
    const side = picture === state.a ? "A" : picture === state.b ? "B" : "";
    const values = picture.block ? valuesAt(scene, picture, column, row) : null;
    const name = element("th", { scope: "row" }, element("span", { className: "side", textContent: side }), picture.title);
    const line = element("tr", {}, name);
    line.dataset.renderer = picture.renderer;
    if (!values) {
      name.prepend(element("span", { className: "swatch none" }));
      line.append(element("td", { colSpan: 4, className: "quiet", textContent: picture.block ? "…" : picture.left_out ? "left out for size" : picture.outcome.replaceAll("-", " "), title: picture.reason ?? "" }));
      return line;
    }
    const swatch = element("span", { className: "swatch" });
    swatch.style.background = `rgb(${values.map((value) => Math.floor(clamped(value)) || 0).join(" ")})`;
    name.prepend(swatch);
    line.append(...values.map((value) => element("td", { className: "number", textContent: written(value) })));
    const error = right && picture !== reference ? errorOf(values, right) : null;
    const wrong = error !== null && error > data.tolerance;
    line.append(element("td", { className: wrong ? "number wrong" : "number", textContent: error === null ? "" : written(error) }));
    return line;
  }));
  showWhy(scene, column, row);
}

function showWhy(scene, column, row) {
  const found = scene.pictures.flatMap((picture) => picture.worst.filter((mark) => mark.column === column && mark.row === row).map((mark) => [picture, mark]));
  const parts = found.map(([picture, mark]) => element("p", {},
    element("strong", { textContent: picture.title }), ": ",
    element("span", { className: mark.class ? "" : "wrong", textContent: `${SHAPES[kindOf(mark)]?.[0] ?? ""} ${kindOf(mark)}` }),
    mark.class ? `, ${mark.evidence}. ${data.classes[mark.class] ?? ""}` : mark.approved ? `. ${APPROVED}` : ": nothing explains this colour; somebody is wrong."));
  const tree = scene.rays[`${column},${row}`];
  if (tree) {
    parts.push(element("details", { open: true }, element("summary", { textContent: `The rays of ${scene.pictures[0].title} behind it` }),
      element("pre", { tabIndex: 0, textContent: tree.join("\n") })));
  }
  if (scene.depth !== null && scene.path !== "-") {
    parts.push(element("p", { className: "quiet", textContent: tree ? "Again: " : "The rays behind it: " }, element("code", { textContent:
      `crossray explain ${quoted(scene.path)} ${column} ${row} --size ${scene.width}x${scene.height} --depth ${scene.depth} --convention ${scene.convention}` })));
  }
  part(".why").replaceChildren(...parts);
}

const quoted = (path) => (/^[\w./-]+$/.test(path) ? path : `'${path.replaceAll("'", "'\\''")}'`);

// Chooses a pixel, says its values, and brings it into sight.
function choose(column, row, least = 0) {
  state.hover = null;
  const { scene } = state;
  const pixel = [Math.min(scene.width - 1, Math.max(0, column)), Math.min(scene.height - 1, Math.max(0, row))];
  const [pane] = panes(), [left, top] = toPane(pane, pixel[0] + 0.5, pixel[1] + 0.5);
  const outside = left < pane.left + 8 || top < pane.top + 8 || left > pane.left + pane.width - 8 || top > pane.top + pane.height - 8;
  if (least || outside) lookAt(...pixel, least);
  change({ pixel });
  const lines = [...part(".values tbody").rows].map((line) => [...line.cells].map((cell) => cell.textContent).join(" "));
  part(".spoken").textContent = `Column ${pixel[0]}, row ${pixel[1]}. ${lines.join("; ")}. ${part(".why").querySelector("p:not(.quiet)")?.textContent ?? ""}`;
}

function visit(step) {
  const all = marks().filter((mark) => !state.hidden.has(kindOf(mark)));
  if (!all.length) return;
  const at = state.pixel ? all.findIndex((mark) => mark.column === state.pixel[0] && mark.row === state.pixel[1]) : -1;
  const next = at < 0 ? (step > 0 ? 0 : all.length - 1) : (at + step + all.length) % all.length;
  choose(all[next].column, all[next].row, 16);
}

function flip() {
  change({ mode: "blink", flipped: !state.flipped });
}

function stopBlinking() {
  clearInterval(state.timer);
  state.timer = null;
}

function blink() {
  if (state.timer) return stopBlinking();
  state.timer = setInterval(() => (state.mode === "blink" ? flip() : stopBlinking()), BLINK);
  return flip();
}

// Pointers: one moves the picture or the divider or chooses a pixel, two zoom.
const pointers = new Map();
let gesture = null;

function placeOf(event) {
  const box = stage.getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top];
}

function pixelAt(left, top) {
  const [x, y] = toPicture(left, top).map(Math.floor);
  return x >= 0 && y >= 0 && x < state.scene.width && y < state.scene.height ? [x, y] : null;
}

stage.addEventListener("pointerdown", (event) => {
  if (event.button) return;
  stage.setPointerCapture(event.pointerId);
  const place = placeOf(event);
  pointers.set(event.pointerId, place);
  const onDivider = state.mode === "slider" && Math.abs(place[0] - stage.clientWidth * state.split / 100) < 16;
  gesture = { kind: pointers.size > 1 ? "pinch" : onDivider ? "divider" : "press", start: place };
});

stage.addEventListener("pointermove", (event) => {
  const place = placeOf(event), before = pointers.get(event.pointerId);
  if (!before) {
    state.hover = event.pointerType === "mouse" ? pixelAt(...place) : null;
    showValues();
    return;
  }
  const others = [...pointers].filter(([id]) => id !== event.pointerId).map(([, other]) => other);
  pointers.set(event.pointerId, place);
  if (gesture.kind === "divider") return void change({ split: Math.round(1000 * Math.min(1, Math.max(0, place[0] / stage.clientWidth))) / 10 });
  if (gesture.kind === "pinch" && others.length) {
    const distance = (p) => Math.max(1, Math.hypot(p[0] - others[0][0], p[1] - others[0][1]));
    zoomAt(camera.zoom * distance(place) / distance(before), (place[0] + others[0][0]) / 2, (place[1] + others[0][1]) / 2);
  } else if (gesture.kind === "press" && Math.hypot(place[0] - gesture.start[0], place[1] - gesture.start[1]) > 4) gesture.kind = "move";
  if (gesture.kind === "move" || gesture.kind === "pinch") {
    const share = gesture.kind === "pinch" ? 0.5 : 1;
    camera.x -= share * (place[0] - before[0]) / camera.zoom;
    camera.y -= share * (place[1] - before[1]) / camera.zoom;
    camera.fits = false;
    draw();
  }
});

function release(event) {
  if (!pointers.delete(event.pointerId)) return;
  const pixel = pixelAt(...placeOf(event));
  if (gesture.kind === "press" && event.type === "pointerup" && pixel) choose(...pixel);
  else if (!pointers.size) change({});
}
stage.addEventListener("pointerup", release);
stage.addEventListener("pointercancel", release);
stage.addEventListener("pointerleave", () => { if (state.hover) { state.hover = null; showValues(); } });
stage.addEventListener("dblclick", (event) => {
  const pixel = pixelAt(...placeOf(event));
  if (pixel) { lookAt(...pixel, 32); change({ pixel }); }
});
stage.addEventListener("wheel", (event) => {
  event.preventDefault();
  zoomAt(camera.zoom * 1.2 ** (-event.deltaY / 100), ...placeOf(event));
  change({});
}, { passive: false });

for (const [value, textContent] of Object.entries(MODES)) {
  const number = part(".modes").children.length + 1;
  const button = element("button", { type: "button", value, textContent, title: `${textContent} (${number})` });
  button.setAttribute("role", "radio");
  button.addEventListener("click", () => change({ mode: value }));
  part(".modes").append(button);
}
control("view").addEventListener("change", (event) => changeScene(data.scenes.find((scene) => scene.scene === event.target.value)));
for (const name of ["a", "b"]) control(name).addEventListener("change", (event) => change({ [name]: find(state.scene, event.target.value) }));
for (const name of ["exposure", "gain", "split"]) control(name).addEventListener("input", (event) => change({ [name]: Number(event.target.value) }));
part(".marks").addEventListener("change", (event) => {
  const hidden = new Set(state.hidden);
  if (event.target.checked) hidden.delete(event.target.value);
  else hidden.add(event.target.value);
  change({ hidden });
});
viewer.addEventListener("cancel", (event) => { event.preventDefault(); closeViewer(); });
new ResizeObserver(() => { if (viewer.open) { draw(); showPanel(); } }).observe(stage);

for (const link of document.querySelectorAll("[data-view]")) {
  link.addEventListener("click", (event) => {
    event.preventDefault();
    if (drawable(data.scenes.find((scene) => scene.scene === link.dataset.view)).length) openViewer(link.dataset.view, link.dataset.renderer, link.dataset.pixel);
  });
}
