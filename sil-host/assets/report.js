"use strict";
// Fills the sections of a campaign's report from the data in the page.
addEventListener("DOMContentLoaded", () => {
  const report = JSON.parse(document.getElementById("data").textContent);
  const section = (name, fill) => {
    const found = document.getElementById(name);
    if (found) fill(found);
  };
  section("distributions", (found) => Distribution(found, report));
  section("scatter", (found) => Scatter(found, report));
  section("envelope", (found) => HeatMap(found, report));
  section("replay", (found) => {
    const flights = report.flights.map(({ name, seed, variant, track }) => ({
      name,
      record: track,
      command: Command.of(report, variant, seed),
    }));
    new Player(found, flights);
  });
});
