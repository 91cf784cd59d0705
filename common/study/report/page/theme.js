// Light and dark. Charts and 3D views take their colours from the style sheet, so they are drawn
// again when the theme changes, and in light colours for the printer.
const root = document.documentElement;
const redrawers = [];

// The value of a custom property as a colour that a canvas understands.
const colour = (() => {
  const probe = document.createElement("span");
  probe.hidden = true;
  document.body.append(probe);
  return (name) => {
    probe.style.color = `var(--${name})`;
    return getComputedStyle(probe).color;
  };
})();

function redraw() {
  for (const draw of redrawers) draw();
}

function startTheme() {
  const themes = ["auto", "light", "dark"];
  let theme = "auto";
  const show = (name) => {
    if (name === "auto") delete root.dataset.theme;
    else root.dataset.theme = name;
    redraw();
  };
  const button = document.getElementById("theme");
  button.hidden = false;
  button.addEventListener("click", () => {
    theme = themes[(themes.indexOf(theme) + 1) % themes.length];
    button.textContent = `Theme: ${theme}`;
    show(theme);
  });
  // The printer's scheme is light. Charts that are drawn again after the layout would be blank in
  // print.
  let isPrinting = false;
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    if (!isPrinting) redraw();
  });
  const print = document.getElementById("print");
  print.hidden = false;
  print.addEventListener("click", () => window.print());
  window.addEventListener("beforeprint", () => {
    isPrinting = true;
    drawAll();
    show("light");
  });
  window.addEventListener("afterprint", () => {
    isPrinting = false;
    show(theme);
  });
}
