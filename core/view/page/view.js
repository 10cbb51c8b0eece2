// The way of pictures from the program to the canvas, and of changes back.
const token = new URLSearchParams(location.search).get("token") || "";
const by = (id) => document.getElementById(id);
const canvas = by("canvas");
const paper = canvas.getContext("2d");
const view = {
  status: null,      // As the program last said it.
  picture: null,     // The part of the state that is on the canvas.
  frames: 0,         // Number of images drawn, for measurements.
  version: 0,
  connected: false,
};

function address(path, query = {}) {
  return path + "?" + new URLSearchParams({ ...query, token });
}

/// An element with text, and nothing but text: names and messages come from files.
function element(name, text = "", attributes = {}) {
  const made = document.createElement(name);
  made.textContent = text;
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

/// Where the whole picture lies within the stage, in CSS pixels.
function layOut() {
  const status = view.status;
  if (!status || !status.width) return;
  const frame = by("frame");
  const style = getComputedStyle(frame);
  const wide = frame.clientWidth - parseFloat(style.paddingLeft) - parseFloat(style.paddingRight);
  const narrow = matchMedia("(max-width: 760px)").matches;
  const high = narrow ? innerHeight * 0.55
    : frame.clientHeight - parseFloat(style.paddingTop) - parseFloat(style.paddingBottom);
  const scale = Math.min(wide / status.width, high / status.height);
  canvas.style.width = Math.round(status.width * scale) + "px";
  canvas.style.height = Math.round(status.height * scale) + "px";
  // Pixels are to be seen as such where they are large, and a preview is to look like the picture.
  const preview = view.picture && view.picture.divisor > 1;
  canvas.style.imageRendering = scale >= 3 && !preview ? "pixelated" : "auto";
  placeMark();
}

function draw(status, pixels) {
  const picture = status.picture;
  if (canvas.width !== picture.width || canvas.height !== picture.height) {
    canvas.width = picture.width;
    canvas.height = picture.height;
  }
  paper.putImageData(new ImageData(pixels, picture.width, picture.height), 0, 0);
  const resized = !view.picture || view.picture.divisor !== picture.divisor;
  view.picture = picture;
  view.frames += 1;
  by("waiting").hidden = true;
  drawScales(picture);
  if (resized) layOut();
}

/// Another program answers: drop the requests to the one before.
function forgetProgram() {
  changes = noChanges();
  probe.run = null;
}

async function look() {
  const picture = view.picture ? view.picture.number : 0;
  const reply = await fetch(address("/sight", { after: view.version, picture }),
    { signal: AbortSignal.timeout(25000) });
  if (reply.status === 403) throw new Error("the token of this page is no longer valid");
  if (!reply.ok) throw new Error("the program ends");
  const bytes = await reply.arrayBuffer();
  const length = new DataView(bytes).getUint32(0, true);
  const status = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length)));
  const before = view.status;
  if (before && before.program !== status.program) forgetProgram();
  view.status = status;
  view.version = status.version;
  if (bytes.byteLength > 4 + length) draw(status, new Uint8ClampedArray(bytes, 4 + length));
  else if (view.picture && status.picture) view.picture = status.picture;
  if (!before || before.width !== status.width || before.height !== status.height) layOut();
  setConnected(true);
  showStatus(status);
  followPixel();
}

function setConnected(connected, why = "") {
  const changed = view.connected !== connected;
  view.connected = connected;
  const live = by("live");
  live.className = connected ? "on" : "off";
  live.textContent = connected ? "live" : "connection lost";
  live.title = why;
  if (!changed) return;
  showNotes();
  if (connected) loadDevices();
}

/// For ever: what is lost may come back, at the same address.
async function keepLooking() {
  let pause = 250;
  while (true) {
    try {
      await look();
      pause = 250;
    } catch (error) {
      setConnected(false, error.message);
      // Another program at this address counts from the beginning.
      view.version = 0;
      view.picture = view.picture && { ...view.picture, number: 0 };
      await new Promise((done) => setTimeout(done, pause));
      pause = Math.min(pause * 1.5, 2000);
    }
  }
}

let said = null;

/// A sentence that goes by itself.
function say(text) {
  if (said) clearTimeout(said.timer);
  said = { text, timer: setTimeout(() => { said = null; showNotes(); }, 6000) };
  showNotes();
}

const dismissed = new Set();

function note(title, text, bad, canGo) {
  const box = element("div", "", { class: bad ? "bad" : "" });
  const words = element("div", title);
  if (text) words.append(element("pre", text));
  box.append(words);
  if (canGo) {
    const close = element("button", "×", { type: "button", "aria-label": "Dismiss" });
    close.addEventListener("click", () => { dismissed.add(title); showNotes(); });
    box.append(close);
  }
  return box;
}

let notesShown = "";

function showNotes() {
  const status = view.status || {};
  const notes = [];
  if (!view.connected && view.status)
    notes.push(["crt view does not respond. This is its last image; the page continues when crt view does.",
                "",
      true]);
  if (status.scene_error)
    notes.push([view.picture ? "The scene has errors. The image shows its last version without errors."
      : "The scene has errors.", status.scene_error, true]);
  if (status.render_error) notes.push(["Nothing is rendered.", status.render_error, true]);
  for (const warning of status.warnings || [])
    if (!dismissed.has(warning)) notes.push([warning, "", false, true]);
  if (said) notes.push([said.text, "", false, false]);
  const now = JSON.stringify(notes);
  if (now === notesShown) return;
  notesShown = now;
  by("notes").replaceChildren(...notes.map((n) => note(...n)));
  layOut();
}

addEventListener("resize", layOut);
addEventListener("DOMContentLoaded", keepLooking);
