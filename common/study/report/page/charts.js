// Charts by uPlot. Each figure.chart names its data by data-chart, data-trial, data-part and
// data-curve.
const {uPlot} = libraries;
const kChartHeight_px = 230;
const kLeft = {size: 46};  // of an axis at the left

const cm = (value) => (value == null ? "–" : `${value.toFixed(2)} cm`);
const seconds = (value) => (value == null ? "–" : `${value.toFixed(2)} s`);

function axis(label, more = {}) {
  const ink = colour("muted"), line = colour("line");
  const font = "12px system-ui, sans-serif";
  return {label, labelSize: 20, labelGap: 0, size: 34, gap: 4, labelFont: font, stroke: ink, font,
    grid: {stroke: line, width: 1}, ticks: {stroke: line, width: 1}, ...more};
}

// Fills the vertical strips between each pair of x values, behind the curves.
function strips(pairs, fill, edge) {
  return (u) => {
    const {ctx, bbox} = u;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    for (const [low, high] of pairs) {
      const left = u.valToPos(low, "x", true), right = u.valToPos(high, "x", true);
      ctx.fillStyle = fill;
      ctx.fillRect(left, bbox.top, Math.max(right - left, 1), bbox.height);
      ctx.fillStyle = edge;
      for (const x of [left, right]) ctx.fillRect(x - 0.5, bbox.top, 1, bbox.height);
    }
    ctx.restore();
  };
}

// A dashed horizontal line.
function level(value) {
  return (u) => {
    const {ctx, bbox} = u, y = u.valToPos(value, "y", true);
    ctx.save();
    ctx.strokeStyle = colour("muted");
    ctx.setLineDash([6, 4]);
    ctx.beginPath();
    ctx.moveTo(bbox.left, y);
    ctx.lineTo(bbox.left + bbox.width, y);
    ctx.stroke();
    ctx.restore();
  };
}

const fromZero = (_, min, max) => [0, max > 0 ? max * 1.08 : 1];

function clearanceChart(trial, part) {
  const {clearance: c, events_s} = trial.parts[part];
  const max = c.max_cm.map((value) => value ?? c.cap_cm);
  const blue = colour("accent");
  const edge = {stroke: colour("error-soft"), points: {show: false}, value: (_, v) => cm(v)};
  const line = {stroke: blue, width: 1.5, points: {show: false}, value: (_, v) => cm(v)};
  return {
    data: [c.time_s, c.min_cm.map((v) => Math.max(0, v - c.error_cm)), c.min_cm, max,
      max.map((v) => v + c.error_cm)],
    options: {
      scales: {x: {time: false}, y: {range: fromZero}},
      axes: [axis("time, s"), axis("clearance, cm", kLeft)],
      series: [{label: "time", value: (_, v) => seconds(v)}, {label: "− error", ...edge},
        {label: "min", ...line}, {label: "max", ...line}, {label: "+ error", ...edge}],
      bands: [{series: [4, 1], fill: colour("error-soft")},
        {series: [3, 2], fill: colour("accent-soft")}],
      hooks: {drawClear: [strips(events_s, colour("red-soft"), colour("red-soft"))],
        draw: [level(c.cap_cm)]},
    },
    key: [["range", "bounds"], ["error-span", "with error"], ["event-span", "collision"],
      ["cap", "cap of the measurement"]],
  };
}

const freeStrips = (curve) =>
  [strips(curve.free_cm, colour("green-soft"), colour("green"))];
// The curves over the samples, and `known` = 0 at the ends of the free intervals, so that no line
// crosses an interval in which it is certified to be 0. The others have null there.
function withFreeEnds(curve, others, known) {
  const xs = [...new Set([...curve.spacing_cm, ...curve.free_cm.flat()])].sort((a, b) => a - b);
  const sample = new Map(curve.spacing_cm.map((x, i) => [x, i]));
  const at = (values, value) => xs.map((x) => (sample.has(x) ? values[sample.get(x)] : value));
  return [xs, ...others.map((values) => at(values, null)), ...known.map((values) => at(values, 0))];
}
const points = (stroke) => ({show: true, size: 5, stroke, fill: stroke});

function collisionChart(trial, index) {
  const curve = trial.what_if[index];
  const undecided = curve.collision_s.map((s, i) => (curve.undecided[i] && s === 0 ? 0 : null));
  const red = colour("red"), amber = colour("amber");
  return {
    data: withFreeEnds(curve, [undecided], [curve.collision_s]),
    options: {
      scales: {x: {time: false, range: () => curve.range_cm}, y: {range: fromZero}},
      axes: [axis("spacing, cm"), axis("collision, s", kLeft)],
      series: [{label: "spacing", value: (_, v) => cm(v)},
        {label: "undecided", stroke: amber, paths: () => null,
          points: {show: true, size: 8, stroke: amber, fill: colour("paper")},
          value: (_, v) => (v == null ? "no" : "yes")},
        {label: "collision", stroke: red, width: 1.5, points: points(red),
          value: (_, v) => seconds(v)}],
      hooks: {drawClear: freeStrips(curve)},
    },
    key: [["line-red", "collision"], ["ring-amber", "undecided"], ["free", "certified free"]],
  };
}

function distanceChart(trial, index) {
  const curve = trial.what_if[index];
  // The clearance has no value at the ends of the free intervals; a gap of the penetration is one
  // without a bound.
  const series = (label, name) => ({label, stroke: colour(name), width: 1.5,
    points: {show: false}, spanGaps: name === "accent", value: (_, v) => cm(v)});
  return {
    data: withFreeEnds(curve, [curve.clearance_min_cm,
      curve.clearance_max_cm.map((v, i) => v ?? curve.clearance_min_cm[i])],
    [curve.penetration_min_cm, curve.penetration_max_cm]),
    options: {
      scales: {x: {time: false, range: () => curve.range_cm}, y: {range: fromZero}},
      axes: [axis("spacing, cm"), axis("cm", kLeft)],
      series: [{label: "spacing", value: (_, v) => cm(v)}, series("clearance min", "accent"),
        series("max", "accent"), series("penetration min", "red"), series("max", "red")],
      bands: [{series: [2, 1], fill: colour("accent-soft")},
        {series: [4, 3], fill: colour("red-soft")}],
      hooks: {drawClear: freeStrips(curve)},
    },
    key: [["free", "certified free"], ["range", "clearance"], ["event-span", "penetration"]],
  };
}

// One column of points per participant.
function answersChart(answers) {
  const count = answers.participants.length;
  if (count === 0) return null;
  const names = ["necessary, before", "allocated, before", "found", "allocated, after"];
  const colours = ["muted", "amber", "red", "accent"].map(colour);
  const size = [9, 9, 12, 9];
  return {
    data: [answers.participants.map((_, i) => i + 1), ...answers.rows_cm],
    options: {
      scales: {x: {time: false, range: () => [0.5, count + 0.5]}, y: {range: fromZero}},
      axes: [axis("participant", {splits: () => answers.participants.map((_, i) => i + 1),
        values: (_, ticks) => ticks.map((i) => `#${i}`)}), axis("space, cm", kLeft)],
      series: [{label: "participant", value: (_, v) => (v == null ? "–" : `#${v}`)},
        ...names.map((label, i) => ({label, stroke: colours[i], paths: () => null,
          points: {show: true, size: size[i], width: 2, stroke: colours[i],
            fill: i === 2 ? colours[i] : colour("paper")}, value: (_, v) => cm(v)}))],
      hooks: {drawClear: [(u) => joinPoints(u, answers)]},
    },
    key: [["ring-muted", names[0]], ["ring-amber", names[1]], ["dot-red", names[2]],
      ["ring-accent", names[3]]],
  };
}

// A vertical line from the least to the largest answer of a participant.
function joinPoints(u, answers) {
  const {ctx} = u;
  ctx.save();
  ctx.strokeStyle = colour("line");
  ctx.lineWidth = 3;
  answers.participants.forEach((_, i) => {
    const values = answers.rows_cm.map((row) => row[i]).filter((v) => v != null);
    if (values.length === 0) return;
    const x = u.valToPos(i + 1, "x", true);
    ctx.beginPath();
    ctx.moveTo(x, u.valToPos(Math.min(...values), "y", true));
    ctx.lineTo(x, u.valToPos(Math.max(...values), "y", true));
    ctx.stroke();
  });
  ctx.restore();
}

function chartOf(figure, data) {
  const {chart, part, curve} = figure.dataset;
  const trial = data.trials[figure.dataset.trial];
  if (chart === "answers") return answersChart(data.answers);
  if (chart === "clearance") return clearanceChart(trial, part);
  if (chart === "what-if-collision") return collisionChart(trial, curve);
  return distanceChart(trial, curve);
}

// An element for the chart in its figure.
function chartPlace(figure) {
  const caption = figure.querySelector("figcaption");
  const place = document.createElement("div");
  place.setAttribute("role", "img");
  place.setAttribute("aria-label",
    `Chart: ${caption.textContent}. ${figure.dataset.summary ?? "The table has its numbers."}`);
  figure.append(place);
  return place;
}

function keyOf(items) {
  const key = document.createElement("ul");
  key.className = "key";
  for (const [name, text] of items) {
    const item = document.createElement("li");
    item.className = name;
    item.append(document.createElement("i"), text);
    key.append(item);
  }
  return key;
}

// Returns a function that draws the figure's chart again.
function startChart(figure, data) {
  if (figure.dataset.chart.startsWith("layout-")) return startLayouts(figure, data.joint);
  const place = chartPlace(figure);
  let plot = null, drawnWidth = 0;
  const draw = () => {
    plot?.destroy();
    place.replaceChildren();
    const chart = chartOf(figure, data);
    if (chart === null) {
      figure.hidden = true;
      return;
    }
    drawnWidth = Math.max(figure.clientWidth, 240);
    plot = new uPlot({width: drawnWidth, height: kChartHeight_px, cursor: {y: false},
      ...chart.options}, chart.data, place);
    place.append(keyOf(chart.key));
    figure.dataset.drawn = "yes";
  };
  draw();
  new ResizeObserver(() => {
    const width = Math.max(figure.clientWidth, 240);
    if (plot && width !== drawnWidth) {
      drawnWidth = width;
      plot.setSize({width, height: kChartHeight_px});
    }
  }).observe(figure);
  return draw;
}
