"use strict";
// Share of runs that held, in cells over two varied values.
const HeatMap = (() => {
  const MARGIN = { left: 62, right: 12, top: 8, bottom: 44 };
  const HEIGHT = 340;

  function channels(hex) {
    return [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));
  }

  // Colour of a share: one end, the middle, the other end.
  function colour(share) {
    const [none, half, all] = ["none", "half", "all"].map((name) => channels(Theme.colour(`--share-${name}`)));
    const [from, to, part] = share < 0.5 ? [none, half, 2 * share] : [half, all, 2 * share - 1];
    return `rgb(${from.map((value, i) => Math.round(value + (to[i] - value) * part)).join()})`;
  }

  // Round numbers between two ends, at most about `count`.
  function ticks(lower, upper, count) {
    const raw = (upper - lower) / count;
    const power = Math.pow(10, Math.floor(Math.log10(raw)));
    const step = [1, 2, 5, 10].map((factor) => factor * power).find((each) => each >= raw);
    const found = [];
    for (let tick = Math.ceil(lower / step - 1e-9); tick * step <= upper + 1e-9 * step; tick++) {
      found.push(tick * step);
    }
    return found;
  }

  // Where along an axis of `length` its labels stand: at levels if there are any, else at round numbers.
  function labels(axis, length, spacing) {
    const count = Math.max(2, Math.floor(length / spacing));
    if (axis.levels) {
      const every = Math.ceil(axis.levels.length / count);
      return axis.levels
        .map((level, index) => [level, (index + 0.5) / axis.levels.length, index])
        .filter(([, , index]) => index % every === 0);
    }
    const { lower, upper } = axis;
    return ticks(lower, upper, count).map((tick) => [tick, (tick - lower) / (upper - lower)]);
  }

  // What `axis` spans in one cell.
  function span(axis, index) {
    if (axis.levels) return numberText(axis.levels[index]);
    const width = (axis.upper - axis.lower) / axis.cells;
    const at = (edge) => numberText(axis.lower + edge * width, 3);
    return `${at(index)} to ${at(index + 1)}`;
  }

  function draw(canvas, envelope, variant, selected) {
    const { x, y } = envelope;
    const width = canvas.clientWidth;
    const context = canvas.getContext("2d");
    canvas.width = width * devicePixelRatio;
    canvas.height = HEIGHT * devicePixelRatio;
    context.scale(devicePixelRatio, devicePixelRatio);
    const inner = { width: width - MARGIN.left - MARGIN.right, height: HEIGHT - MARGIN.top - MARGIN.bottom };
    const [cellWidth, cellHeight] = [inner.width / x.cells, inner.height / y.cells];
    const corner = (column, row) => [MARGIN.left + column * cellWidth, MARGIN.top + inner.height - (row + 1) * cellHeight];
    for (let row = 0; row < y.cells; row++) {
      for (let column = 0; column < x.cells; column++) {
        const cell = row * x.cells + column;
        const runs = variant.runs[cell];
        context.fillStyle = runs ? colour(variant.held[cell] / runs) : Theme.colour("--cell-empty");
        const [left, top] = corner(column, row);
        context.fillRect(left + 0.5, top + 0.5, cellWidth - 1, cellHeight - 1);
        if (!runs) {
          context.strokeStyle = Theme.colour("--frame");
          context.beginPath();
          context.moveTo(left + 3, top + cellHeight - 3);
          context.lineTo(left + cellWidth - 3, top + 3);
          context.stroke();
        }
      }
    }
    if (selected >= 0) {
      const [left, top] = corner(selected % x.cells, Math.floor(selected / x.cells));
      context.strokeStyle = Theme.colour("--text");
      context.lineWidth = 2;
      context.strokeRect(left, top, cellWidth, cellHeight);
    }
    context.fillStyle = Theme.colour("--muted");
    context.font = "12px Helvetica, Arial, sans-serif";
    context.textAlign = "center";
    for (const [value, share] of labels(x, inner.width, 60)) {
      context.fillText(numberText(value), MARGIN.left + share * inner.width, HEIGHT - MARGIN.bottom + 16);
    }
    context.textAlign = "right";
    context.textBaseline = "middle";
    for (const [value, share] of labels(y, inner.height, 44)) {
      context.fillText(numberText(value), MARGIN.left - 6, MARGIN.top + (1 - share) * inner.height);
    }
    context.font = "13px Helvetica, Arial, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "alphabetic";
    context.fillText(labelText(x), MARGIN.left + inner.width / 2, HEIGHT - 8, inner.width);
    context.translate(14, MARGIN.top + inner.height / 2);
    context.rotate(-Math.PI / 2);
    context.fillText(labelText(y), 0, 0, inner.height);
  }

  // Index of the cell at a place on the canvas, -1 outside.
  function cellAt(canvas, { x, y }, left, top) {
    const width = canvas.clientWidth - MARGIN.left - MARGIN.right;
    const height = HEIGHT - MARGIN.top - MARGIN.bottom;
    const column = Math.floor(((left - MARGIN.left) / width) * x.cells);
    const row = Math.floor((1 - (top - MARGIN.top) / height) * y.cells);
    const inside = column >= 0 && column < x.cells && row >= 0 && row < y.cells;
    return inside ? row * x.cells + column : -1;
  }

  function text({ x, y }, variant, cell) {
    const place = [
      `${x.name} ${span(x, cell % x.cells)} ${x.unit}`,
      `${y.name} ${span(y, Math.floor(cell / x.cells))} ${y.unit}`,
    ];
    const runs = variant.runs[cell];
    if (!runs) return [...place, "no run"].join("\n");
    const share = numberText((100 * variant.held[cell]) / runs, 3);
    const lines = [...place, `${variant.held[cell]} of ${runs} held (${share} %)`];
    return [...lines, `e.g. seed ${variant.seed[cell]}; click: copy the command`].join("\n");
  }

  function map(envelope, index, report) {
    const variant = envelope.variants[index];
    const name = report.variants[index].name;
    const total = (counts) => counts.reduce((sum, count) => sum + count, 0);
    const canvas = element("canvas", {
      tabindex: "0",
      role: "img",
      style: `display:block;width:100%;height:${HEIGHT}px`,
      "aria-label": `${name}: ${total(variant.held)} of ${total(variant.runs)} runs held; arrow keys move over the cells`,
    });
    const readout = element("p", { class: "muted", "aria-live": "polite", text: "\u00a0" });
    let selected = -1;
    const select = (cell) => {
      selected = cell;
      readout.textContent = cell < 0 ? "\u00a0" : text(envelope, variant, cell).split("\n").slice(0, 3).join(", ");
      draw(canvas, envelope, variant, selected);
    };
    const copy = () => {
      if (selected < 0 || variant.seed[selected] === null) return;
      Command.copy(Command.of(report, index, variant.seed[selected]));
    };
    canvas.addEventListener("pointermove", (event) => {
      const cell = cellAt(canvas, envelope, event.offsetX, event.offsetY);
      if (cell !== selected) select(cell);
      if (cell < 0) Tooltip.hide();
      else Tooltip.show(text(envelope, variant, cell), event.clientX, event.clientY);
    });
    canvas.addEventListener("pointerleave", () => {
      Tooltip.hide();
      select(-1);
    });
    canvas.addEventListener("click", copy);
    canvas.addEventListener("keydown", (event) => {
      const { x, y } = envelope;
      const step = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: x.cells, ArrowDown: -x.cells }[event.key];
      if (event.key === "Enter") copy();
      if (!step) return;
      event.preventDefault();
      const next = selected < 0 ? 0 : selected + step;
      const sameRow = Math.abs(step) > 1 || selected < 0 || Math.floor(next / x.cells) === Math.floor(selected / x.cells);
      if (next >= 0 && next < x.cells * y.cells && sameRow) select(next);
    });
    const redraw = () => canvas.clientWidth > 0 && draw(canvas, envelope, variant, selected);
    new ResizeObserver(redraw).observe(canvas);
    Theme.onChange(redraw);
    return element("div", { class: "card" }, [element("h3", { text: name }), canvas, readout]);
  }

  // Fills `section` with a map a variant.
  return function (section, report) {
    const { envelope } = report;
    section.append(
      element("div", { class: "pair" }, envelope.variants.map((_, index) => map(envelope, index, report))),
    );
    const key = element("p", { class: "key" });
    const ramp = element("span", {}, ["0 %", element("span", { class: "ramp" }), "100 %"]);
    const empty = element("span", {}, [element("i", { class: "empty" }), "no run"]);
    key.append("share of flights that held:", ramp, empty);
    section.append(key);
  };
})();
