"use strict";
// Plays recorded flights: choice, time, speed, view.
const Player = (() => {
  const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 20, 50];
  const SECONDS = 25;

  // The speed at which a flight takes about `SECONDS`.
  function fitting(duration) {
    return SPEEDS.reduce((best, speed) =>
      Math.abs(Math.log((duration / speed) / SECONDS)) < Math.abs(Math.log(duration / best / SECONDS)) ? speed : best,
    );
  }

  class Player {
    // `flights` are `{ name, record, command }`; the command may be missing.
    constructor(section, flights) {
      this.flights = flights;
      this.camera = new Camera();
      this.follow = true;
      this.time = 0;
      this.playing = false;
      this.build(section);
      orbitByHand(this.canvas, this.camera, () => this.draw());
      this.canvas.addEventListener("keydown", (event) => {
        if (event.key !== " ") return;
        event.preventDefault();
        this.toggle();
      });
      new ResizeObserver(() => this.draw()).observe(this.canvas);
      Theme.onChange(() => this.draw());
      this.load(0);
    }

    build(section) {
      const listed = (entries, label, value, changed) => dropDown(label, entries, value, changed);
      this.canvas = element("canvas", { tabindex: "0", role: "img", "aria-label": "Flight in three dimensions; arrow keys turn the view, plus and minus zoom, space plays" });
      this.button = element("button", { text: "Play", onclick: () => this.toggle() });
      const restart = element("button", { text: "Restart", onclick: () => this.seek(0) });
      this.slider = element("input", { type: "range", min: "0", max: "1000", value: "0", step: "any", "aria-label": "Time of the flight" });
      this.slider.addEventListener("input", () => this.seek((this.slider.value / 1000) * this.flight.duration));
      this.clock = element("output");
      this.speedLabel = listed(SPEEDS.map((speed) => [speed, `${speed} ×`]), "Speed", 1, (value) => (this.speed = Number(value)));
      const view = listed([["vehicle", "follow the vehicle"], ["flight", "whole flight"]], "View", "vehicle", (value) => this.view(value));
      const choice = listed(this.flights.map(({ name }, index) => [index, name]), "Flight", 0, (value) => this.load(Number(value)));
      this.copy = element("button", { text: "Copy its command", onclick: () => Command.copy(this.command) });
      this.readout = element("p", { class: "muted" });
      const strip = element("div", { class: "strip plot" });
      section.append(
        element("div", { class: "controls" }, [choice, this.copy]),
        element("div", { class: "card replay" }, [
          this.canvas,
          element("div", { class: "controls" }, [this.button, restart, this.slider, this.clock]),
          element("div", { class: "controls" }, [this.speedLabel, view]),
          this.readout,
          strip,
        ]),
        element("p", { class: "muted hint", text: "Drag to turn, pinch or scroll to zoom (click the picture first), click the chart to go to a time. The vehicle is drawn larger than it is." }),
      );
      this.strip = new Strip(strip, (time) => this.seek(time));
    }

    load(index) {
      const { record, command } = this.flights[index];
      this.flight = new RecordedFlight(record);
      this.command = command;
      this.copy.hidden = !command;
      this.speed = fitting(this.flight.duration);
      this.speedLabel.querySelector("select").value = this.speed;
      this.ground = Math.min(...record.position[2], ...record.reference[2]);
      this.strip.show(this.flight);
      this.frameView();
      this.seek(0);
    }

    view(name) {
      this.follow = name === "vehicle";
      this.frameView();
      this.draw();
    }

    // A distance from which the start, or everything, can be seen.
    frameView() {
      const { centre, radius } = this.flight.ball();
      if (this.follow) this.camera.distance = Math.max(5, Math.min(3 * this.flight.error[0], 40));
      else {
        this.camera.target = centre;
        this.camera.distance = 2.2 * radius;
      }
    }

    toggle() {
      this.playing = !this.playing;
      this.button.textContent = this.playing ? "Pause" : "Play";
      if (!this.playing) return;
      if (this.time >= this.flight.duration) this.seek(0);
      let before = performance.now();
      const step = (now) => {
        if (!this.playing) return;
        this.seek(this.time + ((now - before) / 1000) * this.speed);
        before = now;
        if (this.time >= this.flight.duration) this.toggle();
        else requestAnimationFrame(step);
      };
      requestAnimationFrame(step);
    }

    seek(time) {
      this.time = Math.max(0, Math.min(time, this.flight.duration));
      this.draw();
    }

    draw() {
      const { canvas, flight } = this;
      if (!flight) return;
      const now = flight.at(this.time);
      this.slider.value = (1000 * this.time) / (flight.duration || 1);
      this.clock.textContent = `${this.time.toFixed(2)} of ${numberText(flight.duration)} s`;
      this.readout.textContent = `position error ${numberText(now.error, 3)} m, tilt error ${numberText(now.tilt, 3)} deg, thrust ${numberText(now.thrust, 3)} N`;
      this.strip.mark(this.time);
      const [width, height] = [canvas.clientWidth, canvas.clientHeight];
      if (width === 0) return;
      const pixels = [width, height].map((length) => Math.round(length * devicePixelRatio));
      if (canvas.width !== pixels[0] || canvas.height !== pixels[1]) [canvas.width, canvas.height] = pixels;
      const context = canvas.getContext("2d");
      context.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
      if (this.follow) this.camera.target = now.position;
      Scene(context, this.camera, flight, now, this.ground, width, height);
    }
  }
  return Player;
})();
