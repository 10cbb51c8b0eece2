// What stands beside the picture.
const planes = planeKeys;
for (const plane of planes) {
  const button = element("button", plane, { type: "button" });
  button.addEventListener("click", () => change({ plane }));
  by("planes").append(button);
}

function figure(value, digits = 3) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e5)) return value.toExponential(digits - 1);
  return String(Number(value.toPrecision(digits)));
}

function rate(value) {
  if (!(value > 0)) return "–";
  const [unit, name] = value >= 1e9 ? [1e9, " G"] : value >= 1e6 ? [1e6, " M"] : value >= 1e3 ? [1e3, " k"]
    : [1, ""];
  return figure(value / unit) + name;
}

function percent(value) {
  return figure(100 * value) + " %";
}

function setText(id, text) {
  const there = by(id);
  if (there.textContent !== text) there.textContent = text;
}

/// Numbers that stand at equal distances along a bar.
function ticks({ low, high, logarithmic }) {
  const parts = logarithmic ? Math.round(Math.log10(high / low)) : 2;
  return Array.from({ length: parts + 1 }, (_, i) =>
    logarithmic ? low * 10 ** i : low + i / parts * (high - low));
}

function scaleBar(scale) {
  const unit = scale.unit ? " " + scale.unit : "";
  const numbers = ticks(scale).map((value) => figure(value, 4));
  numbers[0] += unit;
  numbers[numbers.length - 1] += unit;
  const box = element("div", "", { class: "scale", role: "img",
    "aria-label": (scale.name ? scale.name + ": " : "") + numbers[0] + " to " + numbers[numbers.length - 1] });
  const bar = element("i");
  bar.style.background = "linear-gradient(to right, " + scale.colours.join(", ") + ")";
  const line = element("div", "", { class: "ticks" });
  line.append(...numbers.map((text) => element("span", text)));
  if (scale.name) box.append(element("b", scale.name));
  box.append(bar, line);
  return box;
}

let scalesDrawn = "";

/// The quantity that the picture's colours show.
function drawScales({ legend, scales }) {
  const now = JSON.stringify([legend, scales]);
  if (now === scalesDrawn) return;
  scalesDrawn = now;
  const parts = scales.map(scaleBar);
  if (legend) parts.unshift(element("p", legend));
  by("legend").replaceChildren(...parts);
  layOut();
}

function isUsed(control) {
  return document.activeElement === control;
}

function showStatus(status) {
  setText("title", status.title || "crt view");
  setText("file", status.file);
  document.title = (status.title || status.file) + " – crt view";
  setText("device", [status.backend, status.device].filter(Boolean).join(" on "));
  const preview = status.picture && status.picture.divisor > 1;
  setText("waiting", status.stage || (status.scene_error ? "" : "waiting for the first picture"));
  setText("samples", preview ? "preview" : String(status.samples));
  setText("wanted", preview ? "at 1/" + status.picture.divisor + " of the size"
    : "of " + status.samples_wanted + " samples");
  setText("speed", rate(status.paths_per_second));
  const known = status.errors.length ? status.errors[status.errors.length - 1] : null;
  setText("error", known ? percent(known[2]) : "–");
  by("bar").firstElementChild.style.width = 100 * status.samples / Math.max(1, status.samples_wanted) + "%";
  setText("pause", status.paused ? "Go on" : "Pause");
  if (!isUsed(by("count"))) by("count").value = status.samples_wanted;
  for (const button of by("planes").children)
    button.setAttribute("aria-pressed", String(button.textContent === status.plane));
  showDevelopment(status);
  showFov(status);
  setText("yaml", status.camera_yaml.trimEnd());
  setText("lens", status.has_lens ? "Ctrl and a click focus the lens." : "");
  by("reset").disabled = !status.camera_moved;
  drawChart(status.errors);
  showNotes();
}

function showDevelopment(status) {
  if (knowsAllChanges(status)) by("exposure").value = status.exposure_ev;
  setText("stops", (status.exposure_ev >= 0 ? "+" : "") + figure(status.exposure_ev) + " stops");
  const white = by("white");
  const names = [...status.whites, "temperature"];
  if (white.dataset.names !== JSON.stringify(names)) {
    white.dataset.names = JSON.stringify(names);
    const says = { scene: "as the scene says", none: "not balanced", temperature: "a temperature" };
    white.replaceChildren(...names.map((n) => element("option", says[n] || n, { value: n })));
  }
  const kelvin = status.white.endsWith(" K");
  if (!isUsed(white)) white.value = kelvin ? "temperature" : status.white;
  by("kelvins").hidden = !kelvin;
  if (kelvin) setText("kelvin", status.white);
}

function showFov(status) {
  if (!knowsAllChanges(status)) return;
  const degrees = status.camera.fov_deg;
  by("fov").value = degrees;
  if (!isUsed(by("fov-number"))) by("fov-number").value = figure(degrees, 4);
}

by("fov").addEventListener("input", (event) => change({ fov_deg: Number(event.target.value) }));
by("fov-number").addEventListener("change", (event) => {
  const degrees = Number(event.target.value);
  if (event.target.checkValidity() && degrees > 0) change({ fov_deg: degrees });
  else say("The field of view goes from 0.01° to 175°.");
});
by("exposure").addEventListener("input", (event) => change({ exposure_ev: Number(event.target.value) }));
by("exposure").addEventListener("dblclick", () => change({ exposure_ev: 0 }));
by("white").addEventListener("change", (event) => {
  const white = event.target.value;
  change({ white: white === "temperature" ? by("temperature").value + " K" : white });
});
by("temperature").addEventListener("input", (event) => change({ white: event.target.value + " K" }));
by("pause").addEventListener("click", () => change({ toggle_paused: true }));
by("count").addEventListener("change", (event) => {
  const samples = Number(event.target.value);
  if (Number.isInteger(samples) && samples >= 1) change({ samples });
});
by("reset").addEventListener("click", () => change({ reset_camera: true }));
by("help-button").addEventListener("click", () => by("help").showModal());
by("copy").addEventListener("click", async () => {
  try {
    await navigator.clipboard.writeText(view.status.camera_yaml);
    say("The camera is in the clipboard: put it into the scene's section 'camera'.");
  } catch {
    getSelection().selectAllChildren(by("yaml"));
    say("The browser gives no way to the clipboard: the text is selected instead.");
  }
});
for (const [button, file] of [["save", "/image.exr"], ["save-png", "/image.png"]])
  by(button).addEventListener("click", () => save(file));

async function save(file) {
  try {
    await allArrived();
    const reply = await fetch(address(file));
    if (!reply.ok) return say(await reply.text());
    const name = /filename="(.*)"/.exec(reply.headers.get("Content-Disposition"));
    const link = element("a", "", { download: name ? name[1] : file.slice(1) });
    link.href = URL.createObjectURL(await reply.blob());
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  } catch (error) {
    say("The image was not saved: " + error.message);
  }
}

async function loadDevices() {
  const list = by("devices");
  try {
    const backends = await (await fetch(address("/devices"))).json();
    const options = [element("option", "the best there is", { value: "auto|" })];
    for (const backend of backends) {
      for (const device of backend.devices)
        options.push(element("option", backend.name + ": " + device.name,
          { value: backend.name + "|" + device.index }));
      if (backend.reason) {
        const gone = element("option", backend.name + ": cannot run", { value: "", title: backend.reason });
        gone.disabled = true;
        options.push(gone);
      }
    }
    list.replaceChildren(element("option", "as it was started", { value: "" }), ...options);
  } catch {
    // The connection is lost: it is asked for again when it is back.
  }
}
by("devices").addEventListener("change", (event) => {
  if (!event.target.value) return;
  const [backend, device] = event.target.value.split("|");
  change({ backend, device });
});

function shape(name, attributes, text = "") {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.textContent = text;
  return made;
}

const plot = { wide: 280, high: 120, left: 38, right: 6, top: 8, bottom: 20 };

function mapped(values, from, to, logarithmic) {
  const f = logarithmic ? Math.log : (v) => v;
  const low = f(Math.min(...values)), range = f(Math.max(...values)) - low || 1;
  return (v) => from + (f(v) - low) / range * (to - from);
}

function path(points) {
  return points.map(([x, y], i) => (i ? "L" : "M") + x.toFixed(1) + " " + y.toFixed(1)).join("");
}

function drawAxes(svg, labels) {
  const { wide, high, left, right, top, bottom } = plot;
  svg.setAttribute("viewBox", "0 0 " + wide + " " + high);
  svg.replaceChildren(shape("path", { class: "axis",
    d: path([[left, top], [left, high - bottom], [wide - right, high - bottom]]) }));
  const at = [[left - 4, top + 8, "end"], [left - 4, high - bottom, "end"], [left, high - 6, "start"],
    [wide - right, high - 6, "end"]];
  labels.forEach((text, i) =>
    svg.append(shape("text", { x: at[i][0], y: at[i][1], "text-anchor": at[i][2] }, text)));
}

function drawSpectrum(svg, wavelengths, radiance) {
  const top = Math.max(...radiance, 0);
  const x = mapped(wavelengths, plot.left, plot.wide - plot.right);
  const y = mapped([0, top || 1], plot.high - plot.bottom, plot.top);
  drawAxes(svg, [figure(top), "0", wavelengths[0] + " nm", wavelengths[wavelengths.length - 1] + " nm"]);
  svg.append(shape("path", { class: "line", d: path(wavelengths.map((w, i) => [x(w), y(radiance[i])])) }));
}

let chartOf = "";

/// Both axes logarithmic: what converges falls on a line.
function drawChart(errors) {
  const points = errors.filter(([seconds, , error, lower]) => seconds > 0 && error > 0 && lower > 0);
  const now = points.length + " " + (points.length ? points[points.length - 1].join() : "");
  if (now === chartOf) return;
  chartOf = now;
  const svg = by("chart");
  if (points.length < 2) {
    svg.replaceChildren();
    return setText("chart-text", "after some samples");
  }
  const seconds = points.map((p) => p[0]);
  const bounds = points.flatMap((p) => [p[3], p[4]]);
  const x = mapped(seconds, plot.left, plot.wide - plot.right, true);
  const y = mapped(bounds, plot.high - plot.bottom, plot.top, true);
  drawAxes(svg, [percent(Math.max(...bounds)), percent(Math.min(...bounds)), figure(seconds[0]) + " s",
    figure(seconds[seconds.length - 1]) + " s"]);
  const band = [...points.map((p) => [x(p[0]), y(p[4])]), ...points.map((p) => [x(p[0]), y(p[3])]).reverse()];
  svg.append(shape("path", { class: "band", d: path(band) + "Z" }),
    shape("path", { class: "line", d: path(points.map((p) => [x(p[0]), y(p[2])])) }));
  const last = points[points.length - 1];
  setText("chart-text", percent(last[2]) + " (" + percent(last[3]) + " to " + percent(last[4]) + ") after " +
    last[1] + " samples, relative to the image's mean luminance");
}
