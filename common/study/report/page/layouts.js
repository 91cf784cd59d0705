// Charts of layouts of several parts: maps of two parts, as SVG, and bars of any number. A cell of
// a map shows its verdict by its shape, too: free is a ring, undecided is hatched, colliding is
// filled.
const kMap = {width: 520, left: 64, right: 10, top: 8, bottom: 48, maxTicks: 8};

function svg(name, attributes, ...children) {
  const node = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.append(...children);
  return node;
}

const kWholeSteps = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000];
const kHint = "Point at a layout to see its values.";

// All that is known of a layout, in one line.
function layoutText(joint, layout) {
  const places = joint.places.map((name, i) => `${name} ${layout.places_cm[i].toFixed(2)} cm`);
  let text = `${layout.name ? `${layout.name}, ` : ""}${places.join(", ")}: `;
  const verdicts = {free: "certified free", undecided: "undecided"};
  text += verdicts[layout.verdict] ?? `collision ${seconds(layout.collision_s)}`;
  if (joint.with_distances) {
    if (layout.verdict === "colliding") text += `, penetration ${layout.penetration}`;
    text += `, clearance ${layout.clearance}`;
  }
  return layout.parts.length > 0 ? `${text} (${layout.parts.join(", ")})` : text;
}

// The number that a map of the quantity shows of a layout; null: none.
function shownValue(layout, quantity) {
  if (quantity === "clearance")
    return layout.verdict === "colliding" ? null : layout.clearance_cm[0];
  if (layout.verdict !== "colliding") return null;
  if (quantity === "collision") return layout.collision_s;
  return layout.penetration_cm[1] ?? layout.penetration_cm[0];
}

const ascending = (values) => [...new Set(values)].sort((a, b) => a - b);

function hatch(id) {
  return svg("defs", {}, svg("pattern", {id, width: 5, height: 5, patternUnits: "userSpaceOnUse",
    patternTransform: "rotate(45)"}, svg("rect", {width: 2, height: 5, class: "hatch"})));
}

// A cell at (x, y); `strength` 0 to 1.
function cellOf(verdict, quantity, box, strength, hatchId) {
  const {x, y, width, height} = box;
  const cell = svg("g", {class: `cell ${verdict}`}, svg("rect", {x, y, width, height,
    class: "ground"}));
  const isFilled = quantity === "clearance" ? verdict !== "colliding" : verdict === "colliding";
  if (isFilled)
    cell.append(svg("rect", {x, y, width, height, class: quantity === "clearance" ? "clear" : "hit",
      "fill-opacity": (0.25 + 0.75 * strength).toFixed(3)}));
  if (quantity === "clearance" && verdict === "colliding")
    cell.append(svg("path", {class: "cross",
      d: `M${x} ${y}l${width} ${height}m${-width} 0l${width} ${-height}`}));
  if (verdict === "undecided")
    cell.append(svg("rect", {x, y, width, height, fill: `url(#${hatchId})`}));
  if (verdict === "free" && quantity !== "clearance")
    cell.append(svg("circle", {cx: x + width / 2, cy: y + height / 2, class: "ring",
      r: Math.max(1, Math.min(4, 0.25 * Math.min(width, height)))}));
  return cell;
}

function tickIndices(count) {
  const step = Math.ceil(count / kMap.maxTicks);
  return [...Array(count).keys()].filter((i) => i % step === 0);
}

function mapAxes(joint, xs, ys, plot) {
  const {left, top, width, height} = plot, nodes = [];
  const label = (text, x, y, more) => nodes.push(svg("text", {x, y, ...more}, text));
  for (const i of tickIndices(xs.length))
    label(xs[i].toFixed(1), left + (i + 0.5) * width / xs.length, top + height + 15,
      {"text-anchor": "middle"});
  for (const i of tickIndices(ys.length))
    label(ys[i].toFixed(1), left - 6, top + height - (i + 0.5) * height / ys.length + 4,
      {"text-anchor": "end"});
  const short = (name) => (name.length > 40 ? `${name.slice(0, 39)}…` : name);
  label(`${short(joint.places[0])}, cm`, left + width / 2, top + height + 36,
    {"text-anchor": "middle"});
  label(`${short(joint.places[1])}, cm`, 0, 0, {"text-anchor": "middle",
    transform: `translate(13 ${top + height / 2}) rotate(-90)`});
  nodes.push(svg("rect", {x: left, y: top, width, height, class: "frame"}));
  return nodes;
}

// "0.2 [light] [] [] [dark] 3.4 s"
function mapKey(quantity, max, hatchId) {
  const key = document.createElement("ul");
  key.className = "key map-key";
  const item = (text, ...pictures) => {
    const node = document.createElement("li");
    node.append(...pictures, text);
    key.append(node);
  };
  const picture = (verdict, strength) => svg("svg", {width: 16, height: 14, class: "map"},
    cellOf(verdict, quantity, {x: 0.5, y: 0.5, width: 15, height: 13}, strength, hatchId));
  const ramp = [0, 0.25, 0.5, 0.75, 1];
  if (quantity === "clearance") {
    item(` clearance, 0 to ${cm(max)}`, ...ramp.map((s) => picture("free", s)));
    item(" colliding", picture("colliding", 0));
  } else {
    const unit = quantity === "collision" ? seconds(max) : cm(max);
    item(` ${quantity}, up to ${unit}`, ...ramp.map((s) => picture("colliding", s)));
    item(" certified free", picture("free", 0));
  }
  item(" undecided", picture("undecided", 0.5));
  return key;
}

let mapCount = 0;
function drawMap(place, joint, quantity) {
  const xs = ascending(joint.layouts.map((l) => l.places_cm[0])),
    ys = ascending(joint.layouts.map((l) => l.places_cm[1]));
  const size = kMap.width - kMap.left - kMap.right;
  const plot = {left: kMap.left, top: kMap.top, width: size,
    height: Math.min(size, Math.max(160, size * ys.length / xs.length))};
  const values = joint.layouts.map((l) => shownValue(l, quantity));
  const max = Math.max(0, ...values.filter((v) => v != null));
  const hatchId = `hatch-${mapCount++}`;
  const width = plot.width / xs.length, height = plot.height / ys.length;
  const readout = document.createElement("p");
  readout.className = "readout";
  readout.textContent = kHint;
  const cells = joint.layouts.map((layout, i) => {
    const x = plot.left + xs.indexOf(layout.places_cm[0]) * width,
      y = plot.top + plot.height - (ys.indexOf(layout.places_cm[1]) + 1) * height;
    const cell = cellOf(layout.verdict, quantity, {x, y, width, height},
      max > 0 && values[i] != null ? values[i] / max : 0, hatchId);
    const text = layoutText(joint, layout);
    cell.append(svg("title", {}, text));
    cell.addEventListener("pointerenter", () => { readout.textContent = text; });
    return cell;
  });
  const picture = svg("svg", {class: "map", viewBox:
    `0 0 ${kMap.width} ${plot.top + plot.height + kMap.bottom}`}, hatch(hatchId), ...cells,
  ...mapAxes(joint, xs, ys, plot));
  picture.addEventListener("pointerleave", () => { readout.textContent = kHint; });
  place.append(picture, mapKey(quantity, max, hatchId), readout);
}

function collisionBars(joint) {
  const {layouts} = joint, red = colour("red"), amber = colour("amber"), green = colour("green");
  const zeroOf = (verdict) => layouts.map((l) => (l.verdict === verdict ? 0 : null));
  const mark = (label, stroke, fill) => ({label, stroke, paths: () => null,
    points: {show: true, size: 7, stroke, fill}, value: (_, v) => (v == null ? "no" : "yes")});
  return {
    data: [layouts.map((_, i) => i + 1),
      layouts.map((l) => (l.verdict === "colliding" ? l.collision_s : null)),
      zeroOf("undecided"), zeroOf("free")],
    axis: axis("collision, s", kLeft),
    series: [{label: "collision", stroke: red, fill: red, width: 0, points: {show: false},
      paths: uPlot.paths.bars({size: [0.8, 40]}), value: (_, v) => seconds(v)},
    mark("undecided", amber, colour("paper")), mark("free", green, green)],
    key: [["fill-red", "collision"], ["ring-amber", "undecided"], ["dot-green", "certified free"]],
  };
}

function distanceBars(joint) {
  const {layouts} = joint;
  const point = (label, name, values) => ({label, values, stroke: colour(name), paths: () => null,
    points: {show: true, size: 5, stroke: colour(name),
      fill: name === "red" ? colour("red") : colour("paper")}, value: (_, v) => cm(v)});
  const series = [
    point("penetration", "red", layouts.map((l) => shownValue(l, "penetration"))),
    point("clearance", "accent", layouts.map((l) => l.clearance_cm[0]))];
  return {
    data: [layouts.map((_, i) => i + 1), ...series.map(({values}) => values)],
    axis: axis("cm", kLeft),
    series: series.map(({values, ...rest}) => rest),
    key: [["dot-red", "deepest penetration, at most"], ["ring-accent",
      "minimum clearance, at least"]],
  };
}

function drawBars(place, figure, joint) {
  const chart = figure.dataset.quantity === "collision" ? collisionBars(joint) :
    distanceBars(joint);
  const count = joint.layouts.length;
  const readout = document.createElement("p");
  readout.className = "readout";
  readout.textContent = kHint;
  const plot = new uPlot({width: Math.max(figure.clientWidth, 240), height: kChartHeight_px,
    cursor: {y: false}, legend: {show: false},
    scales: {x: {time: false, range: () => [0.5, count + 0.5]}, y: {range: fromZero}},
    axes: [axis("layouts, in the order of their collision time", {incrs: kWholeSteps}), chart.axis],
    series: [{}, ...chart.series],
    hooks: {setCursor: [({cursor: {idx}}) => {
      readout.textContent = idx == null ? kHint :
        layoutText(joint, joint.layouts[idx]);
    }]}}, chart.data, place);
  place.append(keyOf(chart.key), readout);
  return plot;
}

// Returns a function that draws the figure's chart again.
function startLayouts(figure, joint) {
  const place = chartPlace(figure);
  let plot = null;
  const draw = () => {
    plot?.destroy();
    place.replaceChildren();
    if (figure.dataset.chart === "layout-map") drawMap(place, joint, figure.dataset.quantity);
    else plot = drawBars(place, figure, joint);
    figure.dataset.drawn = "yes";
  };
  draw();
  new ResizeObserver(() => {
    if (plot) plot.setSize({width: Math.max(figure.clientWidth, 240), height: kChartHeight_px});
  }).observe(figure);
  return draw;
}
