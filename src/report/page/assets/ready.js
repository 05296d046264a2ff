// Marks a page without a three-dimensional view as complete.
document.documentElement.dataset.drawn = String(Math.round(performance.now()));
