// The pixel that was clicked on: its numbers are always of the picture that is shown.
const probe = {
  at: null,        // The pixel of the film; null: none.
  size: "",        // Of the film that it is a pixel of.
  run: null,       // The pixel whose numbers are shown; null: none.
  number: 0,       // Of the picture at the time of the request.
  reading: false,
};
const sizeOf = (status) => status.width + " x " + status.height;

function askPixel(at) {
  const status = view.status;
  if (!status || !status.width) return;
  probe.at = [Math.floor(at[0] * status.width), Math.floor(at[1] * status.height)];
  probe.size = sizeOf(status);
  probe.run = null;
  placeMark();
  readPixel();
}

function clearPixel() {
  probe.at = null;
  probe.run = null;
  placeMark();
  by("pixel").className = "hint";
  by("pixel").replaceChildren("click on the image");
  by("spectrum").toggleAttribute("hidden", true);
}

function placeMark() {
  const mark = by("mark"), status = view.status;
  mark.hidden = !probe.at || !status || probe.size !== sizeOf(status);
  if (mark.hidden) return;
  const box = canvas.getBoundingClientRect(), frame = by("frame").getBoundingClientRect();
  const [left, top] = [(probe.at[0] + 0.5) / status.width, (probe.at[1] + 0.5) / status.height];
  mark.style.left = box.left - frame.left + left * box.width + "px";
  mark.style.top = box.top - frame.top + top * box.height + "px";
}

/// True if numbers of that run belong to the picture on the page.
function isShown(run) {
  return view.picture !== null && view.picture.of_this_camera && view.picture.run === run;
}

/// After each status: numbers of an earlier view go at once, those of a later picture are asked for.
function followPixel() {
  if (!probe.at) return;
  if (probe.size !== sizeOf(view.status)) return clearPixel();
  if (!isShown(probe.run)) {
    probe.run = null;
    for (const cell of document.querySelectorAll("#pixel tr:not(:first-child) td")) cell.textContent = "…";
    by("spectrum").replaceChildren();
  }
  const picture = view.picture;
  if (picture && picture.of_this_camera && (probe.run === null || probe.number !== picture.number)) readPixel();
}

/// One request at a time, and another where pixel or picture have changed meanwhile.
async function readPixel() {
  if (probe.reading || !view.picture) return;
  probe.reading = true;
  const { at } = probe, { number } = view.picture;
  try {
    const reply = await fetch(address("/pixel", { x: at[0], y: at[1] }));
    const text = await reply.text();
    if (probe.at === at) takePixel(reply.ok, text, number);
  } catch {
    // The connection is lost: the next status requests them again.
  }
  probe.reading = false;
  if (probe.at !== at || view.picture.number !== number) followPixel();
}

function takePixel(ok, text, number) {
  if (!ok) {
    clearPixel();
    return say(text);
  }
  const pixel = JSON.parse(text);
  if (!isShown(pixel.run)) return;
  probe.run = pixel.run;
  probe.number = number;
  showPixel(pixel);
}

function row(table, name, text) {
  const line = element("tr");
  line.append(element("th", name), element("td", text));
  table.append(line);
}

function showPixel(pixel) {
  const table = element("table");
  const triple = (values) => values.map((v) => figure(v, 4)).join("  ");
  row(table, "Pixel", pixel.x + ", " + pixel.y + (pixel.preview ? " (preview)" : ""));
  row(table, "X Y Z", triple(pixel.xyz) + "  " + pixel.unit);
  row(table, "R G B", triple(pixel.rgb) + "  " + pixel.unit);
  row(table, "Luminance", figure(pixel.luminance_cd_m2, 4) + " cd/m²");
  if ("luminance_error_cd_m2" in pixel)
    row(table, "Standard error", figure(pixel.luminance_error_cd_m2) + " cd/m²");
  row(table, "Samples", String(pixel.samples));
  if ("object" in pixel) row(table, "Object", pixel.object || "without a name");
  if (pixel.material) row(table, "Material", pixel.material);
  if ("primitive" in pixel) row(table, "Primitive", String(pixel.primitive));
  if ("depth" in pixel) row(table, "Distance", figure(pixel.depth, 4) + " scene units");
  const spectrum = pixel.spectrum || {};
  for (const response of spectrum.responses || []) row(table, response.name, figure(response.value, 4));
  by("pixel").className = "";
  by("pixel").replaceChildren(table);
  const svg = by("spectrum");
  svg.toggleAttribute("hidden", !spectrum.radiance);
  if (spectrum.radiance) drawSpectrum(svg, spectrum.wavelengths_nm, spectrum.radiance);
}

