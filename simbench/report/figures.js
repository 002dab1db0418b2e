"use strict";

// Draws the figures of a chapter and shows or hides a tracker in all of them.
class Figures {
  constructor(chapter, data) {
    this.data = data;
    this.hidden = new Set();
    this.seed = Object.keys(data.by_frame)[0];
    this.plots = [...chapter.querySelectorAll("[data-plot]")];
  }

  async draw() {
    for (const plot of this.plots) {
      await this.redraw(plot);
    }
  }

  figure(name) {
    return this.data.curves[name] ?? this.data.by_frame[this.seed]?.[name] ?? null;
  }

  async redraw(plot) {
    const figure = this.figure(plot.dataset.plot);
    if (figure === null) {
      Plotly.purge(plot);
      plot.textContent = "No tracker used particles on this seed.";
      return;
    }
    if (!plot.classList.contains("js-plotly-plot")) plot.textContent = "";
    const traces = figure.data.map((trace) => ({
      ...trace,
      visible: !this.hidden.has(trace.meta?.tracker),
    }));
    await Plotly.react(plot, traces, structuredClone(figure.layout), {
      displaylogo: false,
      showSendToCloud: false, // results are not uploaded
      plotlyServerURL: "",
      responsive: true,
      modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"],
    });
  }

  show(tracker, visible) {
    if (visible) this.hidden.delete(tracker);
    else this.hidden.add(tracker);
    this.draw();
  }

  choose(seed) {
    this.seed = seed;
    this.draw();
  }
}
