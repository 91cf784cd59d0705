// Draws each chart and view when it comes near the window, and all of them for the printer.
const waiting = new Map();  // figure to a function that draws it

function report(error) {
  const box = document.getElementById("error");
  box.textContent = `A script of this page failed: ${error.message ?? error}`;
  box.hidden = false;
  console.error(error);
}

function drawNow(figure) {
  const start = waiting.get(figure);
  if (!start) return;
  waiting.delete(figure);
  try {
    redrawers.push(start());
  } catch (error) {
    report(error);
  }
}

function drawAll() {
  for (const figure of [...waiting.keys()]) drawNow(figure);
}

try {
  const data = JSON.parse(document.getElementById("data").textContent);
  for (const figure of document.querySelectorAll("figure.chart"))
    waiting.set(figure, () => startChart(figure, data));
  for (const figure of document.querySelectorAll("figure.view3d"))
    waiting.set(figure, () => startView(figure, data));
  const observer = new IntersectionObserver((entries) => {
    for (const entry of entries)
      if (entry.isIntersecting) {
        observer.unobserve(entry.target);
        drawNow(entry.target);
      }
  }, {rootMargin: "800px"});
  for (const figure of waiting.keys()) observer.observe(figure);
  startTheme();
} catch (error) {
  report(error);
}
