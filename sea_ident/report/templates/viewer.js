"use strict";
(() => {
  // A z-buffer on a plain canvas: no graphics driver, no library, the same picture everywhere.
  const holder = document.getElementById("viewer-data");
  if (!holder) return;
  const scene = JSON.parse(holder.textContent);
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const poses = new Float32Array(bytes(scene.poses));
  const parts = scene.parts.map((p) => ({
    body: p.body, color: p.color, points: new Float32Array(bytes(p.vertices)), faces: new Uint16Array(bytes(p.faces)),
  }));
  for (const part of parts) part.screen = new Float32Array(part.points.length), part.world = new Float32Array(part.points.length);

  const root = document.querySelector(".viewer"), canvas = root.querySelector("canvas"), paper = canvas.getContext("2d");
  const layer = document.createElement("canvas"), ink = layer.getContext("2d", { willReadFrequently: true });
  const slider = root.querySelector("input"), button = root.querySelector("button"), clock = root.querySelector(".clock");
  const frames = scene.frames, period = scene.period, stride = scene.bodies * 12;
  let azimuth = scene.azimuth, elevation = 0.16, distance = 2.15, time = 0, playing = false, last = 0, image = null, depth = null;
  const pose = new Float32Array(stride);

  function setPose(t) {
    const at = ((t / period) % 1) * frames, k = Math.floor(at) % frames, next = scene.periodic ? (k + 1) % frames : Math.min(k + 1, frames - 1), w = at - Math.floor(at);
    for (let i = 0; i < stride; i++) pose[i] = poses[k * stride + i] * (1 - w) + poses[next * stride + i] * w;
  }
  function camera(width, height) {
    const ce = Math.cos(elevation), se = Math.sin(elevation), ca = Math.cos(azimuth), sa = Math.sin(azimuth);
    const back = [ce * ca, ce * sa, se], right = [-sa, ca, 0], up = [-se * ca, -se * sa, ce];
    const r = distance * scene.radius, focal = 1.9 * Math.min(width, height) / 2;
    const eye = scene.centre.map((c, i) => c + r * back[i]);
    return (x, y, z, out, o) => {
      const dx = x - eye[0], dy = y - eye[1], dz = z - eye[2];
      const d = -(dx * back[0] + dy * back[1] + dz * back[2]);
      out[o] = width / 2 + (focal * (dx * right[0] + dy * right[1])) / d;
      out[o + 1] = height / 2 - (focal * (dx * up[0] + dy * up[1] + dz * up[2])) / d;
      out[o + 2] = d;
    };
  }
  function floor(project, scale) {
    const p = new Float32Array(3), q = new Float32Array(3), size = scene.radius * 1.5, n = 8;
    paper.strokeStyle = getComputedStyle(document.body).getPropertyValue("--grid");
    paper.lineWidth = scale;
    const line = (a, b) => {
      project(a[0], a[1], scene.floor, p, 0); project(b[0], b[1], scene.floor, q, 0);
      if (p[2] <= 0.05 || q[2] <= 0.05) return;
      paper.beginPath(); paper.moveTo(p[0], p[1]); paper.lineTo(q[0], q[1]); paper.stroke();
    };
    const [cx, cy] = scene.centre;
    for (let k = 0; k <= n; k++) {
      const s = size * ((2 * k) / n - 1);
      line([cx + s, cy - size], [cx + s, cy + size]); line([cx - size, cy + s], [cx + size, cy + s]);
    }
  }
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  // Black parts would vanish on dark paper: colours begin higher there.
  const lifted = (color) => (dark.matches ? color.map((c) => 90 + (c * 165) / 255) : color);
  function fill(part, width, height, project, bias) {
    // The bias settles which of two faces in one plane is seen, always the same way.
    const { points, world, screen, faces } = part, color = lifted(part.color), m = 12 * part.body;
    for (let i = 0; i < points.length; i += 3) {
      const x = points[i], y = points[i + 1], z = points[i + 2];
      if (part.body < 0) { world[i] = x; world[i + 1] = y; world[i + 2] = z; }
      else for (let r = 0; r < 3; r++) world[i + r] = pose[m + 4 * r] * x + pose[m + 4 * r + 1] * y + pose[m + 4 * r + 2] * z + pose[m + 4 * r + 3];
      project(world[i], world[i + 1], world[i + 2], screen, i);
    }
    const light = [0.36 * Math.cos(azimuth + 0.9) , 0.36 * Math.sin(azimuth + 0.9), 0.82], head = [Math.cos(azimuth - 0.4), Math.sin(azimuth - 0.4), 0.2];
    for (let f = 0; f < faces.length; f += 3) {
      const a = 3 * faces[f], b = 3 * faces[f + 1], c = 3 * faces[f + 2];
      if (screen[a + 2] < 0.05 || screen[b + 2] < 0.05 || screen[c + 2] < 0.05) continue;
      const ax = screen[a], ay = screen[a + 1], bx = screen[b], by = screen[b + 1], cx = screen[c], cy = screen[c + 1];
      const area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
      if (Math.abs(area) < 1e-6) continue;
      const ux = world[b] - world[a], uy = world[b + 1] - world[a + 1], uz = world[b + 2] - world[a + 2];
      const vx = world[c] - world[a], vy = world[c + 1] - world[a + 1], vz = world[c + 2] - world[a + 2];
      let nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
      // Seen from the eye the outline runs clockwise or not; turn the normal towards the eye either way.
      const length = (area < 0 ? 1 : -1) * (Math.hypot(nx, ny, nz) || 1);
      nx /= length; ny /= length; nz /= length;
      const shade = 0.34 + 0.42 * Math.max(0, nx * light[0] + ny * light[1] + nz * light[2]) + 0.34 * Math.max(0, nx * head[0] + ny * head[1] + nz * head[2]);
      const value = (255 << 24) | (Math.min(255, color[2] * shade) << 16) | (Math.min(255, color[1] * shade) << 8) | Math.min(255, color[0] * shade);
      const x0 = Math.max(0, Math.floor(Math.min(ax, bx, cx))), x1 = Math.min(width - 1, Math.ceil(Math.max(ax, bx, cx)));
      const y0 = Math.max(0, Math.floor(Math.min(ay, by, cy))), y1 = Math.min(height - 1, Math.ceil(Math.max(ay, by, cy)));
      const za = bias / screen[a + 2], zb = bias / screen[b + 2], zc = bias / screen[c + 2];
      for (let y = y0; y <= y1; y++) {
        const py = y + 0.5;
        for (let x = x0; x <= x1; x++) {
          const px = x + 0.5;
          const wb = ((px - ax) * (cy - ay) - (py - ay) * (cx - ax)) / area;
          const wc = ((bx - ax) * (py - ay) - (by - ay) * (px - ax)) / area;
          if (wb < 0 || wc < 0 || wb + wc > 1) continue;
          const near = za + wb * (zb - za) + wc * (zc - za), k = y * width + x;
          if (near > depth[k]) { depth[k] = near; image.words[k] = value; }
        }
      }
    }
  }
  function draw() {
    const scale = Math.min(2, (window.devicePixelRatio || 1) * 1.5);
    const width = Math.max(1, Math.round(canvas.clientWidth * scale)), height = Math.max(1, Math.round(canvas.clientHeight * scale));
    if (canvas.width !== width || canvas.height !== height || !image) {
      canvas.width = layer.width = width; canvas.height = layer.height = height;
      image = ink.createImageData(width, height);
      image.words = new Uint32Array(image.data.buffer);
      depth = new Float32Array(width * height);
    }
    setPose(time);
    const project = camera(width, height);
    paper.clearRect(0, 0, width, height);
    floor(project, scale);
    image.words.fill(0); depth.fill(0);
    parts.forEach((part, k) => fill(part, width, height, project, 1 + 2e-4 * k));
    ink.putImageData(image, 0, 0);
    paper.drawImage(layer, 0, 0);
    slider.value = String((time / period) * 1000);
    clock.textContent = `${time.toFixed(2)} s`;
  }
  function step(now) {
    if (!playing) return;
    if (last) time = (time + Math.min(0.1, (now - last) / 1000)) % period;
    last = now;
    draw();
    requestAnimationFrame(step);
  }
  function play(on) {
    if (on === playing) return;
    playing = on; last = 0;
    button.textContent = on ? "Pause" : "Play";
    if (on) requestAnimationFrame(step);
  }
  button.addEventListener("click", () => play(!playing));
  slider.addEventListener("input", () => { play(false); time = (period * slider.value) / 1000; draw(); });
  let grip = null;
  canvas.addEventListener("pointerdown", (e) => { grip = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); canvas.focus(); });
  canvas.addEventListener("pointermove", (e) => {
    if (!grip) return;
    azimuth -= (e.clientX - grip[0]) * 0.008;
    elevation = Math.min(1.5, Math.max(-0.5, elevation + (e.clientY - grip[1]) * 0.008));
    grip = [e.clientX, e.clientY];
    if (!playing) draw();
  });
  canvas.addEventListener("pointerup", () => { grip = null; });
  canvas.addEventListener("wheel", (e) => {
    if (document.activeElement !== canvas) return;
    e.preventDefault();
    distance = Math.min(12, Math.max(1.2, distance * Math.exp(e.deltaY * 0.001)));
    if (!playing) draw();
  }, { passive: false });
  new ResizeObserver(() => { if (!playing) draw(); }).observe(canvas);
  draw();
  const still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
  if (!still) new IntersectionObserver((seen, observer) => { if (seen[0].isIntersecting) { play(true); observer.disconnect(); } }, { threshold: 0.4 }).observe(canvas);
})();
