// Values become colours. Every function fills a picture of 8 bit red, green, blue and alpha.
const BLACK_TO_YELLOW = "000004 1b0c41 4a0c6b 781c6d a52c60 cf4446 ed6925 fb9b06 f7d13d fcffa4";
const BLUE_TO_ORANGE = "b8e6ff 52b6f4 1f78b4 12385a 0c0c0e 5a3410 b4621f f49a52 ffd9b0";

// 256 colours between the given ones.
function scale(stops) {
  const colours = stops.split(" ").map((text) => [0, 2, 4].map((at) => parseInt(text.slice(at, at + 2), 16)));
  const table = new Uint8ClampedArray(256 * 3);
  for (let i = 0; i < 256; i++) {
    const at = i / 255 * (colours.length - 1), low = Math.min(Math.floor(at), colours.length - 2);
    for (let c = 0; c < 3; c++) table[3 * i + c] = colours[low][c] + (at - low) * (colours[low + 1][c] - colours[low][c]);
  }
  return table;
}

const LINEAR = scale(BLACK_TO_YELLOW), SIGNED = scale(BLUE_TO_ORANGE);

// The picture, brighter by `stops`; truncated like the document's pictures; what is not a number is magenta.
function exposed(quanta, image, stops) {
  const area = quanta.length / 3, factor = data.quantum * 2 ** stops, pixels = image.data;
  for (let i = 0, at = 0; i < area; i++, at += 4) {
    for (let c = 0; c < 3; c++) pixels[at + c] = Math.floor(quanta[c * area + i] * factor + 1e-9);
    if (quanta[i] === NOT_A_NUMBER || quanta[area + i] === NOT_A_NUMBER || quanta[2 * area + i] === NOT_A_NUMBER) {
      pixels[at] = 255; pixels[at + 1] = 0; pixels[at + 2] = 255;
    }
    pixels[at + 3] = 255;
  }
}

// The channel that differs most, B less A, both clamped, in quanta; not a number is as wrong as can be.
function largestDifference(a, b, i, area, top) {
  let found = 0;
  for (let at = i; at < a.length; at += area) {
    if (a[at] === NOT_A_NUMBER || b[at] === NOT_A_NUMBER) {
      if (a[at] !== b[at]) return top;
      continue;
    }
    const difference = Math.min(top, Math.max(0, b[at])) - Math.min(top, Math.max(0, a[at]));
    if (Math.abs(difference) > Math.abs(found)) found = difference;
  }
  return found;
}

// The largest error of each pixel, 0 to 255 / gain levels; with a sign from minus to plus that.
function differing(a, b, image, gain, signed) {
  const area = a.length / 3, top = Math.round(255 / data.quantum), factor = data.quantum * gain;
  for (let i = 0; i < area; i++) {
    const difference = largestDifference(a, b, i, area, top) * factor;
    paint(image.data, i, signed ? SIGNED : LINEAR, signed ? 127.5 + difference / 2 : Math.abs(difference));
  }
}

// A map of whole numbers 0..255, amplified.
function mapped(bytes, image, gain) {
  for (let i = 0; i < bytes.length; i++) paint(image.data, i, LINEAR, bytes[i] * gain);
}

function paint(pixels, i, table, value) {
  const entry = 3 * Math.min(255, Math.max(0, Math.round(value)));
  for (let c = 0; c < 3; c++) pixels[4 * i + c] = table[entry + c];
  pixels[4 * i + 3] = 255;
}
