// Sorts the tables by a click on a column, and draws the maps when they come into view.
(() => {
  for (const head of document.querySelectorAll(".runs thead th")) {
    head.addEventListener("click", () => {
      const column = head.cellIndex, body = head.closest("table").tBodies[0];
      const down = head.dataset.down !== "yes";
      head.dataset.down = down ? "yes" : "no";
      const value = (row) => {
        const cell = row.cells[column];
        return cell.dataset.sort === undefined ? cell.textContent : Number(cell.dataset.sort);
      };
      const order = (a, b) => (typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b)));
      const rows = [...body.rows].sort((a, b) => order(value(a), value(b)) * (down ? -1 : 1));
      body.append(...rows);
    });
  }
  const data = JSON.parse(document.getElementById("maps-data").textContent);
  const mix = (from, to, t) => from.map((v, i) => Math.round(v + (to[i] - v) * t));
  const colour = (value) => {
    const t = Math.max(-1, Math.min(1, value / data.limit));
    const end = t < 0 ? [33, 102, 172] : [178, 24, 43];
    return `rgb(${mix([247, 247, 247], end, Math.abs(t)).join(",")})`;
  };
  const draw = (canvas) => {
    const map = data.maps[Number(canvas.dataset.map)];
    const rows = map.length, columns = map[0].length, scale = window.devicePixelRatio || 1;
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * scale));
    canvas.height = Math.max(1, Math.round(canvas.clientHeight * scale));
    const ink = canvas.getContext("2d"), w = canvas.width / columns, h = canvas.height / rows;
    map.forEach((row, i) => row.forEach((value, j) => {
      if (value === null) return;
      ink.fillStyle = colour(value);
      ink.fillRect(j * w, canvas.height - (i + 1) * h, w + 1, h + 1);
    }));
  };
  const seen = new IntersectionObserver((entries) => entries.forEach((entry) => {
    if (entry.isIntersecting) { draw(entry.target); seen.unobserve(entry.target); }
  }), { rootMargin: "400px" });
  const maps = document.querySelectorAll("canvas[data-map]");
  maps.forEach((canvas) => seen.observe(canvas));
  window.addEventListener("beforeprint", () => maps.forEach(draw));
})();
