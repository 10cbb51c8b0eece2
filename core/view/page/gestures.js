// Mouse, fingers and keys.
const half = Math.PI;  // Dragging across the image turns the camera by this.
const fingers = new Map();
let pressed = null;    // Where one finger or button went down, until it moves too far to be a click.
let dragKind = "orbit";
let pinch = null;      // Middle and distance of two fingers.

function place(event) {
  const box = canvas.getBoundingClientRect();
  return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
}

function twoFingers() {
  const [a, b] = [...fingers.values()];
  const box = canvas.getBoundingClientRect();
  return {
    middle: [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2],
    distance: Math.hypot((a[0] - b[0]) * box.width, (a[1] - b[1]) * box.height),
  };
}

canvas.addEventListener("pointerdown", (event) => {
  canvas.setPointerCapture(event.pointerId);
  fingers.set(event.pointerId, place(event));
  pinch = fingers.size === 2 ? twoFingers() : null;
  pressed = fingers.size === 1 ? { at: [event.clientX, event.clientY], event } : null;
  dragKind = event.shiftKey || event.button !== 0 ? "pan" : "orbit";
});

canvas.addEventListener("pointermove", (event) => {
  const before = fingers.get(event.pointerId);
  if (!before) return;
  const now = place(event);
  if (pressed) {
    const far = Math.hypot(event.clientX - pressed.at[0], event.clientY - pressed.at[1]);
    if (far < 4) return;
    pressed = null;
  }
  fingers.set(event.pointerId, now);
  if (pinch && fingers.size === 2) {
    const next = twoFingers();
    const moved = [next.middle[0] - pinch.middle[0], pinch.middle[1] - next.middle[1]];
    change({ pan: moved });
    change({ dolly: Math.min(10, Math.max(0.1, pinch.distance / Math.max(next.distance, 1))) });
    pinch = next;
    return;
  }
  const right = now[0] - before[0], down = now[1] - before[1];
  if (dragKind === "pan") change({ pan: [right, -down] });
  else change({ orbit: [-right * half, down * half * canvas.clientHeight / canvas.clientWidth] });
});

function lift(event) {
  const click = pressed && event.type === "pointerup" && event.button === 0;
  if (click && fingers.has(event.pointerId)) {
    const at = place(event);
    const inside = at.every((part) => part >= 0 && part < 1);
    if (inside && (event.ctrlKey || event.metaKey)) change({ focus: at });
    else if (inside) askPixel(at);
  }
  fingers.delete(event.pointerId);
  pinch = null;
  pressed = null;
}
canvas.addEventListener("pointerup", lift);
canvas.addEventListener("pointercancel", lift);
canvas.addEventListener("contextmenu", (event) => event.preventDefault());
canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  const lines = event.deltaMode === 0 ? event.deltaY / 100 : event.deltaY / 3;
  change({ dolly: Math.exp(0.15 * Math.max(-5, Math.min(5, lines))) });
}, { passive: false });

const planeKeys = ["image", "error", "albedo", "normal", "depth", "primitive"];
const keys = {
  " ": () => by("pause").click(),
  r: () => change({ reset_camera: true }),
  c: () => by("copy").click(),
  s: () => by("save").click(),
  p: () => by("save-png").click(),
  "?": () => by("help").showModal(),
  "+": () => change({ dolly: 0.9 }),
  "=": () => change({ dolly: 0.9 }),
  "-": () => change({ dolly: 1 / 0.9 }),
  "[": () => change({ exposure_step: -1 / 3 }),
  "]": () => change({ exposure_step: 1 / 3 }),
  ",": () => change({ zoom: 1.1 }),
  ".": () => change({ zoom: 1 / 1.1 }),
  Escape: () => clearPixel(),
};
planeKeys.forEach((plane, i) => { keys[i + 1] = () => change({ plane }); });
const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

addEventListener("keydown", (event) => {
  const on = event.target;
  const typing = on.matches("input:not([type=range]), select") || by("help").open;
  if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.key === " " && on.matches("button, a")) return;
  const arrow = arrows[event.key];
  if (arrow && on === canvas) {
    event.preventDefault();
    const [right, up] = arrow;
    if (event.shiftKey) change({ pan: [-right * 0.04, -up * 0.04] });
    else change({ orbit: [right * 0.08, up * 0.08] });
  } else if (keys[event.key]) {
    event.preventDefault();
    keys[event.key]();
  }
});
