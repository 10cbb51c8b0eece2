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
  setText("legend", status.picture ? status.picture.legend : "");
  showDevelopment(status);
  setText("yaml", status.camera_yaml.trimEnd());
  setText("lens", status.has_lens ? "Ctrl and a click focus the lens." : "");
  by("reset").disabled = !status.camera_moved;
  setText("tev", status.tev);
  drawChart(status.errors);
  showNotes();
}

function showDevelopment(status) {
  const exposure = by("exposure");
  if (!isUsed(exposure)) exposure.value = status.exposure_ev;
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

function stepExposure(stops) {
  if (view.status) change({ exposure_ev: Math.max(-100, Math.min(100, view.status.exposure_ev + stops)) });
}

by("exposure").addEventListener("input", (event) => change({ exposure_ev: Number(event.target.value) }));
by("exposure").addEventListener("dblclick", () => change({ exposure_ev: 0 }));
by("white").addEventListener("change", (event) => {
  const white = event.target.value;
  change({ white: white === "temperature" ? by("temperature").value + " K" : white });
});
by("temperature").addEventListener("input", (event) => change({ white: event.target.value + " K" }));
by("pause").addEventListener("click", () => change({ paused: !(view.status && view.status.paused) }));
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
by("save").addEventListener("click", async (event) => {
  event.preventDefault();
  try {
    const reply = await fetch(address("/image.exr"));
    if (!reply.ok) return say(await reply.text());
    const name = /filename="(.*)"/.exec(reply.headers.get("Content-Disposition"));
    const link = element("a", "", { download: name ? name[1] : "image.exr" });
    link.href = URL.createObjectURL(await reply.blob());
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  } catch (error) {
    say("The image was not saved: " + error.message);
  }
});

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

function row(table, name, text) {
  const line = element("tr");
  line.append(element("th", name), element("td", text));
  table.append(line);
}

async function askPixel(at) {
  const status = view.status;
  if (!status || !status.width) return;
  const x = Math.floor(at[0] * status.width), y = Math.floor(at[1] * status.height);
  const mark = by("mark"), box = canvas.getBoundingClientRect();
  const frame = by("frame").getBoundingClientRect();
  mark.style.left = box.left - frame.left + (x + 0.5) / status.width * box.width + "px";
  mark.style.top = box.top - frame.top + (y + 0.5) / status.height * box.height + "px";
  mark.hidden = false;
  let reply;
  try {
    reply = await fetch(address("/pixel", { x, y }));
  } catch (error) {
    return say(error.message);
  }
  if (!reply.ok) return say(await reply.text());
  showPixel(await reply.json());
}

function showPixel(pixel) {
  const table = element("table");
  const triple = (values) => values.map((v) => figure(v, 4)).join("  ");
  row(table, "Pixel", pixel.x + ", " + pixel.y + (pixel.preview ? " (preview)" : ""));
  row(table, "Radiance R G B", triple(pixel.rgb));
  row(table, "X Y Z", triple(pixel.xyz));
  if ("luminance_error" in pixel) row(table, "Error of Y", figure(pixel.luminance_error));
  row(table, "Samples", String(pixel.samples));
  if ("object" in pixel) row(table, "Object", pixel.object || "without a name");
  if (pixel.material) row(table, "Material", pixel.material);
  if ("primitive" in pixel) row(table, "Primitive", String(pixel.primitive));
  if ("depth" in pixel) row(table, "Distance", figure(pixel.depth, 4));
  const spectrum = pixel.spectrum || {};
  for (const response of spectrum.responses || []) row(table, response.name, figure(response.value, 4));
  by("pixel").className = "";
  by("pixel").replaceChildren(table);
  const svg = by("spectrum");
  svg.toggleAttribute("hidden", !spectrum.radiance);
  if (spectrum.radiance) drawSpectrum(svg, spectrum.wavelengths_nm, spectrum.radiance);
}

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
