"use strict";
/* Bars and maps, drawn as SVG. Colours are written as attributes so that a saved picture keeps them. */
(function () {
  const { theme, titled, number, ticks, tickLabels, element, svg } = page;

  const measure = element("canvas").getContext("2d");
  function textWidth(text) {
    measure.font = theme.font;
    return measure.measureText(text).width;
  }

  function root(host, width, height) {
    const drawing = svg("svg", { width, height, viewBox: `0 0 ${width} ${height}`, "font-size": 12,
      "font-family": "system-ui, -apple-system, 'Segoe UI', Roboto, Arial, sans-serif" });
    host.append(drawing);
    return drawing;
  }

  function line(x1, y1, x2, y2, color, width) {
    return svg("line", { x1, y1, x2, y2, stroke: color, "stroke-width": width || 1 });
  }

  function label(text, x, y, anchor, color, more) {
    return svg("text", { x, y, "text-anchor": anchor || "start", fill: color || theme.muted(), ...more }, text);
  }

  /* Writes the legend above a drawing and returns the height used. */
  function key(drawing, entries, left, width) {
    let x = left, y = 14;
    for (const { name, color } of entries) {
      const size = 22 + textWidth(name) + 18;
      if (x + size > width && x > left) {
        x = left;
        y += 20;
      }
      drawing.append(svg("rect", { x, y: y - 9, width: 12, height: 10, fill: color, rx: 1 }));
      drawing.append(label(name, x + 17, y, "start", theme.ink()));
      x += size;
    }
    return y + 8;
  }

  /* Scales metres to pixels, equally on both axes, with grid and labels. The height used is at most `height`. */
  page.plane = function (host, box, spec, right, tallest) {
    const left = 62, top = 12, bottom = 46;
    const wide = Math.max(1e-9, box.x1 - box.x0), tall = Math.max(1e-9, box.z1 - box.z0);
    const scale = Math.min((host.clientWidth - left - right) / wide, (tallest - top - bottom) / tall);
    // Of the width that the height leaves free a little is shown, the rest stays empty.
    const spare = Math.min(0.12 * wide, ((host.clientWidth - left - right) / scale - wide) / 2);
    const width = Math.round(left + right + (wide + 2 * spare) * scale);
    const x0 = box.x0 - spare, x1 = box.x1 + spare, { z0, z1 } = box;
    const height = Math.round(top + bottom + tall * scale);
    const drawing = root(host, width, height);
    const X = (x) => left + (x - x0) * scale, Z = (z) => height - bottom - (z - z0) * scale;
    const id = "clip-" + page.plane.count++;
    const clip = svg("clipPath", { id });
    clip.append(svg("rect", { x: left, y: top, width: width - left - right, height: height - top - bottom }));
    drawing.append(clip);
    const zTicks = ticks(z0, z1, (height - top - bottom) / 55), xTicks = ticks(x0, x1, (width - left - right) / 70);
    tickLabels(xTicks).forEach((text, i) => {
      drawing.append(line(X(xTicks[i]), top, X(xTicks[i]), height - bottom, theme.grid()));
      drawing.append(label(text, X(xTicks[i]), height - bottom + 16, "middle"));
    });
    tickLabels(zTicks).forEach((text, i) => {
      drawing.append(line(left, Z(zTicks[i]), width - right, Z(zTicks[i]), theme.grid()));
      drawing.append(label(text, left - 8, Z(zTicks[i]) + 4, "end"));
    });
    drawing.append(label(titled(spec.x_axis), (left + width - right) / 2, height - 10, "middle"));
    const middle = (top + height - bottom) / 2;
    drawing.append(label(titled(spec.z_axis), 14, middle, "middle", null, { transform: `rotate(-90 14 ${middle})` }));
    const content = svg("g", { "clip-path": `url(#${id})` });
    drawing.append(content);
    return { drawing, content, X, Z, scale, left, top, right: width - right, bottom: height - bottom, width, height,
      x0, x1, z0, z1 };
  };
  page.plane.count = 0;

  page.kinds.bars = function (host, spec) {
    const width = host.clientWidth, many = spec.series.length, colors = spec.series.map((s) => theme.color(s.color));
    const left = Math.min(width * 0.5, 16 + Math.max(30, ...spec.categories.map(textWidth))), right = 70;
    const barHeight = spec.stacked ? 22 : 15, rowHeight = (spec.stacked ? barHeight : barHeight * Math.max(1, many)) + 12;
    const rows = spec.categories.length;
    const drawing = root(host, width, 0);
    const top = many > 1 ? key(drawing, spec.series.map((s, k) => ({ name: s.name, color: colors[k] })), left, width) : 8;
    const bottom = top + Math.max(1, rows) * rowHeight, height = bottom + 42;
    drawing.setAttribute("height", height);
    drawing.setAttribute("viewBox", `0 0 ${width} ${height}`);

    let lo = 0, hi = 0;
    for (let r = 0; r < rows; ++r) {
      let up = 0, down = 0;
      for (const s of spec.series) {
        const v = s.values[r] || 0;
        if (spec.stacked) v > 0 ? (up += v) : (down += v);
        else [up, down] = [Math.max(up, v), Math.min(down, v)];
      }
      [lo, hi] = [Math.min(lo, down), Math.max(hi, up)];
    }
    if (hi === lo) hi = 1;
    const X = (v) => left + ((v - lo) / (hi - lo)) * (width - left - right);
    const marks = ticks(lo, hi, (width - left - right) / 90);
    tickLabels(marks).forEach((text, i) => {
      drawing.append(line(X(marks[i]), top, X(marks[i]), bottom, theme.grid()));
      drawing.append(label(text, X(marks[i]), bottom + 16, "middle"));
    });
    drawing.append(label(titled(spec.value_axis), (left + width - right) / 2, bottom + 35, "middle"));
    for (let r = 0; r < rows; ++r) {
      const y = top + r * rowHeight + 6;
      drawing.append(label(spec.categories[r], left - 8, y + (rowHeight - 12) / 2 + 4, "end", theme.ink()));
      let up = 0, down = 0, any = false;
      spec.series.forEach((s, k) => {
        const v = s.values[r];
        if (v == null) return;
        any = true;
        const from = spec.stacked ? (v >= 0 ? up : down) : 0, to = from + v;
        const at = spec.stacked ? y : y + k * barHeight;
        const bar = svg("rect", { x: Math.min(X(from), X(to)), y: at, width: Math.max(Math.abs(X(to) - X(from)), 0.5),
          height: spec.stacked ? barHeight : barHeight - 2, fill: colors[k] });
        bar.append(svg("title", {}, `${spec.categories[r]}, ${s.name}: ${number(v)} ${spec.value_axis.unit}`));
        drawing.append(bar);
        if (spec.stacked) v >= 0 ? (up = to) : (down = to);
        else drawing.append(label(number(v, 3), Math.max(X(0), X(v)) + 5, at + barHeight - 4, "start", theme.ink()));
      });
      if (spec.stacked) {
        const text = any ? number(up + down, 3) : "no value";
        drawing.append(label(text, Math.max(X(0), X(up)) + 6, y + barHeight / 2 + 4, "start", theme.ink(), { "font-weight": 600 }));
      }
    }
    if (rows === 0) drawing.append(label("no values", width / 2, top + 20, "middle"));
    drawing.append(line(X(0), top, X(0), bottom, theme.muted()));
    return {
      picture: () => page.rasterised(drawing),
      rows: () => [["", ...spec.series.map((s) => titled({ label: s.name, unit: spec.value_axis.unit }))]].concat(
        spec.categories.map((name, r) => [name, ...spec.series.map((s) => s.values[r])])),
    };
  };

  /* A Sankey diagram: nodes in columns, bands as wide as the amount, nodes of a column in the order of the spec. */
  page.kinds.sankey = function (host, spec) {
    const width = host.clientWidth, height = spec.height || 300, gap = 9, bar = 10, top = 8;
    const drawing = root(host, width, height);
    const sum = (flows) => flows.reduce((s, f) => s + f.amount, 0);
    const nodes = spec.nodes.map((name, i) => {
      const into = spec.flows.filter((f) => f.to === i), out = spec.flows.filter((f) => f.from === i);
      return { name, into, out, amount: Math.max(sum(into), sum(out)), column: spec.columns[i], i };
    });
    const shown = nodes.filter((n) => n.amount > 0), last = Math.max(1, ...shown.map((n) => n.column));
    const columns = Array.from({ length: last + 1 }, (_, c) => shown.filter((n) => n.column === c));
    const fullest = Math.max(1e-300, spec.scale || 0, ...columns.map((c) => sum(c)));
    const most = Math.max(1, ...columns.map((c) => c.length));
    const scale = (height - 2 * top - gap * most - 14) / fullest;
    const text = (n) => `${n.name} ${number(n.amount, 3)}`;
    const room = 8 + Math.max(0, ...columns[last].map((n) => textWidth(text(n))));
    const X = (column) => 2 + (column / last) * (width - room - bar - 6);
    for (const column of columns) {
      let y = top + 14;
      for (const n of column) {
        Object.assign(n, { y, tall: Math.max(1, n.amount * scale), leaves: y, enters: y });
        y += n.tall + Math.max(n.column < last ? 2 * gap : gap, 14 - n.tall);
      }
    }
    const color = (n) => theme.color(n.i);
    const halo = { stroke: theme.paper(), "stroke-width": 3, "paint-order": "stroke" };  // readable on bands
    for (const f of spec.flows) {
      if (!(f.amount > 0)) continue;
      const a = nodes[f.from], b = nodes[f.to], w = f.amount * scale;
      const x0 = X(a.column) + bar, x1 = X(b.column), m = (x0 + x1) / 2;
      const band = svg("path", { fill: color(b.out.length ? a : b), "fill-opacity": 0.45, d:
        `M${x0} ${a.leaves}C${m} ${a.leaves} ${m} ${b.enters} ${x1} ${b.enters}v${w}` +
        `C${m} ${b.enters + w} ${m} ${a.leaves + w} ${x0} ${a.leaves + w}z` });
      band.append(svg("title", {}, `${a.name} to ${b.name}: ${number(f.amount)} ${spec.amount.unit}`));
      drawing.append(band);
      a.leaves += w;
      b.enters += w;
    }
    for (const n of shown) {
      drawing.append(svg("rect", { x: X(n.column), y: n.y, width: bar, height: n.tall, fill: color(n) }));
      if (n.column === last) drawing.append(label(text(n), X(n.column) + bar + 5, n.y + n.tall / 2 + 4, "start", theme.ink()));
      else drawing.append(label(text(n), X(n.column), n.y - 4, "start", theme.ink(), halo));
    }
    if (shown.length === 0) drawing.append(label("no values", width / 2, top + 20, "middle"));
    const low = Math.max(height, ...shown.map((n) => n.y + n.tall + top));
    drawing.setAttribute("height", low);
    drawing.setAttribute("viewBox", `0 0 ${width} ${low}`);
    return {
      picture: () => page.rasterised(drawing),
      rows: () => [["from", "to", titled(spec.amount)]].concat(
        spec.flows.map((f) => [spec.nodes[f.from], spec.nodes[f.to], f.amount])),
    };
  };

  /* Colour maps: stops of matplotlib's magma, reversed so that large values are dark, and blue - white - vermilion. */
  const kSequential = ["#fcf0c0", "#fdbc7d", "#f8765c", "#d3436e", "#982d80", "#5f187f", "#231151"];
  const kDiverging = ["#00446b", "#0072b2", "#86bfe0", "#f4f4f2", "#f0a878", "#d55e00", "#803800"];
  function colorScale(stops) {
    const rgb = stops.map((h) => [1, 3, 5].map((i) => parseInt(h.slice(i, i + 2), 16)));
    return (part) => {
      const at = Math.min(Math.max(part, 0), 1) * (rgb.length - 1), i = Math.min(Math.floor(at), rgb.length - 2);
      return "rgb(" + rgb[i].map((c, k) => Math.round(c + (rgb[i + 1][k] - c) * (at - i))).join(",") + ")";
    };
  }

  page.kinds.heat = function (host, spec) {
    const values = spec.values.flat().filter((v) => v != null);
    let lo = Math.min(...values), hi = Math.max(...values);
    if (values.length === 0) [lo, hi] = [0, 1];
    if (spec.diverging) [lo, hi] = [-Math.max(Math.abs(lo), Math.abs(hi)), Math.max(Math.abs(lo), Math.abs(hi))];
    if (lo === hi) hi = lo + (Math.abs(lo) || 1);
    const color = colorScale(spec.diverging ? kDiverging : kSequential);

    const xs = spec.x_edges.concat(), zs = spec.z_edges.concat();
    for (const part of spec.crane) part.points.forEach((v, i) => (i % 2 ? zs : xs).push(v));
    if (xs.length === 0) xs.push(0, 1);
    if (zs.length === 0) zs.push(0, 1);
    const box = { x0: Math.min(...xs), x1: Math.max(...xs), z0: Math.min(...zs), z1: Math.max(...zs) };
    const pad = 0.02 * (box.z1 - box.z0);
    box.z0 -= pad;
    box.z1 += pad;
    const plane = page.plane(host, box, spec, 110, spec.height || 500);
    const { drawing, content, X, Z } = plane;

    const cells = svg("g", { "shape-rendering": "crispEdges" });
    content.append(cells);
    spec.values.forEach((row, r) => row.forEach((v, c) => {
      if (v == null) return;
      const x = X(spec.x_edges[c]), z = Z(spec.z_edges[r + 1]);
      const w = X(spec.x_edges[c + 1]) - x, h = Z(spec.z_edges[r]) - z;
      cells.append(svg("rect", { x: x.toFixed(1), y: z.toFixed(1), width: (w + 0.4).toFixed(1), height: (h + 0.4).toFixed(1),
        fill: color((v - lo) / (hi - lo)) }));
    }));
    const kinds = spec.crane.map((p) => p.kind), points = spec.crane.map((p) => p.points);
    const halo = svg("g", { opacity: 0.8 });
    page.drawParts(halo, kinds, points, plane, 0.95, theme.paper());
    content.append(halo);
    page.drawParts(content, kinds, points, plane, 0.6);
    if (values.length === 0) drawing.append(label("no values", (plane.left + plane.right) / 2, plane.top + 20, "middle"));

    const barX = plane.right + 18, barTop = plane.top + 8, barHeight = Math.min(260, plane.bottom - barTop - 26);
    const steps = 48;
    for (let i = 0; i < steps; ++i) {
      drawing.append(svg("rect", { x: barX, y: barTop + 20 + barHeight * (1 - (i + 1) / steps), width: 14,
        height: barHeight / steps + 0.5, fill: color((i + 0.5) / steps) }));
    }
    const marks = ticks(lo, hi, barHeight / 45), onBar = (v) => barTop + 20 + barHeight * (1 - (v - lo) / (hi - lo));
    tickLabels(marks).forEach((text, i) => drawing.append(label(text, barX + 20, onBar(marks[i]) + 4)));
    drawing.append(label(spec.value.unit ? "[" + spec.value.unit + "]" : "", barX, barTop + 8, "start", theme.ink()));

    const reading = label("", plane.left + 8, plane.top + 16, "start", theme.ink());
    drawing.append(reading);
    const cell = (edges, v) => edges.findIndex((e, i) => i + 1 < edges.length && v >= e && v < edges[i + 1]);
    drawing.addEventListener("pointermove", (e) => {
      const at = drawing.getBoundingClientRect();
      const c = cell(spec.x_edges, plane.x0 + (e.clientX - at.left - plane.left) / plane.scale);
      const r = cell(spec.z_edges, plane.z0 + (plane.bottom - (e.clientY - at.top)) / plane.scale);
      const v = c >= 0 && r >= 0 ? spec.values[r][c] : null;
      reading.textContent = v == null ? "" : `${spec.value.label} ${number(v)} ${spec.value.unit}` +
        (spec.counts ? `, ${number(spec.counts[r][c])} samples` : "");
    });
    drawing.addEventListener("pointerleave", () => (reading.textContent = ""));
    return {
      picture: () => page.rasterised(drawing),
      rows: () => [[titled(spec.x_axis) + " centre", titled(spec.z_axis) + " centre", titled(spec.value)]].concat(
        ...spec.values.map((row, r) => row.map((v, c) => [(spec.x_edges[c] + spec.x_edges[c + 1]) / 2,
          (spec.z_edges[r] + spec.z_edges[r + 1]) / 2, v]))),
    };
  };
  page.svgTools = { line, label, textWidth };
})();
