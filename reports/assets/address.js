// What is shown, kept behind the # of the page's address: filters of the overview, and the viewer's state while it is open.
const FILTERS = ["failed", "renderer", "scene", "class", "search"];
const VIEW = ["view", "a", "b", "mode", "pixel", "zoom", "exposure", "gain", "split", "hide"];

function readAddress() {
  return Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
}

// Changes some entries; those that are empty are left out. `push` makes a step that "back" undoes.
function writeAddress(changes, push = false) {
  const known = { ...readAddress(), ...changes }, kept = new URLSearchParams();
  for (const name of [...FILTERS, ...VIEW]) if (known[name] !== undefined && known[name] !== "") kept.set(name, known[name]);
  const address = `#${kept}`;
  if (address === (location.hash || "#")) return;
  history[push ? "pushState" : "replaceState"](null, "", address);
}
