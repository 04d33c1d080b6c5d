"use strict";
/* Line and scatter charts, drawn by uPlot. */
(function () {
  const { theme, faded, titled, number, tickLabels, element } = page;
  const kLeft = 70, kRight = 14;  // equal margins, so that the time axes of charts below one another are aligned

  /* Gives a scale without values a range: uPlot leaves it undefined, but an empty chart still needs its axes. */
  function range(pad) {
    return (u, lo, hi) => {
      if (lo == null || !isFinite(lo)) return [0, 1];
      if (lo === hi) {
        const half = Math.abs(lo) * 0.1 || 0.5;
        return [lo - half, hi + half];
      }
      return [lo - pad * (hi - lo), hi + pad * (hi - lo)];
    };
  }

  function axes(spec) {
    const common = {
      stroke: theme.muted(), font: theme.font, labelFont: theme.font, labelGap: 0,
      grid: { stroke: theme.grid(), width: 1 }, ticks: { stroke: theme.grid(), width: 1, size: 5 },
      values: (u, splits) => tickLabels(splits),
    };
    const counted = spec.x_counts ? { incrs: [1, 2, 5, 10, 20, 50] } : {};
    return [
      { ...common, ...counted, label: titled(spec.x_axis), size: 30, labelSize: 18, space: 70 },
      { ...common, label: titled(spec.y_axis), size: kLeft - 18, labelSize: 18, space: 26 },
    ];
  }

  function emptyNote(u, isEmpty) {
    if (!isEmpty) return;
    const c = u.ctx, b = u.bbox;
    c.save();
    c.fillStyle = theme.muted();
    c.textAlign = "center";
    c.font = scaled(u, theme.font);
    c.fillText("no values", b.left + b.width / 2, b.top + b.height / 2);
    c.restore();
  }

  const scaled = (u, font) => font.replace(/^\d+/, (px) => px * devicePixelRatio);

  function drawSpans(u, spec) {
    const c = u.ctx, b = u.bbox;
    c.save();
    c.beginPath();
    c.rect(b.left, b.top, b.width, b.height);
    c.clip();
    c.fillStyle = faded(theme.get("--c4"), 0.22);
    for (const span of spec.spans) {
      const from = u.valToPos(span.from, "x", true), to = u.valToPos(span.to, "x", true);
      c.fillRect(from, b.top, Math.max(to - from, 1), b.height);
    }
    c.restore();
  }

  /* Writes labels of spans and markers at the top, except where they would overlap the one before. */
  function drawLabels(u, spec) {
    const c = u.ctx, b = u.bbox, ratio = devicePixelRatio;
    const labels = spec.spans.map((s) => ({ x: s.from, label: s.label, line: false }))
      .concat(spec.markers.map((m) => ({ x: m.x, label: m.label, line: true })))
      .filter((l) => l.x >= u.scales.x.min && l.x <= u.scales.x.max).sort((a, z) => a.x - z.x);
    c.save();
    c.font = scaled(u, "11px system-ui, sans-serif");
    c.textAlign = "left";
    c.textBaseline = "alphabetic";
    c.strokeStyle = theme.muted();
    c.lineWidth = ratio;
    c.setLineDash([4 * ratio, 3 * ratio]);
    const place = (x) => Math.round(u.valToPos(x, "x", true));
    for (const { x } of labels.filter((l) => l.line)) {
      c.beginPath();
      c.moveTo(place(x), b.top);
      c.lineTo(place(x), b.top + b.height);
      c.stroke();
    }
    let free = -Infinity;
    for (const { x, label } of labels.filter((l) => l.label)) {
      const at = place(x);
      const width = c.measureText(label).width;
      let from = at + 4 * ratio;
      if (from + width > b.left + b.width) from = at - 4 * ratio - width;
      if (from > free) {
        c.fillStyle = faded(theme.paper(), 0.8);
        c.fillRect(from - ratio, b.top, width + 2 * ratio, 15 * ratio);
        c.fillStyle = theme.muted();
        c.fillText(label, from, b.top + 11 * ratio);
        free = from + width + 6 * ratio;
      }
    }
    c.restore();
  }

  /* Returns the style of a curve; the legend shows the same colour. */
  function look(series) {
    const color = theme.color(series.color);
    if (series.style === "measured") return { stroke: faded(color, 0.38), width: 3.5 };
    if (series.style === "predicted") return { stroke: color, width: 1.5 };
    if (series.style === "limit") return { stroke: color, width: 1.2, dash: [6, 4] };
    if (series.style === "before") return { stroke: color, width: 1.5 };
    return { stroke: color, width: 1.8 };
  }

  page.kinds.lines = function (host, spec) {
    const unit = spec.y_axis.unit ? " " + spec.y_axis.unit : "";
    const xUnit = spec.x_axis.unit ? " " + spec.x_axis.unit : "";
    const data = [spec.x];
    const series = [{ label: spec.x_axis.label, class: "instant", value: (u, v) => (v == null ? "" : number(v, 5) + xUnit) }];
    const bands = [];
    for (const s of spec.series) {
      if (!s.lower) continue;  // Bands are drawn under all curves.
      for (const edge of [s.upper, s.lower]) {
        data.push(edge);
        series.push({ label: s.name, class: "quiet", stroke: "transparent", width: 0, points: { show: false } });
      }
      bands.push({ series: [data.length - 2, data.length - 1], fill: faded(theme.color(s.color), 0.16) });
    }
    const firstCurve = data.length;
    const keyColor = (u, i) => (i < firstCurve ? "transparent" : look(spec.series[i - firstCurve]).stroke);
    for (const s of spec.series) {
      data.push(s.y);
      series.push({ label: s.name, ...look(s), pxAlign: 0, value: (u, v) => (v == null ? "" : number(v) + unit),
        points: { size: 5, fill: theme.color(s.color) } });
    }
    const isEmpty = !spec.series.some((s) => s.y.some((v) => v != null));
    const chart = new uPlot({
      width: host.clientWidth, height: spec.height || 240, padding: [8, kRight, 0, 0],
      scales: { x: { time: false, range: range(0) }, y: { range: range(0.06) } },
      axes: axes(spec), series, bands,
      legend: { markers: { fill: keyColor, width: 0 } },
      cursor: {
        drag: { x: true, y: false },
        points: { size: 6, width: 0, fill: (u, i) => (i < firstCurve ? "transparent" : theme.color(spec.series[i - firstCurve].color)) },
        sync: spec.group ? { key: spec.group, scales: ["x", null] } : undefined,
      },
      hooks: {
        drawClear: [(u) => drawSpans(u, spec)],
        draw: [(u) => { drawLabels(u, spec); emptyNote(u, isEmpty); }],
        setCursor: [(u) => {
          u.root.classList.toggle("read", u.cursor.idx != null);
          if (u.cursor.left >= 0 && u.cursor.event) page.tellInstant(spec.group, u.posToVal(u.cursor.left, "x"), u);
        }],
      },
    }, data, host);
    const forget = page.onInstant(spec.group, (time, source) => {
      if (source instanceof uPlot) return;  // uPlot itself synchronises the charts.
      chart.setCursor({ left: chart.valToPos(time, "x"), top: chart.bbox.height / 2 / devicePixelRatio }, false);
    });
    return {
      picture: () => chart.ctx.canvas,
      key: () => spec.series.map((s) => ({ name: s.name, color: look(s).stroke })),
      rows: () => {
        const names = [titled(spec.x_axis)], columns = [spec.x];
        for (const s of spec.series) {
          names.push(titled({ label: s.name, unit: spec.y_axis.unit }));
          columns.push(s.y);
          if (s.lower) {
            names.push(s.name + " lower", s.name + " upper");
            columns.push(s.lower, s.upper);
          }
        }
        return [names].concat(spec.x.map((_, i) => columns.map((column) => column[i])));
      },
      remove: () => { forget(); chart.destroy(); },
    };
  };

  page.kinds.scatter = function (host, spec) {
    // uPlot needs one ascending abscissa, so all points are sorted by x and each stands in the column of its group.
    const points = [];
    spec.groups.forEach((g, k) => g.x.forEach((x, i) => points.push([x, k, g.y[i]])));
    const groupCount = spec.groups.length, trends = [];
    (spec.trends || []).forEach((t, k) => { if (t.x.length > 1) trends.push({ ...t, group: k }); });
    trends.forEach((t, j) => t.x.forEach((x, i) => points.push([x, groupCount + j, t.y[i]])));
    points.sort((a, b) => a[0] - b[0]);
    const columns = groupCount + trends.length;
    const data = [points.map((p) => p[0])];
    // null interrupts a line; undefined (a point of another column) does not.
    for (let k = 0; k < columns; ++k) data.push(points.map((p) => (p[1] === k ? p[2] : k < groupCount ? null : undefined)));

    const series = [{ label: spec.x_axis.label, class: "quiet" }];
    const alpha = points.length > 1500 ? 0.35 : 0.65;
    spec.groups.forEach((g, k) => {
      const color = theme.color(g.color);
      series.push({ label: g.name, stroke: color, paths: () => null,
        points: { show: true, size: points.length > 1500 ? 3.5 : 5, width: 0, fill: faded(color, alpha) } });
    });
    for (const t of trends) {
      const lone = groupCount === 1;
      series.push({ label: "median", ...(lone ? {} : { class: "quiet" }), stroke: lone ? theme.ink() : theme.color(spec.groups[t.group].color),
        width: 2.4, pxAlign: 0, points: { show: false } });
    }
    const reading = element("div", { class: "reading" });
    const chart = new uPlot({
      width: host.clientWidth, height: spec.height || 280, padding: [8, kRight, 0, 0],
      scales: { x: { time: false, range: range(0.03) }, y: { range: range(0.06) } },
      axes: axes(spec), series,
      legend: { live: false, markers: { fill: (u, i) => (i < 1 || i > groupCount ? theme.ink() : theme.color(spec.groups[i - 1].color)), width: 0 } },
      cursor: { drag: { x: true, y: true, uni: 40 }, points: { show: false } },
      hooks: {
        drawClear: [(u) => drawReferenceLines(u, spec)],
        draw: [(u) => emptyNote(u, points.length === 0)],
        setCursor: [(u) => {
          const inside = u.cursor.left >= 0;
          reading.textContent = inside
            ? number(u.posToVal(u.cursor.left, "x")) + " " + spec.x_axis.unit + " · " +
              number(u.posToVal(u.cursor.top, "y")) + " " + spec.y_axis.unit
            : "";
        }],
      },
    }, data, host);
    chart.root.querySelector(".u-legend").classList.add("dots");
    chart.over.append(reading);
    return {
      picture: () => chart.ctx.canvas,
      key: () => spec.groups.map((g) => ({ name: g.name, color: theme.color(g.color) })),
      rows: () => [["group", titled(spec.x_axis), titled(spec.y_axis)]].concat(
        ...spec.groups.map((g) => g.x.map((x, i) => [g.name, x, g.y[i]]))),
      remove: () => chart.destroy(),
    };
  };

  /* Draws the zero line, or the line y = x. */
  function drawReferenceLines(u, spec) {
    const c = u.ctx, b = u.bbox, { x, y } = u.scales;
    c.save();
    c.beginPath();
    c.rect(b.left, b.top, b.width, b.height);
    c.clip();
    c.strokeStyle = theme.muted();
    c.lineWidth = devicePixelRatio;
    c.beginPath();
    const end = (v) => (spec.diagonal ? v : 0);
    c.moveTo(u.valToPos(x.min, "x", true), u.valToPos(end(x.min), "y", true));
    c.lineTo(u.valToPos(x.max, "x", true), u.valToPos(end(x.max), "y", true));
    if (spec.diagonal || (y.min <= 0 && y.max >= 0)) c.stroke();
    c.restore();
  }
})();
