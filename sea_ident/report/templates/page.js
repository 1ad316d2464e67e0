"use strict";
(() => {
  const GRID = 10000, NS = "http://www.w3.org/2000/svg";
  const tip = document.querySelector(".tip");
  const charts = [];

  const tickText = (v) => (Math.abs(v) > 1e-12 ? String(+v.toPrecision(6)) : "0").replace("-", "\u2212");
  function niceTicks(low, high, most) {
    let step = (high - low) / Math.max(most, 1);
    const power = Math.pow(10, Math.floor(Math.log10(step)));
    step = [1, 2, 2.5, 5, 10].map((f) => f * power).find((s) => s >= step * 0.999);
    const ticks = [];
    for (let k = Math.ceil(low / step - 1e-9); k <= Math.floor(high / step + 1e-9); k++) ticks.push(k * step);
    return ticks;
  }
  function element(parent, tag, attributes, text) {
    const e = document.createElementNS(NS, tag);
    for (const key in attributes) e.setAttribute(key, attributes[key]);
    if (text !== undefined) e.textContent = text;
    parent.appendChild(e);
    return e;
  }

  class Chart {
    constructor(svg) {
      this.svg = svg;
      this.plot = svg.querySelector("svg.plot");
      this.ticks = svg.querySelector(".ticks");
      this.link = svg.dataset.link;
      this.full = svg.dataset.window.split(" ").map(Number);
      this.window = this.full.slice();
      [this.left, this.top, this.width, this.height] = svg.dataset.frame.split(" ").map(Number);
      this.brush = element(svg, "rect", { class: "brush", y: this.top, height: this.height, width: 0 });
      this.cursor = element(svg, "line", { class: "cursor", y1: this.top, y2: this.top + this.height, visibility: "hidden" });
      this.listen(svg.querySelector(".frame"));
    }
    get lines() {
      if (!this.parsed) {
        const [x0, x1, y0, y1] = this.full;
        this.parsed = [...this.plot.querySelectorAll("path.line")].map((path) => {
          const numbers = (path.getAttribute("d").match(/-?\d+/g) || []).map(Number);
          const x = [], y = [];
          let px = 0, py = 0;
          for (let k = 0; k + 1 < numbers.length; k += 2) {
            px += numbers[k]; py += numbers[k + 1];
            x.push(x0 + (px / GRID) * (x1 - x0)); y.push(y1 - (py / GRID) * (y1 - y0));
          }
          return { label: path.dataset.label, x, y };
        });
      }
      return this.parsed;
    }
    xAt(event) {
      const box = this.svg.getBoundingClientRect();
      const pixel = ((event.clientX - box.left) / box.width) * this.svg.viewBox.baseVal.width;
      return Math.min(Math.max(pixel, this.left), this.left + this.width);
    }
    value(pixel) { return this.window[0] + ((pixel - this.left) / this.width) * (this.window[1] - this.window[0]); }
    listen(frame) {
      let start = null;
      frame.addEventListener("pointerdown", (e) => { start = this.xAt(e); frame.setPointerCapture(e.pointerId); });
      frame.addEventListener("pointermove", (e) => {
        const x = this.xAt(e);
        if (start !== null) {
          this.brush.setAttribute("x", Math.min(start, x));
          this.brush.setAttribute("width", Math.abs(x - start));
        }
        this.show(x, e);
      });
      frame.addEventListener("pointerup", (e) => {
        const x = this.xAt(e), from = start;
        start = null;
        this.brush.setAttribute("width", 0);
        if (from !== null && Math.abs(x - from) > 6) zoom(this, [this.value(Math.min(from, x)), this.value(Math.max(from, x))]);
      });
      frame.addEventListener("pointerleave", () => { tip.style.opacity = 0; this.cursor.setAttribute("visibility", "hidden"); });
      frame.addEventListener("dblclick", () => zoom(this, this.full.slice(0, 2)));
    }
    show(pixel, event) {
      const at = this.value(pixel), rows = [];
      for (const line of this.lines) {
        if (!line.label || !line.x.length) continue;
        let best = 0;
        for (let k = 1; k < line.x.length; k++) if (Math.abs(line.x[k] - at) < Math.abs(line.x[best] - at)) best = k;
        rows.push(`${line.label}  ${line.y[best].toPrecision(4)}`);
      }
      this.cursor.setAttribute("x1", pixel); this.cursor.setAttribute("x2", pixel);
      this.cursor.setAttribute("visibility", "visible");
      if (!rows.length) return;
      tip.textContent = [at.toPrecision(4), ...rows].join("\n");
      tip.style.opacity = 1;
      const right = event.clientX + 16 + tip.offsetWidth > window.innerWidth;
      tip.style.left = (right ? event.clientX - 16 - tip.offsetWidth : event.clientX + 16) + "px";
      tip.style.top = event.clientY + 12 + "px";
    }
    set(range) {
      const [fx0, fx1, fy0, fy1] = this.full;
      let low = Infinity, high = -Infinity;
      for (const line of this.lines)
        line.x.forEach((x, k) => { if (x >= range[0] && x <= range[1]) { low = Math.min(low, line.y[k]); high = Math.max(high, line.y[k]); } });
      const all = range[0] <= fx0 && range[1] >= fx1;
      if (all || !(high > low)) [low, high] = [fy0, fy1];
      else { const pad = 0.06 * (high - low); low = Math.max(low - pad, fy0); high = Math.min(high + pad, fy1); }
      this.window = [range[0], range[1], low, high];
      const sx = GRID / (fx1 - fx0), sy = GRID / (fy1 - fy0);
      this.plot.setAttribute("viewBox", [(range[0] - fx0) * sx, (fy1 - high) * sy, (range[1] - range[0]) * sx, (high - low) * sy].join(" "));
      this.ticks.replaceChildren();
      for (const t of niceTicks(range[0], range[1], Math.max(3, Math.floor(this.width / 80)))) {
        const x = this.left + ((t - range[0]) / (range[1] - range[0])) * this.width;
        element(this.ticks, "line", { x1: x, x2: x, y1: this.top, y2: this.top + this.height });
        element(this.ticks, "text", { class: "tx", x, y: this.top + this.height + 14 }, tickText(t));
      }
      for (const t of niceTicks(low, high, Math.max(4, Math.floor(this.height / 32)))) {
        const y = this.top + ((high - t) / (high - low)) * this.height;
        element(this.ticks, "line", { x1: this.left, x2: this.left + this.width, y1: y, y2: y });
        element(this.ticks, "text", { class: "ty", x: this.left - 6, y: y + 3.5 }, tickText(t));
      }
    }
  }
  function zoom(source, range) {
    for (const chart of charts) if (chart === source || (source.link && chart.link === source.link)) chart.set(range);
  }
  for (const svg of document.querySelectorAll("svg.chart")) charts.push(new Chart(svg));
  for (const svg of document.querySelectorAll("svg.matrix"))
    svg.addEventListener("pointermove", (e) => {
      const text = e.target.dataset && e.target.dataset.tip;
      tip.style.opacity = text ? 1 : 0;
      if (!text) return;
      tip.textContent = text;
      tip.style.left = Math.min(e.clientX + 14, window.innerWidth - tip.offsetWidth - 8) + "px";
      tip.style.top = e.clientY + 12 + "px";
    });
  document.addEventListener("scroll", () => { tip.style.opacity = 0; }, { passive: true });
  // On paper nobody can unfold them.
  window.addEventListener("beforeprint", () => { for (const folded of document.querySelectorAll("details")) folded.open = true; });
})();
