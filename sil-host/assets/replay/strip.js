"use strict";
// Position and tilt error over the flight; a line marks the time of the replay, a click sets it.
class Strip {
  constructor(box, seek) {
    this.flight = null;
    this.now = 0;
    this.head = element("div", { class: "playhead" });
    this.chart = Chart.mount(box, 170, () => this.describe());
    box.addEventListener("click", (event) => {
      const plot = this.chart.plot();
      if (!plot || !plot.over.contains(event.target)) return;
      seek(plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, "x"));
    });
  }

  describe() {
    const { flight } = this;
    const line = (scale, colour) => ({
      scale,
      stroke: Theme.colour(colour),
      width: 1.5,
      points: { show: false },
    });
    const upward = (plot, least, greatest) => [0, greatest > 0 ? 1.05 * greatest : 1];
    const side = { size: 54, labelSize: 20 };
    return {
      data: flight ? [flight.time, flight.error, flight.tilt] : [[], [], []],
      options: {
        scales: { x: { time: false }, m: { range: upward }, deg: { range: upward } },
        axes: [
          Chart.axis("time [s]"),
          Chart.axis("position error [m]", { scale: "m", stroke: Theme.colour("--variant-0"), ...side }),
          Chart.axis("tilt error [deg]", { scale: "deg", side: 1, stroke: Theme.colour("--variant-1"), grid: { show: false }, ...side }),
        ],
        cursor: { drag: { x: false, y: false }, y: false },
        legend: { show: false },
        series: [{}, line("m", "--variant-0"), line("deg", "--variant-1")],
        hooks: {
          ready: [(plot) => plot.over.append(this.head)],
          draw: [(plot) => this.place(plot)],
        },
      },
    };
  }

  place(plot) {
    const { min, max } = plot.scales.x;
    if (min === undefined || min === null || max === min) return;
    this.head.style.left = `${plot.valToPos(this.now, "x")}px`;
  }

  show(flight) {
    this.flight = flight;
    this.chart.draw();
  }

  mark(time) {
    this.now = time;
    const plot = this.chart.plot();
    if (plot) this.place(plot);
  }
}
