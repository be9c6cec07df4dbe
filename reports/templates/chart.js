"use strict";
/* Charts that answer: the value under the pointer, and the value at the number that the slider chooses. */
(() => {
  const SVG = "http://www.w3.org/2000/svg";
  /* Of a chart, so that its letters have one size on any page. */
  const width = () => Math.min(720, Math.max(300, document.querySelector("main").clientWidth - 36));
  const LEFT = 66, RIGHT = 14, TOP = 14, BOTTOM = 46;
  const COLOURS = ["#0072b2", "#b34700", "#007a59", "#a4508a", "#8a5f00", "#1c6f9c", "#000000"];
  const DASHES = ["", "7 3", "9 3 2 3", "2 2.5", "12 3", "", "7 3"];

  const draw = (parent, name, attributes, text) => {
    const node = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    if (text !== undefined) node.textContent = text;
    parent.append(node);
    return node;
  };
  const make = (parent, name, attributes = {}, text) => {
    const node = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    if (text !== undefined) node.textContent = text;
    parent.append(node);
    return node;
  };
  const digits = (value, count = 3) => {
    if (value === null || !Number.isFinite(value)) return "none";
    return String(Number(value.toPrecision(count))).replace("-", "−");
  };
  const ticks = (low, high, count) => {
    const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((m) => m * power).find((one) => one >= raw);
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high * (1 + 1e-9); k++) found.push(Number((k * step).toPrecision(10)));
    return found;
  };
  /* Straight lines between the points of the grid; null where either neighbour does not exist. */
  const at = (grid, values, x) => {
    if (!values) return null;
    let i = 1;
    while (i < grid.length - 1 && grid[i] < x) i++;
    const [a, b] = [values[i - 1], values[i]];
    const t = (x - grid[i - 1]) / (grid[i] - grid[i - 1]);
    if (t <= 0) return a;
    if (t >= 1) return b;
    return a === null || b === null ? null : a + t * (b - a);
  };

  const build = (figure, data) => {
    const { x: axis, y: rise, grid, read } = data;
    const W = width(), H = W < 500 ? 330 : 430;
    const px = (x) => LEFT + (x - axis.min) / (axis.max - axis.min) * (W - LEFT - RIGHT);
    const py = (y) => TOP + (1 - y / rise.max) * (H - TOP - BOTTOM);
    const spaced = (text, unit) => (!unit ? text : unit === "°" ? text + unit : `${text} ${unit}`);
    const show = (value, count) => (read.percent ? `${digits(100 * value, count)} %` : spaced(digits(value, count), read.unit));

    const tool = document.createElement("div");
    tool.className = "tool";
    const svg = draw(tool, "svg", { viewBox: `0 0 ${W} ${H}`, role: "img", "aria-label": `${data.name}; the slider below reads it` });
    const clip = `clip-${figure.id}`;
    const inside = draw(draw(svg, "defs", {}), "clipPath", { id: clip });
    draw(inside, "rect", { x: LEFT, y: TOP, width: W - LEFT - RIGHT, height: H - TOP - BOTTOM });

    for (const value of ticks(0, rise.max, 6)) {
      draw(svg, "line", { x1: LEFT, x2: W - RIGHT, y1: py(value), y2: py(value), stroke: "#e4e4e4" });
      draw(svg, "text", { x: LEFT - 7, y: py(value) + 4, "text-anchor": "end", "font-size": 13, fill: "#333" },
        read.percent ? `${digits(100 * value)} %` : String(value));
    }
    for (const value of ticks(axis.min, axis.max, W < 500 ? 4 : 8)) {
      draw(svg, "line", { x1: px(value), x2: px(value), y1: H - BOTTOM, y2: H - BOTTOM + 5, stroke: "#333" });
      draw(svg, "text", { x: px(value), y: H - BOTTOM + 19, "text-anchor": "middle", "font-size": 13, fill: "#333" }, String(value));
    }
    draw(svg, "path", { d: `M${LEFT} ${TOP}V${H - BOTTOM}H${W - RIGHT}`, fill: "none", stroke: "#333" });
    draw(svg, "text", { x: (LEFT + W - RIGHT) / 2, y: H - 8, "text-anchor": "middle", "font-size": 14, fill: "#1b1b1b" }, axis.label);
    draw(svg, "text", { x: 0, y: 0, transform: `translate(16 ${(TOP + H - BOTTOM) / 2}) rotate(-90)`, "text-anchor": "middle",
      "font-size": 14, fill: "#1b1b1b" }, rise.label);

    const plot = draw(svg, "g", { "clip-path": `url(#${clip})` });
    const far = (value) => (value === null ? 2 * rise.max : Math.min(value, 2 * rise.max));
    const path = (xs, ys) => {
      let d = "", pen = false;
      xs.forEach((x, i) => {
        if (ys[i] === null) { pen = false; return; }
        d += `${pen ? "L" : "M"}${px(x).toFixed(1)} ${py(far(ys[i])).toFixed(1)}`;
        pen = true;
      });
      return d;
    };
    for (const area of data.areas) {
      const there = grid.map((_, i) => i).filter((i) => area.low[i] !== null);
      const up = there.map((i) => `${px(grid[i]).toFixed(1)} ${py(far(area.high[i])).toFixed(1)}`);
      const down = there.toReversed().map((i) => `${px(grid[i]).toFixed(1)} ${py(far(area.low[i])).toFixed(1)}`);
      if (up.length) draw(plot, "path", { d: `M${up.join("L")}L${down.join("L")}Z`, fill: area.tone === "outer" ? "#dcdcdc" : "#bdbdbd" });
    }
    let own = 0;
    for (const line of data.lines) {
      const paper = line.tone === "deterministic";
      const look = paper ? { stroke: "#000", "stroke-width": 1.2, "stroke-dasharray": "1.5 3" }
        : { stroke: COLOURS[own % 7], "stroke-width": 1.5, "stroke-dasharray": DASHES[own++ % 7] };
      draw(draw(plot, "path", { d: path(line.x, line.y), fill: "none", ...look }), "title", {}, line.label);
    }
    draw(plot, "path", { d: path(grid, read.median), fill: "none", stroke: "#1b1b1b", "stroke-width": 2.4 });
    for (const limit of data.limits ?? []) {
      draw(plot, "line", { x1: LEFT, x2: W - RIGHT, y1: py(limit.y), y2: py(limit.y), stroke: "#b34700", "stroke-width": 1.6, "stroke-dasharray": "7 4" });
      draw(svg, "text", { x: W - RIGHT - 4, y: py(limit.y) - 5, "text-anchor": "end", "font-size": 13, fill: "#8a3700", stroke: "#fff",
        "stroke-width": 5, "stroke-linejoin": "round", "paint-order": "stroke" }, limit.label);
    }
    /* The highest that a curve rises between two places: a name stands above it. */
    const curves = [[grid, read.median], ...data.lines.map((line) => [line.x, line.y])];
    const over = (from, to) => Math.min(...curves.flatMap(([xs, ys]) => xs.map((x, i) =>
      (px(x) < from || px(x) > to || ys[i] === null ? Infinity : py(far(ys[i]))))));
    for (const point of data.points) {
      draw(plot, "line", { x1: px(point.x), x2: px(point.x), y1: py(point.low), y2: py(point.high), stroke: "#1b1b1b" });
      const dot = draw(plot, "circle", { cx: px(point.x), cy: py(point.y), r: 5, fill: point.tone === "measured" ? "#1b1b1b" : "#fff",
        stroke: "#1b1b1b", "stroke-width": 1.5 });
      draw(dot, "title", {}, `${point.label}: ${axis.symbol} ${digits(point.x)}, ${show(point.y)}`);
      const right = px(point.x) > W - (W < 500 ? 175 : 190), wide = 7 * point.label.length + 8;
      const low = py(point.y) - 9, clear = over(px(point.x) - (right ? wide : 0), px(point.x) + (right ? 0 : wide)) - 5;
      draw(svg, "text", { x: px(point.x) + (right ? -8 : 8), y: low - clear > 40 ? low : Math.min(low, clear), "font-size": 13, fill: "#1b1b1b",
        "text-anchor": right ? "end" : "start", stroke: "#fff", "stroke-width": 5, "stroke-linejoin": "round", "paint-order": "stroke" }, point.label);
    }

    const hair = draw(plot, "line", { y1: TOP, y2: H - BOTTOM, stroke: "#4d4d4d", "stroke-dasharray": "3 3", visibility: "hidden" });
    const chosen = draw(plot, "line", { y1: TOP, y2: H - BOTTOM, stroke: "#a3121a", "stroke-width": 1.5 });
    const span = draw(plot, "line", { stroke: "#a3121a", "stroke-width": 5, "stroke-opacity": 0.55 });
    const mark = draw(plot, "circle", { r: 6, fill: "#a3121a", stroke: "#fff", "stroke-width": 1.5 });

    const under = make(tool, "p", { class: "under", "aria-hidden": "true" }, "Move the pointer over the plot to read it.");
    const controls = make(tool, "div", { class: "controls" });
    const limits = { min: axis.min, max: axis.max, step: axis.step };
    make(controls, "label", { for: `range-${figure.id}` }, axis.slider);
    const range = make(controls, "input", { type: "range", id: `range-${figure.id}`, ...limits });
    const exact = make(controls, "input", { type: "number", "aria-label": `${axis.slider}, exact`, step: "any" });
    const answer = make(tool, "output", { for: range.id, role: "status", "aria-live": "polite", "aria-atomic": "true" });

    const sentence = (x) => {
      const median = at(grid, read.median, x), low = at(grid, read.low, x), high = at(grid, read.high, x);
      const head = `${axis.symbol} = ${digits(x, 4)}: ${read.what} `;
      if (median === null) return `${head}none that is stable`;
      let text = head + show(median);
      if (read.low) text += `, ${read.interval} ${read.percent ? show(low) : digits(low)} to ${high === null ? "no bound" : show(high)}`;
      if (read.scale) {
        const k = read.scale.factor;
        text += ` (${digits(k * median)} ${read.scale.unit}${read.low ? `, ${digits(k * low)} to ${high === null ? "no bound" : digits(k * high)}` : ""}`
          + `${read.scale.where ? ` ${read.scale.where}` : ""})`;
      }
      if (read.limit !== undefined) {
        const place = high !== null && high <= read.limit ? "below the limit, all of the interval"
          : low > read.limit ? "above the limit, all of the interval" : median <= read.limit ? "below the limit, not all of the interval" : "above the limit, not all of the interval";
        text += `; ${place}`;
      }
      for (const other of read.also ?? []) {
        if (other.of) {
          const seen = other.values[nearest(x)];
          if (seen !== null) text += `; ${other.symbol}: ${seen} of ${other.of}`;
        } else text += `; ${other.symbol} = ${spaced(digits(at(grid, other.values, x), other.digits), other.unit)}`;
      }
      return text;
    };
    const nearest = (x) => grid.reduce((best, one, i) => (Math.abs(one - x) < Math.abs(grid[best] - x) ? i : best), 0);
    const marks = [chosen, span, mark];
    const refuse = (x) => {
      for (const one of marks) one.setAttribute("visibility", "hidden");
      answer.textContent = `${axis.symbol} = ${digits(x, 4)} lies outside of this plot, ${digits(axis.min, 4)} to ${digits(axis.max, 4)}. ${axis.beyond}`;
    };
    const choose = (x, from) => {
      if (x < axis.min || x > axis.max) { refuse(x); return; }
      axis.start = x;
      chosen.setAttribute("visibility", "visible");
      if (from !== range) range.value = x;
      if (from !== exact) exact.value = Number(x.toPrecision(5));
      const median = at(grid, read.median, x), low = at(grid, read.low, x), high = at(grid, read.high, x);
      for (const end of ["x1", "x2"]) { chosen.setAttribute(end, px(x)); span.setAttribute(end, px(x)); }
      span.setAttribute("visibility", read.low && low !== null ? "visible" : "hidden");
      if (low !== null) { span.setAttribute("y1", py(low)); span.setAttribute("y2", py(far(high))); }
      mark.setAttribute("visibility", median === null ? "hidden" : "visible");
      if (median !== null) { mark.setAttribute("cx", px(x)); mark.setAttribute("cy", py(far(median))); }
      const text = sentence(x);
      range.setAttribute("aria-valuetext", text);
      answer.textContent = text;
    };
    range.addEventListener("input", () => choose(Number(range.value), range));
    exact.addEventListener("input", () => { if (exact.value !== "" && Number.isFinite(Number(exact.value))) choose(Number(exact.value), exact); });

    const where = (event) => {
      const box = svg.getBoundingClientRect();
      const x = axis.min + ((event.clientX - box.left) / box.width * W - LEFT) / (W - LEFT - RIGHT) * (axis.max - axis.min);
      return x < axis.min || x > axis.max ? null : x;
    };
    svg.addEventListener("pointermove", (event) => {
      const x = where(event);
      hair.setAttribute("visibility", x === null ? "hidden" : "visible");
      if (x === null) return;
      for (const end of ["x1", "x2"]) hair.setAttribute(end, px(x));
      under.textContent = `Under the pointer: ${sentence(x)}`;
    });
    svg.addEventListener("pointerleave", () => hair.setAttribute("visibility", "hidden"));
    svg.addEventListener("click", (event) => { const x = where(event); if (x !== null) choose(x); });

    choose(axis.start);
    figure.prepend(tool);
    figure.classList.add("live");
  };

  /* Dampers that are heavier, tuned or damped otherwise: read off a table, linear between its nodes. */
  const dampers = (figure, data) => {
    const { table, sliders, asked } = data;
    const tool = document.createElement("div");
    tool.className = "tool beside";
    const axes = ["mass", "tuning", "damping"].map((key) => table[key].map(Math.log));
    const place = (axis, value) => {
      let i = 1;
      while (i < axis.length - 1 && axis[i] < value) i++;
      return [i - 1, (value - axis[i - 1]) / (axis[i] - axis[i - 1])];
    };
    const between = (values, factors, turn) => {
      const found = axes.map((axis, k) => place(axis, Math.log(factors[k])));
      let sum = 0;
      for (let corner = 0; corner < 8; corner++) {
        const at = found.map(([i], k) => i + (corner >> k & 1));
        const weight = found.reduce((product, [, t], k) => product * (corner >> k & 1 ? t : 1 - t), 1);
        sum += weight * turn(values[at[0]][at[1]][at[2]]);
      }
      return sum;
    };
    const odds = (p) => { const q = Math.min(1 - 1e-4, Math.max(1e-4, p)); return Math.log(q / (1 - q)); };
    make(tool, "p", { class: "key" }, `${data.name}: other masses, tunings and dampings, and a bridge that is off frequency.`);
    const four = make(tool, "div", { class: "four" }), factors = {}, shown = {};
    for (const one of sliders) {
      const id = `${one.key}-${figure.id}`, ends = table[one.key] ?? [one.low, one.high];
      const low = Math.log(one.low ?? ends[0]), high = Math.log(one.high ?? ends.at(-1));
      make(four, "label", { for: id }, one.label);
      shown[one.key] = make(four, "output", { for: id });
      const range = make(four, "input", { type: "range", id, min: low, max: high, step: (high - low) / 400, value: 0 });
      factors[one.key] = 1;
      range.addEventListener("input", () => { factors[one.key] = Math.exp(Number(range.value)); tell(); });
      one.range = range;
    }
    const answer = make(tool, "output", { role: "status", "aria-live": "polite", "aria-atomic": "true" });
    const tell = () => {
      for (const one of sliders) {
        const f = factors[one.key], percent = 100 * (f - 1);
        const text = one.relative ? `${percent < 0 ? "−" : "+"}${Math.abs(percent).toFixed(1)} %`
          : `${digits(one.value * f, 4)} ${one.unit}`.trim();
        shown[one.key].textContent = text;
        one.range.setAttribute("aria-valuetext", text);
      }
      const where = [factors.mass, factors.tuning / factors.detuning, factors.damping];
      const risk = 1 / (1 + Math.exp(-between(table.probability, where, odds)));
      const stroke = Math.exp(between(table.stroke_high, where, Math.log));
      const low = risk < 5e-4;
      answer.textContent = `Risk ${low ? "below 0.05" : digits(100 * risk, 2)} % (${risk <= asked.risk ? "keeps" : "exceeds"} the ${digits(100 * asked.risk)} % asked for); `
        + `stroke ${digits(stroke, 2)} m with 95 % confidence`
        + (asked.stroke ? ` (${stroke <= asked.stroke ? "within" : "beyond"} the largest, ${digits(asked.stroke)} m).` : ".");
    };
    make(tool, "p", { class: "key" }, data.note);
    tell();
    figure.append(tool);
  };

  const drawn = [];
  for (const figure of document.querySelectorAll("figure.chart")) {
    const data = JSON.parse(figure.querySelector("script").textContent);
    if (data.table) dampers(figure, data);
    else { build(figure, data); drawn.push([figure, data]); }
  }
  let before = width();
  window.addEventListener("resize", () => {
    if (width() === before) return;
    before = width();
    for (const [figure, data] of drawn) {
      figure.querySelector(".tool").remove();
      build(figure, data);
    }
  });
})();
