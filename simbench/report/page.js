"use strict";

// One chapter after the other, so that the top of the page is ready first.
async function start() {
  for (const chapter of document.querySelectorAll("[data-chapter]")) {
    const data = JSON.parse(chapter.querySelector("[data-chapter-data]").textContent);
    const figures = new Figures(chapter, data);
    const stage = chapter.querySelector("[data-player]");
    const player = stage === null ? null : new Player(stage, data.player, data.colors);
    for (const box of chapter.querySelectorAll("[data-tracker]")) {
      box.checked = true; // browsers remember boxes over a reload, figures do not
      box.addEventListener("change", () => {
        figures.show(box.dataset.tracker, box.checked);
        player?.show(box.dataset.tracker, box.checked);
      });
    }
    const seeds = chapter.querySelector("[data-seed]");
    if (seeds !== null) {
      seeds.selectedIndex = 0;
      seeds.addEventListener("change", () => figures.choose(seeds.value));
    }
    await figures.draw();
  }
  document.documentElement.dataset.ready = "";
}

start();
