// Live views: sliders over what a cell has computed (tmalib.judging.live). Without this script one sentence
// stands in the place of each. Nothing is loaded: the view is JSON inside the page, the drawing SVG.
(() => {
  const WIDTH = 360, HEIGHT = 300, LEFT = 50, RIGHT = 12, TOP = 10, BOTTOM = 42;

  const build = (element, attributes, children) => {
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.append(...children);
    return element;
  };
  const make = (tag, attributes, ...children) => build(document.createElement(tag), attributes, children);
  const draw = (tag, attributes, ...children) =>
    build(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, children);

  // -- marks: not told apart by colour alone
  const markAt = {
    circle: (x, y) => `M${x - 2.6} ${y}a2.6 2.6 0 1 0 5.2 0a2.6 2.6 0 1 0 -5.2 0z`,
    square: (x, y) => `M${x - 2.8} ${y - 2.8}h5.6v5.6h-5.6z`,
    ring: (x, y) => `M${x - 5} ${y}a5 5 0 1 0 10 0a5 5 0 1 0 -10 0z`,
    cross: (x, y) => `M${x - 4} ${y - 4}l8 8m0 -8l-8 8`,
  };
  const pathOf = (mark, [xs, ys], across, up) => {
    let pen = "M", path = "";
    xs.forEach((x, k) => {
      if (x === null || ys[k] === null) { pen = "M"; return; }
      const [px, py] = [across(x), up(ys[k])].map((p) => Math.round(10 * p) / 10);
      path += markAt[mark] ? markAt[mark](px, py) : `${pen}${px} ${py}`;
      pen = "L";
    });
    return path;
  };
  const look = (curve) => ({ class: `live-${curve.mark}`, style: `color: ${curve.colour ?? "inherit"}` });

  // -- axes
  const scaleOf = (axis, [low, high], from, to) => {
    const value = axis.log ? Math.log10 : (v) => v;
    return (v) => from + ((value(v) - value(low)) / (value(high) - value(low))) * (to - from);
  };
  const ticksOf = (axis, [low, high]) => {
    if (axis.ticks.length) return axis.ticks;
    const rough = (high - low) / 5, power = 10 ** Math.floor(Math.log10(rough));
    const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
    const count = Math.floor(high / step + 1e-9) - Math.ceil(low / step - 1e-9) + 1;
    return Array.from({ length: count }, (_, k) => (Math.ceil(low / step - 1e-9) + k) * step)
      .map((v) => [v, String(Number(v.toPrecision(6))).replace("-", "−")]);
  };
  const limitsOf = ({ x, y, equal }) => {
    const limits = [x.limits, y.limits];
    if (!equal) return limits;
    const room = [WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM];
    const scale = Math.max(...limits.map(([low, high], k) => (high - low) / room[k]));
    return limits.map(([low, high], k) => [-1, 1].map((side) => (low + high + side * scale * room[k]) / 2));
  };

  const panelOf = (panel) => {
    const [xs, ys] = limitsOf(panel);
    const right = WIDTH - RIGHT, bottom = HEIGHT - BOTTOM;
    const across = scaleOf(panel.x, xs, 0, right - LEFT), up = scaleOf(panel.y, ys, bottom - TOP, 0);
    const grid = [], labels = [];
    for (const [value, text] of ticksOf(panel.x, xs)) {
      grid.push(draw("path", { class: "live-grid", d: `M${across(value)} 0V${bottom - TOP}` }));
      labels.push(draw("text", { x: LEFT + across(value), y: bottom + 16, "text-anchor": "middle" }, text));
    }
    for (const [value, text] of ticksOf(panel.y, ys)) {
      grid.push(draw("path", { class: "live-grid", d: `M0 ${up(value)}H${right - LEFT}` }));
      labels.push(draw("text", { x: LEFT - 6, y: TOP + up(value) + 4, "text-anchor": "end" }, text));
    }
    labels.push(
      draw("text", { x: (LEFT + right) / 2, y: HEIGHT - 8, "text-anchor": "middle" }, panel.x.label),
      draw("text", { transform: `translate(13 ${(TOP + bottom) / 2}) rotate(-90)`, "text-anchor": "middle" }, panel.y.label),
    );
    const paths = panel.curves.map((curve) => draw("path", { ...look(curve), "data-curve": curve.label }));
    const area = draw("svg", { x: LEFT, y: TOP, width: right - LEFT, height: bottom - TOP, overflow: "hidden" }, ...grid, ...paths);
    const frame = draw("path", { class: "live-frame", d: `M${LEFT} ${TOP}V${bottom}H${right}` });
    const svg = draw("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": panel.alt }, area, frame, ...labels);
    const show = (points) => paths.forEach((path, k) => path.setAttribute("d", pathOf(panel.curves[k].mark, points[k], across, up)));
    return { svg, show };
  };
  const keyOf = (curve) => {
    const sample = markAt[curve.mark] ? markAt[curve.mark](11, 7) : "M1 7H21";
    return make("li", {}, draw("svg", { viewBox: "0 0 22 14", width: 22, height: 14, "aria-hidden": "true" }, draw("path", { ...look(curve), d: sample })), curve.label);
  };

  // -- views that compute: from the values of the sliders to points by label, and a sentence
  const radians = Math.PI / 180;
  const residualsOf = (sensor, [x, y, vx, vy]) => sensor.bearing.map((measured, k) => {
    if (measured === null) return null;
    const s = sensor.elapsed[k];
    let dx = x + s * vx - sensor.x[k], dy = y + s * vy - sensor.y[k];
    if (sensor.c !== null) { // what is heard was emitted tau seconds before
      const radial = vx * dx + vy * dy, slack = sensor.c ** 2 - vx ** 2 - vy ** 2;
      const tau = (Math.sqrt(radial ** 2 + slack * (dx ** 2 + dy ** 2)) - radial) / slack;
      dx -= tau * vx;
      dy -= tau * vy;
    }
    const off = measured - Math.atan2(dx, dy) / radians;
    return (off - 360 * Math.round(off / 360)) / sensor.sigma[k];
  });
  const views = {
    bearings: ({ sensors, here, criterion, freedom, edge }, [range, course, speed, bearing]) => {
      const [a, b] = [bearing * radians, course * radians];
      const state = [here[0] + range * Math.sin(a), here[1] + range * Math.cos(a), speed * Math.sin(b), speed * Math.cos(b)];
      const residuals = sensors.map((sensor) => residualsOf(sensor, state));
      const all = residuals.flat().filter((r) => r !== null);
      const squares = all.reduce((sum, r) => sum + r * r, 0);
      const outside = all.filter((r) => Math.abs(r) > 2).length, beyond = all.filter((r) => Math.abs(r) > edge).length;
      const first = Math.min(...sensors.flatMap((sensor) => sensor.elapsed));
      const [x, y, vx, vy] = state.map((part) => part / 1e3);
      const points = { solution: [[x + first * vx, x], [y + first * vy, y]], "solution at the last bearing": [[x], [y]] };
      sensors.forEach((sensor, k) => {
        points[sensor.name] = [sensor.minutes, residuals[k].map((r) => (r === null ? null : Math.max(-edge, Math.min(edge, r))))];
      });
      const at = beyond ? `, ${beyond} of them beyond ${edge} and drawn at the edge` : "";
      const says = `Criterion ${squares.toFixed(1)}; at the fit ${criterion.toFixed(1)}, for ${freedom} degrees of freedom. `
        + `${outside} of ${all.length} residuals are beyond two standard deviations${at}.`;
      return { points, says, residuals, squares };
    },
  };

  // -- a view on its page
  document.querySelectorAll("div.live").forEach((root, number) => {
    const { sliders, panels, says, buttons, data } = JSON.parse(root.querySelector("script").textContent);
    const values = sliders.map((slider) => slider.values[slider.start]);
    const pick = ({ by, of }, index) => of[by.reduce((k, s) => k * sliders[s].values.length + index[s], 0)];
    const inputs = sliders.map((slider, k) => make("input", {
      type: "range", id: `live-${number}-${k}`, min: 0, max: slider.values.length - 1, step: 1, value: slider.start,
    }));
    const read = sliders.map((_, k) => make("output", { for: `live-${number}-${k}`, "aria-live": "off" })); // the slider says it
    const shown = panels.map(panelOf);
    const sentence = make("output", { class: "live-says", for: inputs.map((input) => input.id).join(" ") });

    const update = () => {
      const index = inputs.map((input) => Number(input.value));
      const computed = views[root.dataset.live]?.(data, values) ?? { points: {}, says: pick(says, index) };
      panels.forEach((panel, k) => shown[k].show(panel.curves.map((c) => (c.frames ? pick(c.frames, index) : computed.points[c.label]))));
      sliders.forEach(({ digits, unit }, k) => {
        const text = `${values[k].toFixed(digits)}${unit === "°" ? "" : " "}${unit}`;
        read[k].textContent = text;
        inputs[k].setAttribute("aria-valuetext", text);
      });
      sentence.textContent = computed.says;
    };
    const nearest = (all, value) => all.reduce((best, v, k) => (Math.abs(v - value) < Math.abs(all[best] - value) ? k : best), 0);
    inputs.forEach((input, k) => input.addEventListener("input", () => {
      values[k] = sliders[k].values[input.value];
      update();
    }));
    const set = (wanted) => wanted.forEach((value, k) => {
      values[k] = value; // exactly, also between two values of the slider
      inputs[k].value = nearest(sliders[k].values, value);
    });
    const pressed = buttons.map(([label, wanted]) => make("button", { type: "button" }, label));
    pressed.forEach((button, k) => button.addEventListener("click", () => { set(buttons[k][1]); update(); }));

    const rows = sliders.map((slider, k) => make("div", {}, make("label", { for: inputs[k].id }, slider.label), inputs[k], read[k]));
    root.querySelector(".live-instead").remove();
    root.append(
      make("div", { class: "live-sliders" }, ...rows), make("p", { class: "live-buttons" }, ...pressed), sentence,
      make("div", { class: "live-panels" }, ...panels.map((panel, k) => make("div", {}, shown[k].svg, make("ul", {}, ...panel.curves.filter((curve) => curve.label).map(keyOf))))),
    );
    root.compute = (wanted) => views[root.dataset.live](data, wanted); // for the tests
    update();
  });
})();
