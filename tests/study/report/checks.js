// What a reader sees on the page, and how it reacts to the slider, the keys and the buttons.
(async () => {
  const all = (css) => [...document.querySelectorAll(css)];
  const text = (node) => node.textContent.trim();
  const pixels = (canvas) => {
    const copy = new OffscreenCanvas(canvas.width, canvas.height);
    const context = copy.getContext("2d", {willReadFrequently: true});
    context.drawImage(canvas, 0, 0);
    return new Uint32Array(context.getImageData(0, 0, copy.width, copy.height).data.buffer);
  };
  const colours = (canvas) => new Set(pixels(canvas)).size;
  const difference = (a, b) => a.reduce((sum, value, i) => sum + (value !== b[i]), 0) / a.length;
  const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));
  const found = {
    title: document.title,
    error: text(document.getElementById("error")),
    names: all("h3 bdi").map(text),
    table: all("table.answers tr").map((row) => [...row.cells].map(text)),
    charts: all("figure.chart").filter((figure) => !figure.hidden)
      .map((figure) => ({chart: figure.dataset.chart, drawn: figure.dataset.drawn,
        colours: Math.max(0, ...[...figure.querySelectorAll("canvas")].map(colours)),
        label: figure.querySelector("[role=img]")?.getAttribute("aria-label")})),
    pictures: all("img").map((img) => ({width: img.naturalWidth, alt: img.alt})),
    maps: all("figure.chart[data-chart=layout-map]").map((figure) => {
      const cells = [...figure.querySelectorAll("div > svg .cell")];
      const count = (name) => cells.filter((cell) => cell.classList.contains(name)).length;
      const hits = cells.map((cell) => cell.querySelector(".hit, .clear"))
        .filter((hit) => hit !== null).map((hit) => Number(hit.getAttribute("fill-opacity")));
      cells[0].dispatchEvent(new PointerEvent("pointerenter"));
      const readout = text(figure.querySelector(".readout"));
      const box = cells.at(-1).querySelector(".ground").getBoundingClientRect();
      return {quantity: figure.dataset.quantity, free: count("free"), colliding: count("colliding"),
        undecided: count("undecided"), rings: figure.querySelectorAll("div > svg .cell .ring").length,
        hatched: figure.querySelectorAll("div > svg .cell [fill^=url]").length,
        darkest: Math.max(...hits), lightest: Math.min(...hits), readout,
        title: text(cells[0].querySelector("title")), width_px: box.width};
    }),
    views: [],
    overflow_px: document.documentElement.scrollWidth - document.documentElement.clientWidth,
    theme: [],
  };
  for (const figure of all("figure.view3d")) {
    const canvas = figure.querySelector("canvas");
    if (!canvas) {
      found.views.push({text: text(figure)});
      continue;
    }
    const view = {label: canvas.getAttribute("aria-label")};
    found.views.push(view);
    if (found.views.length > 1) continue;  // the others only differ in their data
    const before = pixels(canvas);
    view.colours = new Set(before).size;
    const slider = figure.querySelector("input[type=range]");
    if (slider) {
      view.verdict = text(figure.querySelector(".verdict"));
      view.spacing_cm = Number(slider.value);
      slider.value = slider.min;
      slider.dispatchEvent(new Event("input"));
      view.moved = difference(before, pixels(canvas));
      view.moved_verdict = text(figure.querySelector(".verdict"));
    }
    const at = pixels(canvas);
    canvas.dispatchEvent(new KeyboardEvent("keydown", {key: "ArrowLeft", cancelable: true}));
    view.turned = difference(at, pixels(canvas));
    figure.querySelector(".item button")?.click();
    view.selected = canvas.getAttribute("aria-label");
  }
  const button = document.getElementById("theme");
  for (let i = 0; i < 3; ++i) {
    button.click();
    await frame();
    found.theme.push([text(button), getComputedStyle(document.body).backgroundColor]);
  }
  found.attacked = window.attacked === true;
  return found;
})()
