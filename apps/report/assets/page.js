"use strict";
/* Functions for all figures: colours of the theme, numbers, saving, and the links between figures of one group.
   A kind of figure is page.kinds[kind] = function (host, spec) that draws `spec` into the element `host` and
   returns { picture(): canvas or promise of one, rows(): table with a header row, remove(): optional }. */
var page = (function () {
  const kinds = {};
  const figures = [];

  const variable = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const theme = {
    color: (i) => (i < 0 ? variable("--muted") : variable("--c" + (i % 8))),
    ink: () => variable("--ink"), muted: () => variable("--muted"), grid: () => variable("--grid"),
    paper: () => variable("--paper"), get: variable,
    font: "12px system-ui, -apple-system, 'Segoe UI', Roboto, Arial, sans-serif",
  };

  /* Adds an opacity to a colour "#rrggbb". */
  const faded = (hex, alpha) => hex + Math.round(alpha * 255).toString(16).padStart(2, "0");

  const titled = (q) => (q.unit ? q.label + " [" + q.unit + "]" : q.label);

  /* Formats a value with four significant digits and spaces between thousands. */
  function number(v, digits) {
    if (v == null || !isFinite(v)) return "–";
    if (v === 0) return "0";
    const size = Math.abs(v);
    if (size < 1e-4 || size >= 1e7) return v.toExponential((digits || 4) - 1);
    const decimals = Math.max(0, (digits || 4) - 1 - Math.floor(Math.log10(size)));
    return grouped(v.toFixed(Math.min(decimals, 8)));
  }

  function grouped(text) {
    const [whole, fraction] = text.replace("-", "−").split(".");
    const spaced = whole.replace("−", "").length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, "\u202f") : whole;
    return fraction === undefined ? spaced : spaced + "." + fraction;
  }

  /* Returns about `count` round ticks over [lo, hi]. */
  function ticks(lo, hi, count) {
    if (!(hi > lo)) return [lo];
    const raw = (hi - lo) / Math.max(1, count);
    const power = Math.pow(10, Math.floor(Math.log10(raw)));
    const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw * 0.999);
    const out = [];
    for (let k = Math.ceil(lo / step - 1e-9); k * step <= hi + step * 1e-9; ++k) out.push(k * step);
    out.step = step;
    return out;
  }

  /* Returns tick labels with the decimals that the distance of the ticks needs. */
  function tickLabels(values) {
    const step = values.length > 1 ? Math.abs(values[1] - values[0]) : Math.abs(values[0]) || 1;
    const largest = Math.max(...values.map(Math.abs), step);
    if (largest >= 1e7 || step < 1e-5) return values.map((v) => (v === 0 ? "0" : v.toExponential(1)));
    const exact = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    const decimals = Math.min(6, Math.abs(step * 10 ** exact - Math.round(step * 10 ** exact)) > 1e-6 ? exact + 1 : exact);
    return values.map((v) => grouped((Math.abs(v) < step * 1e-6 ? 0 : v).toFixed(decimals)));
  }

  function element(tag, attributes, text) {
    const e = document.createElement(tag);
    for (const key in attributes || {}) e.setAttribute(key, attributes[key]);
    if (text !== undefined) e.textContent = text;
    return e;
  }

  function svg(tag, attributes, text) {
    const e = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const key in attributes || {}) if (attributes[key] != null) e.setAttribute(key, attributes[key]);
    if (text !== undefined) e.textContent = text;
    return e;
  }

  /* Draws an <svg> on a canvas of twice its size, for saving. */
  function rasterised(drawing) {
    const width = drawing.width.baseVal.value, height = drawing.height.baseVal.value;
    const text = new XMLSerializer().serializeToString(drawing);
    return new Promise((resolve, reject) => {
      const image = new Image();
      image.onload = () => {
        const canvas = element("canvas", { width: 2 * width, height: 2 * height });
        canvas.getContext("2d").drawImage(image, 0, 0, 2 * width, 2 * height);
        canvas.ratio = 2;
        resolve(canvas);
      };
      image.onerror = reject;
      image.src = "data:image/svg+xml;charset=utf-8," + encodeURIComponent(text);
    });
  }

  function download(blob, name) {
    const link = element("a", { download: name, href: URL.createObjectURL(blob) });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  const fileName = (spec, ending) =>
    (spec.title.replace(/[^\p{L}\p{N}]+/gu, "-").replace(/^-|-$/g, "").slice(0, 60) || "figure") + ending;

  /* Draws title, legend and figure on one canvas, so that the saved picture needs no page. */
  async function savePng(figure) {
    const drawn = await figure.drawn.picture();
    const scale = drawn.ratio || devicePixelRatio, key = figure.drawn.key ? figure.drawn.key() : [];
    const head = (key.length ? 48 : 28) * scale;
    const canvas = element("canvas", { width: drawn.width, height: drawn.height + head });
    const c = canvas.getContext("2d");
    c.fillStyle = theme.paper();
    c.fillRect(0, 0, canvas.width, canvas.height);
    c.drawImage(drawn, 0, head);
    c.scale(scale, scale);
    c.fillStyle = theme.ink();
    c.font = "600 14px system-ui, sans-serif";
    c.fillText(figure.spec.title, 8, 18);
    c.font = theme.font;
    let x = 8;
    for (const { name, color } of key) {
      c.fillStyle = color;
      c.fillRect(x, 33, 16, 4);
      c.fillStyle = theme.ink();
      c.fillText(name, x + 20, 39);
      x += 38 + c.measureText(name).width;
    }
    canvas.toBlob((blob) => download(blob, fileName(figure.spec, ".png")));
  }

  function saveCsv(figure) {
    const cell = (v) => (v == null ? "" : /[",\n]/.test(v) ? '"' + String(v).replace(/"/g, '""') + '"' : v);
    const text = figure.drawn.rows().map((row) => row.map(cell).join(",")).join("\n") + "\n";
    download(new Blob(["\ufeff" + text], { type: "text/csv" }), fileName(figure.spec, ".csv"));
  }

  function addTools(figure) {
    const tools = element("div", { class: "tools" });
    for (const [label, action, hint] of [["save PNG", savePng, "this figure as a picture"],
                                         ["save CSV data", saveCsv, "the values drawn here"]]) {
      const button = element("button", { type: "button", title: hint }, label);
      button.addEventListener("click", () => action(figure));
      tools.append(button);
    }
    figure.element.append(tools);
  }

  function draw(figure) {
    if (figure.drawn && figure.drawn.remove) figure.drawn.remove();
    figure.host.replaceChildren();
    figure.drawn = null;
    try {
      figure.drawn = kinds[figure.spec.kind](figure.host, figure.spec);
    } catch (error) {
      pageErrors.push(figure.spec.title + ": " + error);
      figure.host.append(element("p", { class: "failed" }, "This figure could not be drawn: " + error));
    }
    figure.width = figure.host.clientWidth;
  }

  /* A figure counts as drawn when it has a pixel that is not transparent, or an SVG with content. */
  function inked(figure) {
    const canvas = figure.host.querySelector("canvas"), drawing = figure.host.querySelector("svg");
    if (drawing) return drawing.childElementCount > 0;
    if (!canvas || !canvas.width) return false;
    const small = element("canvas", { width: 200, height: 60 });
    const c = small.getContext("2d");
    c.drawImage(canvas, 0, 0, 200, 60);
    return c.getImageData(0, 0, 200, 60).data.some((v, i) => i % 4 === 3 && v > 0);
  }

  function report() {
    document.body.dataset.plotsDrawn = figures.filter((f) => f.drawn && inked(f)).length;
    document.body.dataset.errors = JSON.stringify(pageErrors);
  }

  function drawAll() {
    for (const e of document.querySelectorAll("figure.plot")) {
      const spec = JSON.parse(e.querySelector("script").textContent);
      const figure = { element: e, spec, host: e.querySelector(".drawing"), drawn: null, width: 0 };
      figures.push(figure);
      draw(figure);
      addTools(figure);
    }
    setTimeout(report, 0);  // uPlot draws in a microtask, so the report waits for it.
    const redraw = () => figures.forEach(draw);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
    for (const [event, printing] of [["beforeprint", true], ["afterprint", false]]) {
      addEventListener(event, () => {
        document.documentElement.classList.toggle("printing", printing);
        redraw();
      });
    }
    let pending = 0;
    addEventListener("resize", () => {
      clearTimeout(pending);
      pending = setTimeout(() => figures.filter((f) => f.width !== f.host.clientWidth).forEach(draw), 120);
    });
  }

  /* Passes the instant under the cursor to all figures of a group: listeners are called with (time, source). */
  const listeners = {};
  function onInstant(group, listener) {
    if (!group) return () => {};
    (listeners[group] = listeners[group] || []).push(listener);
    return () => (listeners[group] = listeners[group].filter((l) => l !== listener));
  }
  let telling = false;
  function tellInstant(group, time, source) {
    if (!group || telling) return;
    telling = true;
    for (const listener of listeners[group] || []) listener(time, source);
    telling = false;
  }

  addEventListener("unhandledrejection", (e) => pageErrors.push(String(e.reason)));
  const consoleError = console.error;
  console.error = (...text) => { pageErrors.push(text.join(" ")); consoleError(...text); };

  return { kinds, theme, faded, titled, number, ticks, tickLabels, element, svg, rasterised, drawAll, onInstant, tellInstant };
})();
