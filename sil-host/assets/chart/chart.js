"use strict";
// uPlot charts that keep the width of their box and the colours of the theme.
const Chart = (() => {
  function axis(label, options = {}) {
    return {
      label,
      labelSize: 20,
      labelGap: 2,
      gap: 4,
      size: 30,
      labelFont: "13px Helvetica, Arial, sans-serif",
      font: "12px Helvetica, Arial, sans-serif",
      stroke: Theme.colour("--muted"),
      grid: { stroke: Theme.colour("--grid"), width: 1 },
      ticks: { stroke: Theme.colour("--grid"), width: 1 },
      values: (plot, ticks) => ticks.map((tick) => (tick === null ? "" : numberText(tick))),
      ...options,
    };
  }

  // Draws in `box` what `describe` returns, `{ options, data }`, again at every change of theme.
  // Returns a function that draws anew, and one that returns the plot.
  function mount(box, height, describe) {
    let plot = null;
    function draw() {
      const width = box.clientWidth;
      if (plot) plot.destroy();
      plot = null;
      if (width === 0) return;
      const { options, data } = describe();
      plot = new uPlot({ width, height, ...options }, data, box);
    }
    const observer = new ResizeObserver(() => {
      if (!plot) draw();
      else if (plot.width !== box.clientWidth) plot.setSize({ width: box.clientWidth, height });
    });
    observer.observe(box);
    Theme.onChange(draw);
    draw();
    return { draw, plot: () => plot };
  }

  // A dashed line across the plot at `value` of the scale, named above the line or `below` it.
  function bound(plot, scale, value, name, colour = Theme.colour("--violated"), below = false) {
    const { ctx, bbox } = plot;
    const { min, max } = plot.scales[scale];
    if (!(value >= min && value <= max)) return;
    const at = plot.valToPos(value, scale, true);
    const across = scale === "y";
    ctx.save();
    ctx.strokeStyle = ctx.fillStyle = colour;
    ctx.lineWidth = devicePixelRatio;
    ctx.setLineDash([6 * devicePixelRatio, 4 * devicePixelRatio]);
    ctx.beginPath();
    ctx.moveTo(across ? bbox.left : at, across ? at : bbox.top);
    ctx.lineTo(across ? bbox.left + bbox.width : at, across ? at : bbox.top + bbox.height);
    ctx.stroke();
    ctx.font = `${12 * devicePixelRatio}px Helvetica, Arial, sans-serif`;
    const gap = 4 * devicePixelRatio;
    ctx.setLineDash([]);
    ctx.lineWidth = 4 * devicePixelRatio;
    ctx.strokeStyle = Theme.colour("--card");
    const under = below || at < bbox.top + 15 * devicePixelRatio ? at + 14 * devicePixelRatio : at - gap;
    const [x, y] = across ? [bbox.left + bbox.width - gap, under] : [at, bbox.top + 14 * devicePixelRatio];
    const left = !across && at - bbox.left < bbox.width / 2;
    ctx.textAlign = left ? "left" : "right";
    const place = [name, across ? x : x + (left ? gap : -gap), y];
    ctx.strokeText(...place);
    ctx.fillText(...place);
    ctx.restore();
  }

  // The quantity that charts begin with: a margin that was violated, if there is one.
  function first(report) {
    const margins = report.quantities.filter(({ kind, counts }) => kind === "margin" && counts.length > 0);
    const shown = margins.find(({ lower }) => lower < 0) || margins[0];
    return report.quantities.indexOf(shown);
  }

  return { axis, mount, bound, first };
})();
