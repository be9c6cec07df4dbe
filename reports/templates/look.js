"use strict";
/* The first look: panels of lines, dots and areas; a record's window is dragged, and says what to paste. */
(() => {
  const SVG = "http://www.w3.org/2000/svg";
  const W = Math.min(720, Math.max(320, document.querySelector("main").clientWidth - 36));  // letters of one size on any page
  const LEFT = 74, RIGHT = 14, TOP = 10, BOTTOM = 42;
  const COLOURS = ["#0072b2", "#b34700", "#007a59", "#a4508a", "#8a5f00", "#1c6f9c"];
  const DASHES = ["", "7 3", "9 3 2 3", "2 2.5", "12 3", "5 5"];

  const put = (node, parent, attributes, text) => {
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    if (text !== undefined) node.textContent = text;
    parent.append(node);
    return node;
  };
  const draw = (parent, name, attributes, text) => put(document.createElementNS(SVG, name), parent, attributes, text);
  const make = (parent, name, attributes = {}, text) => put(document.createElement(name), parent, attributes, text);
  const short = (value) => String(Number(value.toPrecision(4))).replace("-", "−");
  const ticks = (low, high, count) => {
    const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((m) => m * power).find((one) => one >= raw * 0.999);
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(Number((k * step).toPrecision(10)));
    return found;
  };
  const logTicks = (low, high) => {
    const found = [];
    for (let p = Math.floor(Math.log10(low)); p <= Math.log10(high); p++) {
      for (const m of [1, 2, 5]) found.push(Number((m * 10 ** p).toPrecision(3)));
    }
    return found.filter((one) => one >= low && one <= high);
  };
  const extent = (lists) => {
    const all = lists.flat().filter((one) => one !== null && one !== undefined);
    const low = Math.min(...all), high = Math.max(...all);
    return high > low ? [low, high] : [low - 0.5 * Math.abs(low) - 1e-12, high + 0.5 * Math.abs(high) + 1e-12];
  };

  /* One panel: gives back how x turns into a place, and the group that is clipped to it. */
  const panel = (svg, one, top, range, key) => {
    const ys = extent(one.series.flatMap((s) => [s.y ?? [], s.low ?? [], s.high ?? []]));
    const margin = 0.06 * (ys[1] - ys[0]);
    const [x0, x1] = one.bounds ? one.bounds : range, [y0, y1] = one.bounds ? one.bounds.slice(2) : [ys[0] - margin, ys[1] + margin];
    const scale = one.log ? Math.log : (x) => x;
    const px = (x) => LEFT + (scale(x) - scale(x0)) / (scale(x1) - scale(x0)) * (W - LEFT - RIGHT);
    const bottom = top + one.height - (one.x ? BOTTOM : 12), high = top + TOP;
    const py = (y) => high + (1 - (y - y0) / (y1 - y0)) * (bottom - high);
    draw(draw(draw(svg, "defs", {}), "clipPath", { id: key }), "rect", { x: LEFT, y: high, width: W - LEFT - RIGHT, height: bottom - high });
    for (const value of ticks(y0, y1, one.height > 200 ? 6 : 3)) {
      draw(svg, "line", { x1: LEFT, x2: W - RIGHT, y1: py(value), y2: py(value), stroke: "#e4e4e4" });
      draw(svg, "text", { x: LEFT - 7, y: py(value) + 4, "text-anchor": "end", "font-size": 13, fill: "#333" }, String(value).replace("-", "−"));
    }
    for (const value of one.log ? logTicks(x0, x1) : ticks(x0, x1, W > 500 ? 8 : 4)) {
      draw(svg, "line", { x1: px(value), x2: px(value), y1: bottom, y2: bottom + 5, stroke: "#333" });
      if (one.x) draw(svg, "text", { x: px(value), y: bottom + 19, "text-anchor": "middle", "font-size": 13, fill: "#333" }, String(value).replace("-", "−"));
    }
    draw(svg, "path", { d: `M${LEFT} ${high}V${bottom}H${W - RIGHT}`, fill: "none", stroke: "#333" });
    draw(svg, "text", { x: (LEFT + W - RIGHT) / 2, y: bottom + 37, "text-anchor": "middle", "font-size": 14, fill: "#1b1b1b" }, one.x);
    draw(svg, "text", { x: 0, y: 0, transform: `translate(15 ${(high + bottom) / 2}) rotate(-90)`, "text-anchor": "middle", "font-size": 14,
      fill: "#1b1b1b" }, one.y);
    const plot = draw(svg, "g", { "clip-path": `url(#${key})` });
    const at = (x, y) => `${px(x).toFixed(1)} ${py(y).toFixed(1)}`;
    for (const s of one.series) {
      const kept = s.x.map((_, i) => i).filter((i) => s.x[i] !== null && (s.y ? s.y[i] : s.low[i]) !== null);
      const colour = COLOURS[(s.tone ?? 0) % 6];
      let node = null;
      if (s.mark === "dots") {
        node = draw(plot, "g", { fill: "#1b1b1b" });
        for (const i of kept) draw(node, "circle", { cx: px(s.x[i]).toFixed(1), cy: py(s.y[i]).toFixed(1), r: kept.length > 60 ? 1.8 : 3.5 });
      } else if (s.mark === "area") {
        if (kept.length) {
          const up = kept.map((i) => at(s.x[i], s.high[i])), down = kept.toReversed().map((i) => at(s.x[i], s.low[i]));
          node = draw(plot, "path", { d: `M${up.join("L")}L${down.join("L")}Z`, fill: "#bcd3e6" });
        }
      } else {
        const look = { line: { stroke: colour, "stroke-width": 2, "stroke-dasharray": DASHES[(s.tone ?? 0) % 6] },
          dashes: { stroke: colour, "stroke-width": 1.6, "stroke-dasharray": "6 4" }, thin: { stroke: "#8fb3d3", "stroke-width": 0.9 } }[s.mark];
        node = draw(plot, "path", { d: kept.length ? `M${kept.map((i) => at(s.x[i], s.y[i])).join("L")}` : "", fill: "none", ...look });
      }
      if (node) draw(node, "title", {}, s.label);
    }
    return { px, plot, high, bottom, x: (place) => x0 + (place - LEFT) / (W - LEFT - RIGHT) * (x1 - x0) };
  };

  /* What a mark means, in words and with its colour. */
  const legend = (tool, panels) => {
    const line = make(tool, "p", { class: "key" });
    const seen = new Set();
    for (const s of panels.flatMap((one) => one.series)) {
      if (seen.has(s.label)) continue;
      seen.add(s.label);
      const item = make(line, "span", { class: "mark" });
      const swatch = draw(item, "svg", { viewBox: "0 0 26 10", width: 26, height: 10, "aria-hidden": "true" });
      const colour = COLOURS[(s.tone ?? 0) % 6];
      if (s.mark === "dots") draw(swatch, "circle", { cx: 13, cy: 5, r: 3, fill: "#1b1b1b" });
      else if (s.mark === "area") draw(swatch, "rect", { width: 26, height: 10, fill: "#bcd3e6" });
      else draw(swatch, "path", { d: "M0 5H26", fill: "none", "stroke-width": 2, stroke: s.mark === "thin" ? "#8fb3d3" : colour,
        "stroke-dasharray": s.mark === "dashes" ? "6 4" : s.mark === "line" ? DASHES[(s.tone ?? 0) % 6] : "" });
      item.append(` ${s.label}`);
    }
  };

  const slide = (figure, tool, svg, drawn, data) => {
    const w = data.window, dots = data.panels[0].series.find((s) => s.mark === "dots");
    const edges = { start: w.start, stop: w.stop }, step = (w.max - w.min) / 1000;
    const shades = drawn.map((one) => ({ start: draw(one.plot, "rect", { y: one.high, height: one.bottom - one.high, fill: "#777", "fill-opacity": 0.28 }),
      stop: draw(one.plot, "rect", { y: one.high, height: one.bottom - one.high, fill: "#777", "fill-opacity": 0.28 }) }));
    const bars = {}, controls = make(tool, "div", { class: "controls" }), inputs = {};
    const first = drawn[0];
    for (const name of ["start", "stop"]) {
      bars[name] = draw(svg, "rect", { y: first.high, height: drawn.at(-1).bottom - first.high, width: 5, fill: "#a3121a", class: "edge" });
      const id = `${name}-${figure.id}`;
      const edge = make(controls, "div", { class: "controls side" });
      make(edge, "label", { for: id }, name);
      const range = make(edge, "input", { type: "range", id, min: w.min, max: w.max, step: "any" });
      const exact = make(edge, "input", { type: "number", "aria-label": `${name} [s], exact`, min: w.min, max: w.max, step: "any" });
      inputs[name] = { range, exact };
    }
    const paste = make(tool, "output", { class: "paste", role: "status", "aria-live": "polite", for: `start-${figure.id} stop-${figure.id}` });
    const show = () => {
      for (const [i, one] of drawn.entries()) {
        const [a, b] = [one.px(edges.start), one.px(edges.stop)];
        shades[i].start.setAttribute("x", LEFT);
        shades[i].start.setAttribute("width", Math.max(0, a - LEFT));
        shades[i].stop.setAttribute("x", b);
        shades[i].stop.setAttribute("width", Math.max(0, W - RIGHT - b));
      }
      const inside = dots.x.map((_, i) => i).filter((i) => dots.x[i] >= edges.start && dots.x[i] <= edges.stop).map((i) => dots.y[i]);
      for (const name of ["start", "stop"]) {
        bars[name].setAttribute("x", first.px(edges[name]) - 2.5);
        inputs[name].range.value = edges[name];
        inputs[name].range.setAttribute("aria-valuetext", `${edges[name].toFixed(w.decimals)} s`);
        if (document.activeElement !== inputs[name].exact) inputs[name].exact.value = edges[name].toFixed(w.decimals);
      }
      paste.textContent = `# ${w.place}\nstart = "${edges.start.toFixed(w.decimals)} s"\nstop = "${edges.stop.toFixed(w.decimals)} s"`
        + (inside.length ? `\n# amplitudes ${short(Math.min(...inside))} to ${short(Math.max(...inside))}` : "\n# no cycle that was read");
    };
    const move = (name, value) => {
      if (!Number.isFinite(value)) return;
      edges[name] = name === "start" ? Math.min(Math.max(value, w.min), edges.stop - step) : Math.max(Math.min(value, w.max), edges.start + step);
      show();
    };
    for (const name of ["start", "stop"]) {
      const { range, exact } = inputs[name];
      range.addEventListener("input", () => move(name, Number(range.value)));
      range.addEventListener("keydown", (event) => {
        const way = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -20, PageUp: 20 }[event.key];
        if (way === undefined) return;
        event.preventDefault();
        move(name, edges[name] + way * step);
      });
      exact.addEventListener("change", () => { if (exact.value !== "") move(name, Number(exact.value)); });
    }
    let held = null;
    const where = (event) => { const box = svg.getBoundingClientRect(); return first.x((event.clientX - box.left) / box.width * W); };
    svg.addEventListener("pointerdown", (event) => {
      const x = where(event);
      held = Math.abs(x - edges.start) <= Math.abs(x - edges.stop) ? "start" : "stop";
      svg.setPointerCapture(event.pointerId);
      event.preventDefault();
      move(held, x);
    });
    svg.addEventListener("pointermove", (event) => { if (held) move(held, where(event)); });
    for (const end of ["pointerup", "pointercancel"]) svg.addEventListener(end, () => { held = null; });
    show();
  };

  const build = (figure) => {
    const data = JSON.parse(figure.querySelector("script").textContent);
    const tool = document.createElement("div");
    tool.className = "tool";
    const total = data.panels.reduce((sum, one) => sum + one.height, 0);
    const svg = draw(tool, "svg", { viewBox: `0 0 ${W} ${total}`, role: "img", "aria-label": figure.querySelector(".still").textContent });
    if (!data.window) svg.style.cursor = "default";
    const w = data.window;
    const range = w ? [w.min, w.max] : extent(data.panels.flatMap((one) => one.series.map((s) => s.x)));
    let top = 0;
    const drawn = data.panels.map((one, i) => {
      const found = panel(svg, one, top, range, `clip-${figure.id}-${i}`);
      top += one.height;
      return found;
    });
    legend(tool, data.panels);
    if (w) slide(figure, tool, svg, drawn, data);
    figure.prepend(tool);
    figure.classList.add("drawn");
  };
  document.querySelectorAll("figure.chart").forEach(build);
})();
