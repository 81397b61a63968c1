// The viewer's canvas: what is drawn where. Positions in a picture are in pixels of the scene, from its top left corner.
const viewer = document.querySelector("dialog.viewer");
const stage = viewer.querySelector(".stage");
const canvas = stage.querySelector("canvas");
const brush = canvas.getContext("2d");
const LARGEST_ZOOM = 128, VALUES_FROM = 52, LAYERS = 8;
const SHAPES = {
  unexplained: ["○", "#ff5a4d"], "knife-edge": ["◇", "#ffc24a"], "document-window": ["□", "#5cc8ff"],
  "renderer-precision": ["△", "#d59bff"], "declared-limit": ["✕", "#7fe0a7"],
  approved: ["◎", "#b9c4d0"],
};
const camera = { x: 0, y: 0, zoom: 1, fits: true };
const layers = new Map();

// The rectangles of the canvas that show a picture, in CSS pixels.
function panes() {
  const [width, height] = [stage.clientWidth, stage.clientHeight];
  if (state.mode !== "side") return [{ left: 0, top: 0, width, height }];
  if (width >= height) return [0, 1].map((i) => ({ left: i * width / 2, top: 0, width: width / 2, height }));
  return [0, 1].map((i) => ({ left: 0, top: i * height / 2, width, height: height / 2 }));
}

function fittingZoom() {
  const [pane] = panes();
  return Math.max(0.01, Math.min((pane.width - 16) / state.scene.width, (pane.height - 16) / state.scene.height));
}

function fit() {
  Object.assign(camera, { x: state.scene.width / 2, y: state.scene.height / 2, zoom: fittingZoom(), fits: true });
}

// Where a place of the picture is in a pane, and back.
function toPane(pane, x, y) {
  return [pane.left + pane.width / 2 + (x - camera.x) * camera.zoom, pane.top + pane.height / 2 + (y - camera.y) * camera.zoom];
}

function toPicture(left, top) {
  const all = panes();
  const pane = all.find((one) => left < one.left + one.width && top < one.top + one.height) ?? all.at(-1);
  return [camera.x + (left - pane.left - pane.width / 2) / camera.zoom, camera.y + (top - pane.top - pane.height / 2) / camera.zoom];
}

// Zooms so that the place under a point of the stage stays there.
function zoomAt(zoom, left, top) {
  const [x, y] = toPicture(left, top);
  const from = camera.zoom;
  camera.zoom = Math.min(LARGEST_ZOOM, Math.max(Math.min(0.1, fittingZoom()), zoom));
  camera.x = x - (x - camera.x) * from / camera.zoom;
  camera.y = y - (y - camera.y) * from / camera.zoom;
  camera.fits = false;
}

function lookAt(column, row, least) {
  Object.assign(camera, { x: column + 0.5, y: row + 0.5, zoom: Math.max(camera.zoom, least), fits: false });
}

// A picture of the scene's size, filled once for each key.
function layer(key, fill) {
  if (!layers.has(key)) {
    const [width, height] = shape(state.scene);
    const own = Object.assign(document.createElement("canvas"), { width, height });
    const context = own.getContext("2d"), image = context.createImageData(width, height);
    fill(image);
    context.putImageData(image, 0, 0);
    layers.set(key, own);
    if (layers.size > LAYERS) layers.delete(layers.keys().next().value);
  }
  return layers.get(key);
}

function pictureLayer(picture) {
  const quanta = picture.block && store.ready.get(picture.block);
  return quanta && layer(`${picture.block} ${state.exposure}`, (image) => exposed(quanta, image, state.exposure));
}

function differenceLayer(signed) {
  const [a, b] = [state.a, state.b].map((picture) => picture.block && store.ready.get(picture.block));
  const key = `${state.a.block} ${state.b.block} ${state.gain} ${signed}`;
  return a && b && layer(key, (image) => differing(a, b, image, 2 ** state.gain, signed));
}

function mapLayer(kind) {
  const name = mappedPicture(kind)?.maps[kind], bytes = name && store.ready.get(name);
  return bytes && layer(`${name} ${state.gain}`, (image) => mapped(bytes, image, 2 ** state.gain));
}

// The picture whose map is shown: a map tells how B, or else A, differs from the reference.
function mappedPicture(kind) {
  return [state.b, state.a].find((picture) => picture.maps[kind]);
}

function draw() {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [stage.clientWidth, stage.clientHeight];
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  }
  if (camera.fits) fit();
  brush.setTransform(ratio, 0, 0, ratio, 0, 0);
  brush.clearRect(0, 0, width, height);
  const all = panes();
  if (state.mode === "slider") {
    const edge = width * state.split / 100;
    drawPane(all[0], pictureLayer(state.a), state.a, [0, edge]);
    drawPane(all[0], pictureLayer(state.b), state.b, [edge, width]);
    drawDivider(edge, height - 36);
    drawOverlay(all[0]);
  } else if (state.mode === "side") {
    drawPane(all[0], pictureLayer(state.a), state.a);
    drawPane(all[1], pictureLayer(state.b), state.b);
    all.forEach(drawOverlay);
  } else if (state.mode === "blink") {
    const shown = state.flipped ? state.b : state.a;
    drawPane(all[0], pictureLayer(shown), shown);
    drawOverlay(all[0]);
  } else {
    const shown = { difference: () => differenceLayer(false), signed: () => differenceLayer(true) }[state.mode];
    drawPane(all[0], shown ? shown() : mapLayer(state.mode), null);
    drawOverlay(all[0]);
  }
}

function drawPane(pane, image, picture, span = null) {
  brush.save();
  brush.beginPath();
  brush.rect(span ? span[0] : pane.left, pane.top, span ? span[1] - span[0] : pane.width, pane.height);
  brush.clip();
  if (image) {
    const [left, top] = toPane(pane, 0, 0);
    brush.imageSmoothingEnabled = camera.zoom < 1;
    brush.imageSmoothingQuality = "high";
    brush.drawImage(image, left, top, image.width * data.step * camera.zoom, image.height * data.step * camera.zoom);
    if (picture && camera.zoom >= VALUES_FROM) drawValues(pane, picture);
  }
  brush.restore();
}

// The markers and the chosen pixel.
function drawOverlay(pane) {
  brush.save();
  brush.beginPath();
  brush.rect(pane.left, pane.top, pane.width, pane.height);
  brush.clip();
  for (const mark of marks()) if (!state.hidden.has(kindOf(mark))) drawMark(pane, mark);
  if (state.pixel) drawFrame(pane, ...state.pixel);
  brush.restore();
}

// A line between A and B, with a knob at `middle`.
function drawDivider(left, middle) {
  brush.fillStyle = "#000a";
  brush.fillRect(left - 2, 0, 4, stage.clientHeight);
  brush.fillStyle = "#fff";
  brush.fillRect(left - 1, 0, 2, stage.clientHeight);
  brush.beginPath();
  brush.arc(left, middle, 13, 0, 7);
  brush.fill();
  brush.fillStyle = "#111";
  for (const side of [-1, 1]) {
    brush.beginPath();
    brush.moveTo(left + side * 9, middle);
    brush.lineTo(left + side * 3, middle - 5);
    brush.lineTo(left + side * 3, middle + 5);
    brush.fill();
  }
}

// The levels of each pixel, written into it.
function drawValues(pane, picture) {
  const [left, top] = toPane(pane, 0, 0), zoom = camera.zoom;
  const first = (start, edge) => Math.max(0, Math.floor((start - edge) / zoom));
  brush.font = `${Math.min(15, zoom / 5.2)}px ui-monospace, monospace`;
  brush.textAlign = "center";
  for (let row = first(pane.top, top); row < state.scene.height && top + row * zoom < pane.top + pane.height; row++) {
    for (let column = first(pane.left, left); column < state.scene.width && left + column * zoom < pane.left + pane.width; column++) {
      const values = valuesAt(state.scene, picture, column, row);
      const bright = values[0] * 0.3 + values[1] * 0.6 + values[2] * 0.1;
      brush.fillStyle = bright * 2 ** state.exposure > 130 ? "#000d" : "#fffd";
      values.forEach((value, c) => brush.fillText(written(value), left + (column + 0.5) * zoom, top + (row + 0.32 + 0.23 * c) * zoom));
    }
  }
}

function drawFrame(pane, column, row) {
  const [left, top] = toPane(pane, column, row), side = Math.max(camera.zoom, 7);
  const inset = (side - camera.zoom) / 2;
  for (const [colour, thickness] of [["#000", 4], ["#fff", 2]]) {
    brush.strokeStyle = colour;
    brush.lineWidth = thickness;
    brush.strokeRect(left - inset - 1, top - inset - 1, side + 2, side + 2);
  }
}

function drawMark(pane, mark) {
  const [x, y] = toPane(pane, mark.column + 0.5, mark.row + 0.5), r = Math.max(7, camera.zoom * 0.5 + 6);
  const kind = kindOf(mark), path = new Path2D();
  if (kind === "unexplained") path.arc(x, y, r, 0, 7);
  else if (kind === "approved") for (const part of [1, 0.6]) { path.moveTo(x + part * r, y); path.arc(x, y, part * r, 0, 7); }
  else if (kind === "document-window") path.rect(x - r * 0.85, y - r * 0.85, r * 1.7, r * 1.7);
  else if (kind === "declared-limit") {
    for (const side of [-1, 1]) { path.moveTo(x - r, y - side * r); path.lineTo(x - r / 3, y - side * r / 3); path.moveTo(x + r / 3, y + side * r / 3); path.lineTo(x + r, y + side * r); }
  } else {
    const corners = kind === "knife-edge" ? [[0, -1.15], [1.15, 0], [0, 1.15], [-1.15, 0]] : [[0, -1.2], [1.1, 0.8], [-1.1, 0.8]];
    corners.forEach(([dx, dy], i) => path[i ? "lineTo" : "moveTo"](x + dx * r, y + dy * r));
    path.closePath();
  }
  for (const [colour, thickness] of [["#000b", 4.5], [SHAPES[kind]?.[1] ?? "#fff", 2]]) {
    brush.strokeStyle = colour;
    brush.lineWidth = thickness;
    brush.stroke(path);
  }
}
