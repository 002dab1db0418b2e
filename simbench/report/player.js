"use strict";

// Plays the pictures of a sequence on a canvas with the boxes drawn over them.
class Player {
  constructor(figure, video, colors) {
    this.video = video;
    this.colors = colors;
    this.hidden = new Set();
    this.canvas = figure.querySelector("canvas");
    this.button = figure.querySelector("[data-play]");
    this.scrubber = figure.querySelector("[data-scrub]");
    this.status = figure.querySelector("[data-status]");
    this.images = video.images.map((source) => {
      const image = new Image();
      image.src = source;
      return image;
    });
    this.timer = null;
    this.button.addEventListener("click", () => (this.timer === null ? this.play() : this.pause()));
    this.scrubber.addEventListener("input", () => {
      this.pause();
      this.draw();
    });
    this.canvas.style.aspectRatio = `${video.width} / ${video.height}`;
    new ResizeObserver(() => this.draw()).observe(this.canvas);
  }

  get position() {
    return Number(this.scrubber.value);
  }

  // Real time, but at least 8 pictures per second, so that it looks like a video.
  get intervalMs() {
    const { times } = this.video;
    const real = times.length > 1 ? (1000 * (times.at(-1) - times[0])) / (times.length - 1) : 125;
    return Math.min(Math.max(real, 40), 125);
  }

  play() {
    if (this.position === this.images.length - 1) this.scrubber.value = 0;
    this.timer = setInterval(() => this.advance(), this.intervalMs);
    this.label("Pause");
  }

  pause() {
    clearInterval(this.timer);
    this.timer = null;
    this.label("Play");
  }

  advance() {
    this.scrubber.value = this.position + 1;
    this.draw();
    if (this.position === this.images.length - 1) this.pause();
  }

  label(text) {
    this.button.textContent = text;
    this.button.setAttribute("aria-label", text);
  }

  show(tracker, visible) {
    if (visible) this.hidden.delete(tracker);
    else this.hidden.add(tracker);
    this.draw();
  }

  async draw() {
    const index = this.position;
    const image = this.images[index];
    await image.decode();
    if (index !== this.position) return; // a later picture was requested meanwhile
    const { canvas, video } = this;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    canvas.width = Math.round(canvas.clientWidth * ratio);
    canvas.height = Math.round((canvas.width * video.height) / video.width);
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0, canvas.width, canvas.height);
    const scale = canvas.width / video.width;
    for (const [tracker, boxes] of Object.entries(video.tracks)) {
      if (!this.hidden.has(tracker)) this.box(context, boxes[index], scale, ratio, this.colors[tracker], []);
    }
    if (!this.hidden.has("")) this.box(context, video.truth[index], scale, ratio, "#ffffff", [5 * ratio, 4 * ratio]);
    const time = video.times[index].toFixed(2);
    this.status.textContent = `frame ${video.frames[index]} · ${time} s · ${video.visible[index]}`;
    canvas.dataset.frame = video.frames[index];
  }

  box(context, box, scale, ratio, color, dash) {
    if (box === null) return;
    const [left, top, width, height] = box.map((value) => value * scale);
    context.setLineDash([]);
    context.lineWidth = 3.5 * ratio;
    context.strokeStyle = "rgba(0, 0, 0, 0.45)";
    context.strokeRect(left, top, width, height);
    context.setLineDash(dash);
    context.lineWidth = 2 * ratio;
    context.strokeStyle = color;
    context.strokeRect(left, top, width, height);
  }
}
