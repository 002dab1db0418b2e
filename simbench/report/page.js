"use strict";

// Chapters are drawn in order, so that the top of the page is ready first.
async function start() {
  for (const chapter of document.querySelectorAll("[data-chapter]")) {
    const data = JSON.parse(chapter.querySelector("[data-chapter-data]").textContent);
    const figures = new Figures(chapter, data);
    const figure = chapter.querySelector("[data-player]");
    const player = figure === null ? null : new Player(figure, data.player, data.colors);
    for (const box of chapter.querySelectorAll("[data-tracker]")) {
      box.checked = true; // browsers keep the state of check boxes over a reload
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
