"use strict";
/* The crane at several instants, and a slider that moves it. */
(function () {
  const { theme, number, ticks, element, svg } = page;
  const { line, label, textWidth } = page.svgTools;

  /* Draws the parts of one instant into an SVG group, with line widths relative to the crane's size; `only` is one
     colour for all parts. */
  page.drawParts = function (into, kinds, points, plane, weight, only) {
    const reach = Math.max(plane.z1 - plane.z0, 0.5 * (plane.x1 - plane.x0)) * plane.scale;
    const unit = Math.min(Math.max(reach * 0.0022, 0.7), 1.6) * (weight || 1);
    const steel = theme.get("--steel"), rod = theme.get("--rod"), barrel = theme.get("--barrel");
    const looks = { link: [steel, 9], telescope: [steel, 6], barrel: [barrel, 5.5], rod: [rod, 3],
      rocker: [theme.color(0), 3.5], coupler: [theme.color(0), 3.5] };
    let stage = 0;
    kinds.forEach((kind, i) => {
      const p = points[i];
      if (p.length < 2) return;
      if (kind === "mark") return drawMark(into, p, plane, unit);
      if (kind === "pin") {
        into.append(svg("circle", { cx: plane.X(p[0]), cy: plane.Z(p[1]), r: 2.4 * unit, fill: theme.paper(),
          stroke: only || steel, "stroke-width": 1.2 * unit }));
        return;
      }
      const [color, width] = looks[kind];
      const thinner = kind === "telescope" ? Math.pow(0.82, stage++) : 1;  // Inner stages are slimmer.
      into.append(svg("polyline", { points: polyline(p, plane), fill: "none", stroke: only || color,
        "stroke-width": width * thinner * unit, "stroke-linecap": kind === "barrel" ? "butt" : "round",
        "stroke-linejoin": "round" }));
    });
  };

  function polyline(p, plane) {
    let text = "";
    for (let i = 0; i < p.length; i += 2) text += plane.X(p[i]).toFixed(1) + "," + plane.Z(p[i + 1]).toFixed(1) + " ";
    return text;
  }

  /* A halo over a part, or the sign of a centre of mass. */
  function drawMark(into, p, plane, unit) {
    const color = theme.color(4);
    if (p.length > 2) {
      into.append(svg("polyline", { points: polyline(p, plane), fill: "none", stroke: color, "stroke-width": 13 * unit,
        "stroke-linecap": "round", opacity: 0.5 }));
      return;
    }
    const x = plane.X(p[0]), y = plane.Z(p[1]), r = 5.5 * unit;
    into.append(svg("circle", { cx: x, cy: y, r, fill: theme.paper(), stroke: theme.ink(), "stroke-width": 1 }));
    for (const [dx, dy] of [[1, -1], [-1, 1]])
      into.append(svg("path", { d: `M${x},${y} h${dx * r} A${r},${r} 0 0 0 ${x},${y + dy * r} Z`, fill: theme.ink() }));
    into.append(svg("circle", { cx: x, cy: y, r: r + 2.5 * unit, fill: "none", stroke: color, "stroke-width": 2.2 * unit }));
  }

  const kLineHeight = 16;
  /* Where the texts of marks stand: a column right of the drawing, in the order of the places' heights at the last instant. */
  function markTexts(spec) {
    const marks = spec.marks || [], last = spec.frames[spec.frames.length - 1];
    if (marks.length === 0 || !last) return [];
    const parts = spec.kinds.map((kind, i) => i).filter((i) => spec.kinds[i] === "mark");
    const height = (i) => middle(last.points[i])[1];
    return marks.map((mark, k) => ({ ...mark, part: parts[k] })).sort((a, b) => (height(b.part) || 0) - (height(a.part) || 0));
  }

  function middle(p) {
    return p.length < 4 ? p : [(p[0] + p[2]) / 2, (p[1] + p[3]) / 2];
  }

  function drawMarkTexts(into, texts, points, plane) {
    const x = plane.right + 30, size = (t) => (1 + t.lines.length) * kLineHeight + 10;
    let y = plane.top;
    const tops = texts.map((t) => {  // as near to its place's height as the texts above allow
      const p = middle(points[t.part]);
      const top = Math.max(y, p.length ? plane.Z(p[1]) - size(t) / 2 : y);
      y = top + size(t);
      return top;
    });
    for (let k = texts.length - 1, floor = plane.height; k >= 0; --k) {
      tops[k] = Math.max(0, Math.min(tops[k], floor - size(texts[k])));
      floor = tops[k];
    }
    texts.forEach((t, k) => {
      const p = middle(points[t.part]);
      if (p.length) into.append(line(plane.X(p[0]), plane.Z(p[1]), x - 6, tops[k] + 10, theme.ink(), 0.9));
      into.append(label(t.name, x, tops[k] + 14, "start", theme.ink(), { "font-weight": 600 }));
      t.lines.forEach((text, i) => into.append(label(text, x, tops[k] + 14 + (i + 1) * kLineHeight, "start", theme.ink())));
    });
  }

  function drawPayload(into, tip, plane) {
    const x = plane.X(tip[0]), z = plane.Z(tip[1]), s = Math.min(Math.max(0.28 * plane.scale, 7), 18);
    into.append(line(x, z, x, z + s * 1.1, theme.muted(), 1.2));
    into.append(svg("rect", { x: x - s / 2, y: z + s * 1.1, width: s, height: s * 0.8, fill: theme.color(1), rx: 1 }));
  }

  /* The view: it holds everything the crane touches; obstacles widen it by half at most. */
  function extent(spec) {
    const box = { x0: 0, x1: 0, z0: 0, z1: 0 };
    const include = (x, z) => {
      box.x0 = Math.min(box.x0, x); box.x1 = Math.max(box.x1, x);
      box.z0 = Math.min(box.z0, z); box.z1 = Math.max(box.z1, z);
    };
    const flat = (p) => { for (let i = 0; i < p.length; i += 2) include(p[i], p[i + 1]); };
    for (const f of spec.frames) { f.points.forEach(flat); flat(f.tip); }
    if (spec.goal) flat(spec.goal);
    spec.paths.forEach((p) => flat(p.points));
    if (spec.ground != null) include(0, spec.ground);
    const size = Math.max(box.x1 - box.x0, box.z1 - box.z0) || 1, core = { ...box };
    for (const o of spec.obstacles) {
      for (let i = 0; i < o.points.length; i += 2) {
        for (const d of [-o.radius, o.radius]) {
          include(Math.min(Math.max(o.points[i] + d, core.x0 - size / 4), core.x1 + size / 4),
                  Math.min(Math.max(o.points[i + 1] + d, core.z0 - size / 4), core.z1 + size / 4));
        }
      }
    }
    const pad = 0.05 * size;
    return { x0: box.x0 - pad, x1: box.x1 + pad, z0: box.z0 - pad, z1: box.z1 + pad };
  }

  function drawScene(plane, spec) {
    const { content } = plane;
    if (spec.ground != null) {
      const y = plane.Z(spec.ground);
      content.append(line(plane.left, y, plane.right, y, theme.muted(), 1.5));
      for (let x = plane.left; x < plane.right; x += 14) content.append(line(x, y + 7, x + 7, y, theme.muted(), 0.8));
    }
    for (const o of spec.obstacles) {
      const look = { fill: page.faded(theme.get("--c3"), 0.35), stroke: theme.get("--c3"), "stroke-width": 1.2 };
      const shape = o.radius > 0
        ? svg("circle", { cx: plane.X(o.points[0]), cy: plane.Z(o.points[1]), r: o.radius * plane.scale, ...look })
        : svg("polygon", { points: polyline(o.points, plane), ...look });
      shape.append(svg("title", {}, o.name));
      content.append(shape);
    }
  }

  /* Writes the names of obstacles over everything, at the middle of their visible part. */
  function drawObstacleNames(plane, spec) {
    for (const o of spec.obstacles) {
      let x = 0, z = 0;
      for (let i = 0; i < o.points.length; i += 2) {
        x += Math.min(Math.max(o.points[i], plane.x0), plane.x1);
        z += Math.min(Math.max(o.points[i + 1], plane.z0), plane.z1);
      }
      const count = o.points.length / 2 || 1;
      plane.content.append(label(o.name, plane.X(x / count), plane.Z(z / count) + 4, "middle", theme.ink()));
    }
  }

  function drawTipPaths(plane, spec) {
    const { content, X, Z } = plane;
    for (const path of spec.paths) {
      content.append(svg("polyline", { points: polyline(path.points, plane), fill: "none", stroke: theme.muted(),
        "stroke-width": 1.5, "stroke-dasharray": "5 4" }));
    }
    if (spec.frames.length === 0) return;
    const tips = spec.frames.map((f) => f.tip), first = tips[0], last = tips[tips.length - 1];
    content.append(svg("polyline", { points: polyline(tips.flat(), plane), fill: "none", stroke: theme.color(1), "stroke-width": 1.8 }));
    for (const [at, text] of [[first, "start"], [spec.goal || last, spec.goal ? "goal" : "end"]]) {
      content.append(svg("circle", { cx: X(at[0]), cy: Z(at[1]), r: 5, fill: text === "start" ? theme.paper() : theme.color(1),
        stroke: theme.color(1), "stroke-width": 1.8 }));
      const outside = X(at[0]) + 50 > plane.right;
      content.append(label(text, X(at[0]) + (outside ? -9 : 9), Z(at[1]) + (text === "start" ? 20 : 5), outside ? "end" : "start", theme.ink(),
        { "font-weight": 600 }));
    }
  }

  /* Draws the scale bar below the axes, where it covers nothing. */
  function drawScaleBar(plane) {
    const metres = ticks(0, 70 / plane.scale, 1).step, to = plane.right, from = to - metres * plane.scale;
    const y = plane.height - 8;
    const g = svg("g");
    g.append(line(from, y, to, y, theme.ink(), 2));
    for (const x of [from, to]) g.append(line(x, y - 4, x, y + 4, theme.ink(), 1.5));
    g.append(label(metres + " m", from - 8, y + 4, "end", theme.ink()));
    plane.drawing.append(g);
  }

  /* Interpolates all coordinates linearly between two frames. */
  function between(frames, time) {
    let k = frames.findIndex((f) => f.t >= time);
    if (k < 0) k = frames.length - 1;
    if (k === 0) return frames[0];
    const a = frames[k - 1], b = frames[k], part = b.t > a.t ? Math.min((time - a.t) / (b.t - a.t), 1) : 1;
    const mix = (p, q) => (p.length === q.length ? p.map((v, i) => v + (q[i] - v) * part) : part < 0.5 ? p : q);
    return { t: time, tip: mix(a.tip, b.tip), points: a.points.map((p, i) => mix(p, b.points[i])) };
  }

  page.kinds.crane = function (host, spec) {
    const texts = markTexts(spec), widest = Math.max(0, ...texts.flatMap((t) => [t.name, ...t.lines]).map(textWidth));
    const margin = texts.length ? Math.min(widest + 50, host.clientWidth / 2) : 14;
    const plane = page.plane(host, extent(spec), spec, margin, spec.height || 580);
    const { content, drawing } = plane, frames = spec.frames;
    drawScene(plane, spec);
    const stills = Math.min(spec.stills, frames.length);
    for (let k = 0; k < stills; ++k) {
      const time = frames[0].t + (frames[frames.length - 1].t - frames[0].t) * (stills > 1 ? k / (stills - 1) : 1);
      const still = svg("g", { opacity: (0.1 + 0.3 * (k + 1) / stills).toFixed(2) });
      const frame = between(frames, time);
      // What is marked moves with the crane.
      const parts = frame.points.map((p, i) => (spec.kinds[i] === "mark" ? [] : p));
      page.drawParts(still, spec.kinds, parts, plane, 0.85);
      content.append(still);
    }
    drawTipPaths(plane, spec);
    drawObstacleNames(plane, spec);
    const moving = svg("g");
    const words = svg("g");
    content.append(moving);
    drawing.append(words);
    drawScaleBar(plane);
    if (frames.length === 0) {
      drawing.append(label("no values", (plane.left + plane.right) / 2, plane.top + 20, "middle"));
      return { picture: () => page.rasterised(drawing), rows: () => [["t [s]", "tip x [m]", "tip z [m]"]] };
    }

    const start = frames[0].t, end = frames[frames.length - 1].t;
    const player = element("div", { class: "player" });
    const button = element("button", { type: "button" }, "play");
    const slider = element("input", { type: "range", min: start, max: end, step: "any", "aria-label": "time" });
    const output = element("output");
    player.append(button, slider, output);
    host.append(player);

    function show(time) {
      const frame = between(frames, Math.min(Math.max(time, start), end));
      moving.replaceChildren();
      page.drawParts(moving, spec.kinds, frame.points, plane);
      words.replaceChildren();
      drawMarkTexts(words, texts, frame.points, plane);
      if (spec.payload) drawPayload(moving, frame.tip, plane);
      slider.value = time;
      const metres = (v) => v.toFixed(2).replace("-", "−") + " m";
      output.textContent = `t = ${frame.t.toFixed(2)} s · tip ${spec.x_axis.label} ${metres(frame.tip[0])}, ` +
        `${spec.z_axis.label} ${metres(frame.tip[1])}`;
    }

    // Plays in real time, faster when the motion takes longer than ten seconds.
    const speed = Math.max(1, (end - start) / 10);
    let playing = 0, since = 0;
    function step(now) {
      const time = Math.min(slider.valueAsNumber + (speed * (now - since)) / 1000, end);
      since = now;
      show(time);
      page.tellInstant(spec.group, time, slider);
      playing = time < end ? requestAnimationFrame(step) : 0;
      button.textContent = playing ? "pause" : "play";
    }
    function pause() {
      cancelAnimationFrame(playing);
      playing = 0;
      button.textContent = "play";
    }
    button.title = speed > 1 ? `plays ${number(speed, 2)} times as fast as the crane` : "plays in real time";
    button.addEventListener("click", () => {
      if (playing) return pause();
      if (slider.valueAsNumber >= end - 1e-9) show(start);
      since = performance.now();
      playing = requestAnimationFrame(step);
      button.textContent = "pause";
    });
    slider.addEventListener("input", () => {
      pause();
      show(slider.valueAsNumber);
      page.tellInstant(spec.group, slider.valueAsNumber, slider);
    });
    const forget = page.onInstant(spec.group, (time, source) => { if (source !== slider) show(time); });
    show(end);
    return {
      picture: () => page.rasterised(drawing),
      rows: () => [["t [s]", "tip " + spec.x_axis.label + " [m]", "tip " + spec.z_axis.label + " [m]"]].concat(
        frames.map((f) => [f.t, ...f.tip])),
      remove: () => { pause(); forget(); },
    };
  };
})();
