"use strict";
// Packed pictures become arrays again; see reports/packing.py for the format.
const data = JSON.parse(document.getElementById("report-data").textContent);
const NOT_A_NUMBER = -(2 ** 31), MINUS_INFINITY = NOT_A_NUMBER + 1, INFINITY = 2 ** 31 - 1;

async function inflate(name) {
  const text = atob(document.getElementById(name).textContent);
  const packed = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) packed[i] = text.charCodeAt(i);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Width and height of what the page carries of a scene.
function shape(scene) {
  return [Math.ceil(scene.width / data.step), Math.ceil(scene.height / data.step)];
}

// The differences of a block as whole numbers: red of all pixels row by row, then green, then blue.
async function differences(name, count) {
  const bytes = await inflate(name), found = new Int32Array(count);
  for (let place = 0; place * count < bytes.length; place++) {
    for (let i = 0, from = place * count; i < count; i++) found[i] |= bytes[from + i] << (8 * place);
  }
  for (let i = 0; i < count; i++) found[i] = (found[i] >>> 1) ^ -(found[i] & 1);
  return found;
}

async function readQuanta(scene, picture, find) {
  const [width, height] = shape(scene), area = width * height;
  const quanta = await differences(picture.block, 3 * area);
  if (picture.base) {
    const base = await find(picture.base);
    for (let i = 0; i < quanta.length; i++) quanta[i] += base[i];
    return quanta;
  }
  for (let channel = 0; channel < 3; channel++) {
    const start = channel * area, end = start + area;
    for (let i = start + width; i < end; i++) quanta[i] += quanta[i - width];
    for (let row = start; row < end; row += width) {
      for (let i = row + 1; i < row + width; i++) quanta[i] += quanta[i - 1];
    }
  }
  return quanta;
}

function level(quantum) {
  if (quantum === NOT_A_NUMBER) return NaN;
  if (quantum === INFINITY) return Infinity;
  if (quantum === MINUS_INFINITY) return -Infinity;
  return quantum * data.quantum;
}

const clamped = (value) => Math.min(255, Math.max(0, value));

// The decoded pictures of one scene at a time, each decoded when it is first asked for.
const store = {
  scene: null,
  promises: new Map(),
  ready: new Map(),

  open(scene) {
    if (this.scene === scene) return;
    [this.scene, this.promises, this.ready] = [scene, new Map(), new Map()];
  },
  keep(name, begin) {
    const ready = this.ready;
    if (!this.promises.has(name)) {
      this.promises.set(name, begin().then((array) => { ready.set(name, array); return array; }));
    }
    return this.promises.get(name);
  },
  picture(picture) {
    const scene = this.scene;
    const find = (base) => this.picture(scene.pictures.find((other) => other.block === base));
    return this.keep(picture.block, () => readQuanta(scene, picture, find));
  },
  bytes(name) {
    return this.keep(name, () => inflate(name));
  },
};

// Where in a scene's arrays a pixel is kept, and which pixel is kept there.
function indexOf(scene, column, row) {
  const [width] = shape(scene);
  return Math.floor(row / data.step) * width + Math.floor(column / data.step);
}

function keptPixel(scene, column, row) {
  if (!scene.offsets) return [column, row];
  const offset = store.ready.get(scene.offsets)?.[indexOf(scene, column, row)] ?? 0;
  const first = (place) => place - place % data.step;
  return [first(column) + offset % data.step, first(row) + Math.floor(offset / data.step)];
}

// The three values of a pixel in levels, or nothing while they are being decoded.
function valuesAt(scene, picture, column, row) {
  const quanta = store.ready.get(picture.block);
  if (!quanta) return null;
  const area = quanta.length / 3, index = indexOf(scene, column, row);
  return [0, 1, 2].map((channel) => level(quanta[channel * area + index]));
}
