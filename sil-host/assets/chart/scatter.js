"use strict";
// One quantity over another, a mark a run: a dot where it held, a cross where it was violated.
const Scatter = (() => {
  const HEIGHT = 420;
  const REACH = 18;

  function marks(plot, report, x, y) {
    const { ctx, bbox } = plot;
    const size = (report.points.seed.length > 600 ? 2 : 3) * devicePixelRatio;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.lineWidth = 1.6 * devicePixelRatio;
    each(plot, report, x, y, true, (index, left, top) => {
      const colour = Theme.colour(`--variant-${report.points.variant[index]}`);
      ctx.globalAlpha = report.points.held[index] ? 0.55 : 1;
      ctx.beginPath();
      if (report.points.held[index]) {
        ctx.fillStyle = colour;
        ctx.arc(left, top, size, 0, 2 * Math.PI);
        ctx.fill();
      } else {
        ctx.strokeStyle = colour;
        const arm = 1.5 * size;
        ctx.moveTo(left - arm, top - arm);
        ctx.lineTo(left + arm, top + arm);
        ctx.moveTo(left - arm, top + arm);
        ctx.lineTo(left + arm, top - arm);
        ctx.stroke();
      }
    });
    ctx.restore();
  }

  // Calls `visit` with index and place of every run that has both values and is shown.
  function each(plot, report, x, y, onCanvas, visit) {
    const { columns, variant } = report.points;
    for (let index = 0; index < variant.length; index++) {
      const [a, b] = [columns[x][index], columns[y][index]];
      if (a === null || b === null || !plot.series[1 + variant[index]].show) continue;
      visit(index, plot.valToPos(a, "x", onCanvas), plot.valToPos(b, "y", onCanvas));
    }
  }

  function nearest(plot, report, x, y, left, top) {
    let best = { index: -1, distance: REACH };
    each(plot, report, x, y, false, (index, a, b) => {
      const distance = Math.hypot(a - left, b - top);
      if (distance < best.distance) best = { index, distance };
    });
    return best.index;
  }

  function describe(report, x, y) {
    const { columns, variant, seed } = report.points;
    const order = seed.map((_, index) => index).filter((index) => columns[x][index] !== null);
    order.sort((a, b) => columns[x][a] - columns[x][b]);
    const [across, up] = [report.quantities[x], report.quantities[y]];
    const scale = ({ lower, upper, logarithmic }) => {
      const room = logarithmic ? Math.pow(upper / lower, 0.03) : 0.03 * (upper - lower);
      const [least, greatest] = logarithmic ? [lower / room, upper * room] : [lower - room, upper + room];
      // The points are rounded; what the reader enlarges is much less than the whole.
      const slack = logarithmic ? Math.pow(upper / lower, 0.01) : 0.01 * (upper - lower);
      const whole = (low, high) =>
        logarithmic ? low <= lower * slack && high >= upper / slack : low <= lower + slack && high >= upper - slack;
      return {
        distr: logarithmic ? 3 : 1,
        range: (plot, low, high) => (whole(low, high) ? [least, greatest] : [low, high]),
      };
    };
    return {
      data: [
        order.map((index) => columns[x][index]),
        ...report.variants.map((_, v) =>
          order.map((index) => (variant[index] === v ? columns[y][index] : null)),
        ),
      ],
      options: {
        scales: { x: { time: false, ...scale(across) }, y: scale(up) },
        axes: [Chart.axis(labelText(across)), Chart.axis(labelText(up), { size: 62 })],
        legend: { live: false },
        cursor: { points: { show: false }, drag: { x: true, y: true } },
        series: [
          {},
          ...report.variants.map((each, index) => ({
            label: each.name,
            stroke: Theme.colour(`--variant-${index}`),
            fill: Theme.colour(`--variant-${index}`),
            paths: () => null,
            points: { show: false },
          })),
        ],
        hooks: {
          draw: [
            (plot) => {
              marks(plot, report, x, y);
              if (up.kind === "margin") Chart.bound(plot, "y", 0, "violated below");
            },
          ],
        },
      },
    };
  }

  function text(report, index, x, y) {
    const { seed, variant, held, columns } = report.points;
    const rows = report.quantities
      .map((quantity, q) => [quantity, columns[q][index], q])
      .filter(([quantity, , q]) => quantity.kind === "varied" || q === x || q === y)
      .map(([quantity, value]) => `${quantity.name} ${numberText(value)} ${quantity.unit}`);
    const result = held[index] ? "held" : "violated";
    const name = report.variants[variant[index]].name;
    return [`seed ${seed[index]}, ${name}: ${result}`, ...rows, "click: copy the command"].join("\n");
  }

  // Fills `section` with a choice of axes and the chart.
  return function (section, report) {
    const entries = (kinds) =>
      report.quantities
        .map((quantity, index) => [index, labelText(quantity), quantity.kind])
        .filter(([, , kind]) => kinds.includes(kind));
    const across = entries(["varied", "measure", "margin"]);
    const up = entries(["margin", "measure"]);
    if (across.length === 0 || up.length === 0) return;
    let [x, y] = [across[0][0], Chart.first(report) < 0 ? up[0][0] : Chart.first(report)];
    const box = element("div", { class: "plot", role: "img", "aria-label": "One mark a run" });
    const chart = Chart.mount(box, HEIGHT, () => describe(report, x, y));
    const at = (event) => {
      const plot = chart.plot();
      if (!plot || !plot.over.contains(event.target)) return -1;
      const { left, top } = plot.over.getBoundingClientRect();
      return nearest(plot, report, x, y, event.clientX - left, event.clientY - top);
    };
    box.addEventListener("pointermove", (event) => {
      const index = at(event);
      box.classList.toggle("pointer", index >= 0);
      if (index < 0) Tooltip.hide();
      else Tooltip.show(text(report, index, x, y), event.clientX, event.clientY);
    });
    box.addEventListener("pointerleave", Tooltip.hide);
    box.addEventListener("click", (event) => {
      const index = at(event);
      if (index < 0) return;
      const { seed, variant } = report.points;
      Command.copy(Command.of(report, variant[index], seed[index]));
    });
    const choose = (set) => (value) => {
      set(Number(value));
      chart.draw();
    };
    section.append(
      element("div", { class: "controls" }, [
        dropDown("Across", across, x, choose((value) => (x = value))),
        dropDown("Up", up, y, choose((value) => (y = value))),
      ]),
      element("div", { class: "card" }, [box]),
      element("p", { class: "muted hint", text: "A dot is a run that held every guarantee, a cross one that violated one. Drag to enlarge, double-click for all." }),
    );
    chart.draw();
  };
})();
