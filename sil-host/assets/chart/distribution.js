"use strict";
// Histogram and cumulative share of one quantity, a line a variant.
const Distribution = (() => {
  const HEIGHT = 290;

  // Edges of `cells` equal cells, equal in the logarithm where the quantity is so counted.
  function edges(quantity, cells) {
    const { lower, upper, logarithmic } = quantity;
    const at = (share) =>
      logarithmic ? lower * Math.pow(upper / lower, share) : lower + (upper - lower) * share;
    return Array.from({ length: cells + 1 }, (_, index) => at(index / cells));
  }

  // Joins neighbouring bins so that about the square root of the number of runs stays in each.
  function joined(counts) {
    const runs = counts.reduce((sum, count) => sum + count, 0);
    let cells = 64;
    while (cells > 8 && cells * cells > 3 * runs) cells /= 2;
    return Math.min(cells, counts.length);
  }

  function histogram(quantity, cells) {
    return quantity.counts.map((counts) => {
      const size = counts.length / cells;
      const total = Math.max(1, counts.reduce((sum, count) => sum + count, 0));
      const shares = Array.from({ length: cells }, (_, cell) => {
        const part = counts.slice(cell * size, (cell + 1) * size);
        return (100 * part.reduce((sum, count) => sum + count, 0)) / total;
      });
      return [...shares, 0];
    });
  }

  function cumulative(quantity) {
    return quantity.counts.map((counts) => {
      const total = Math.max(1, counts.reduce((sum, count) => sum + count, 0));
      let sum = 0;
      return [0, ...counts.map((count) => (100 * (sum += count)) / total)];
    });
  }

  function options(quantity, variants, label, paths, filled) {
    const series = variants.map((variant, index) => {
      const stroke = Theme.colour(`--variant-${index}`);
      return {
        label: variant.name,
        stroke,
        fill: filled ? `${stroke}33` : undefined,
        width: 1.5,
        paths,
        points: { show: false },
        value: (plot, value) => (value === null ? "–" : `${numberText(value, 3)} %`),
      };
    });
    const name = labelText(quantity);
    return {
      scales: {
        x: { time: false, distr: quantity.logarithmic ? 3 : 1 },
        y: { range: (plot, least, greatest) => [0, filled ? Math.max(greatest * 1.05, 1) : 100] },
      },
      axes: [Chart.axis(name), Chart.axis(label, { size: 52 })],
      series: [{ label: quantity.name, value: (plot, value) => numberText(value) }, ...series],
      hooks: {
        draw: [(plot) => quantity.kind === "margin" && Chart.bound(plot, "x", 0, "bound")],
      },
    };
  }

  function chart(box, quantity, variants, bars) {
    const cells = joined(quantity.counts[0]);
    const paths = bars ? uPlot.paths.stepped({ align: 1 }) : uPlot.paths.linear();
    const label = bars ? "share of runs [%]" : "share at or below [%]";
    const data = bars
      ? [edges(quantity, cells), ...histogram(quantity, cells)]
      : [edges(quantity, quantity.counts[0].length), ...cumulative(quantity)];
    return { options: options(quantity, variants, label, paths, bars), data };
  }

  // Fills `section` with a choice of quantity and its two charts.
  return function (section, report) {
    const groups = { margin: "margin to a bound", measure: "measure", varied: "varied" };
    const shown = report.quantities
      .map((quantity, index) => [index, labelText(quantity), groups[quantity.kind]])
      .filter(([index]) => report.quantities[index].counts.length > 0)
      .sort((a, b) => Object.values(groups).indexOf(a[2]) - Object.values(groups).indexOf(b[2]));
    if (shown.length === 0) return;
    const first = Chart.first(report) < 0 ? shown[0][0] : Chart.first(report);
    let quantity = report.quantities[first];
    const boxes = ["Histogram", "Cumulative share"].map((title) => {
      const plot = element("div", { class: "plot", role: "img" });
      return { title, plot, card: element("div", { class: "card" }, [element("h3", { text: title }), plot]) };
    });
    const note = element("p", { class: "muted" });
    const charts = boxes.map(({ plot }, index) =>
      Chart.mount(plot, HEIGHT, () => chart(plot, quantity, report.variants, index === 0)),
    );
    function show(index) {
      quantity = report.quantities[index];
      boxes.forEach(({ title, plot }) => plot.setAttribute("aria-label", `${title} of ${quantity.name}`));
      const lacking = report.variants.map((variant, i) => [variant.name, quantity.missing[i]]);
      const none = lacking.filter(([, count]) => count > 0);
      note.textContent = none.length
        ? `No value: ${none.map(([name, count]) => `${count} runs of ${name}`).join(", ")}.`
        : "";
      charts.forEach((each) => each.draw());
    }
    const choice = dropDown("Quantity", shown, first, (value) => show(Number(value)));
    section.append(
      element("div", { class: "controls" }, [choice]),
      element("div", { class: "pair" }, boxes.map(({ card }) => card)),
      note,
    );
    show(first);
  };
})();
