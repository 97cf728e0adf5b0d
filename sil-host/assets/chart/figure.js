"use strict";
// The figures of a flight: panels in a row under a common legend, drawn from the data of the page.
const Figure = (() => {
  // Text with `_{}` for subscripts: as nodes, or plain.
  const parts = (text) => text.split(/_\{(.*?)\}/);
  const nodes = (text) => parts(text).map((part, index) => (index % 2 ? element("sub", { text: part }) : part));
  const plain = (text) => text.replace(/_\{(.*?)\}/g, "_$1");

  // Near black is made for white paper.
  const colour = (style) => (style.colour === "#222222" ? Theme.colour("--text") : style.colour);

  function stroke(plot, { points, style }) {
    const { ctx } = plot;
    ctx.globalAlpha = style.opacity;
    ctx.strokeStyle = colour(style);
    ctx.lineWidth = style.width * devicePixelRatio;
    ctx.setLineDash(style.dashes.split(" ").filter(Boolean).map((dash) => dash * devicePixelRatio));
    ctx.beginPath();
    for (let index = 0; index < points.length; index += 2) {
      const [x, y] = [plot.valToPos(points[index], "x", true), plot.valToPos(points[index + 1], "y", true)];
      ctx.lineTo(x, y);
    }
    ctx.stroke();
  }

  function draw(plot, panel) {
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.lineJoin = "round";
    panel.lines.forEach((line) => stroke(plot, line));
    ctx.globalAlpha = 1;
    ctx.fillStyle = Theme.colour("--text");
    ctx.font = `${12 * devicePixelRatio}px Helvetica, Arial, sans-serif`;
    for (const [[x, y], name] of panel.marks) {
      const [left, top] = [plot.valToPos(x, "x", true), plot.valToPos(y, "y", true)];
      ctx.beginPath();
      ctx.arc(left, top, 3.5 * devicePixelRatio, 0, 2 * Math.PI);
      ctx.fill();
      ctx.textAlign = left > bbox.left + 0.7 * bbox.width ? "right" : "left";
      ctx.fillText(name, left, top + 16 * devicePixelRatio);
    }
    ctx.restore();
    panel.guides.forEach((guide) => Chart.bound(plot, "y", guide.value, plain(guide.label), guide.colour, guide.below));
  }

  // The range of an axis; where a unit is as long on both, the shorter one is extended.
  function range(panel, axis, width, height) {
    const own = panel[axis];
    if (!panel.equal) return [own.lower, own.upper];
    const length = ({ lower, upper }) => upper - lower;
    const unit = Math.max(length(panel.x) / width, length(panel.y) / height);
    const missing = (unit * (axis === "x" ? width : height) - length(own)) / 2;
    return [own.lower - missing, own.upper + missing];
  }

  function describe(panel) {
    const scale = (axis) => ({
      distr: panel[axis].scale === "logarithmic" ? 3 : 1,
      range: (plot, low, high) => {
        const whole = low === panel[axis].lower && high === panel[axis].upper;
        const { width, height } = plot.bbox;
        return whole && width > 0 ? range(panel, axis, width, height) : [low, high];
      },
    });
    return {
      data: [[panel.x.lower, panel.x.upper], [panel.y.lower, panel.y.upper]],
      options: {
        scales: { x: { time: false, ...scale("x") }, y: scale("y") },
        axes: [Chart.axis(plain(panel.x.label)), Chart.axis(plain(panel.y.label), { size: 62 })],
        legend: { show: false },
        cursor: { points: { show: false }, drag: { x: true, y: !panel.equal } },
        series: [{}, { paths: () => null, points: { show: false } }],
        hooks: { draw: [(plot) => draw(plot, panel)] },
      },
    };
  }

  function legend(entries) {
    return entries.map(([style, label]) => {
      const line = element("i", { class: "line" });
      line.style.borderTopColor = style.colour === "#222222" ? "var(--text)" : style.colour;
      line.style.borderTopStyle = style.dashes ? "dashed" : "solid";
      return element("span", {}, [line, ...nodes(label)]);
    });
  }

  // Appends `figure` to `section`.
  return function (section, figure) {
    const boxes = figure.panels.map(([share, panel]) => {
      const box = element("div", { class: "plot", role: "img", "aria-label": `${figure.title}: ${panel.title}` });
      const column = element("div", { class: "panel" }, [element("span", { text: panel.title }), box]);
      column.style.flex = `${share} 1 ${Math.round(200 * share)}px`;
      column.style.minWidth = "0";
      return [column, box, panel];
    });
    section.append(
      element("figure", { class: "card" }, [
        element("figcaption", { text: figure.title }),
        element("div", { class: "key" }, legend(figure.legend)),
        element("div", { class: "panels" }, boxes.map(([column]) => column)),
      ]),
    );
    for (const [, box, panel] of boxes) Chart.mount(box, figure.height + 60, () => describe(panel));
  };
})();
