// The 3D view of the report, WebGL 2, no libraries. Faces come as 10-byte records, see scene.py.
"use strict";
(() => {
  const data = JSON.parse(document.getElementById("scene-data").textContent);
  const canvas = document.getElementById("scene");
  const gl = canvas.getContext("webgl2", { alpha: false, antialias: true, preserveDrawingBuffer: true });
  const note = document.getElementById("scene-note");
  if (!gl) {
    note.textContent = "This browser has no WebGL 2; the pictures above show the map.";
    return;
  }
  // axis of the normal, sign, axis along which a face is long, brightness; as DIRECTIONS in voxels.py, axes x y z
  const DIRECTIONS = [[0, 0, 1, 0.8], [0, 1, 1, 0.86], [1, 0, 0, 0.7], [1, 1, 0, 0.74], [2, 0, 0, 0.6], [2, 1, 0, 1.0]];
  const CORNERS = [[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]];
  const size = Math.hypot(...data.high.map((high, k) => high - data.low[k]));
  const ZOOM = 1.9;  // focal length over half the height of the picture
  const home = allInside(-2.4, 0.8);
  const camera = { ...home, focus: [...home.focus] };
  let lastView = 255;
  let top = data.high[2];

  function axes({ yaw, pitch }) {
    const [cy, sy, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
    return { back: [cy * cp, sy * cp, sp], right: [-sy, cy, 0], up: [-cy * sp, -sy * sp, cp] };
  }

  function allInside(yaw, pitch) {  // the nearest camera that sees all corners of the volume; see framing.py
    const { back, right, up } = axes({ yaw, pitch }), aspect = canvas.clientWidth / Math.max(canvas.clientHeight, 1);
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const corners = box(data.low, data.high), depths = corners.map((corner) => dot(back, corner));
    const depth = (Math.min(...depths) + Math.max(...depths)) / 2;
    const [across, upwards] = [[right, (0.96 * aspect) / ZOOM], [up, 0.96 / ZOOM]].map(([axis, half]) => {
      const [high, low] = [1, -1].map((sign) => Math.max(...corners.map((c, k) => sign * dot(axis, c) + half * depths[k])));
      return { place: (high - low) / 2, depth: (high + low) / (2 * half) };
    });
    const focus = [0, 1, 2].map((k) => right[k] * across.place + up[k] * upwards.place + back[k] * depth);
    return { yaw, pitch, distance: Math.max(across.depth, upwards.depth) - depth, focus };
  }

  function program(vertex, fragment) {
    const out = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, "#version 300 es\nprecision highp float;\n" + text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(out, shader);
    }
    gl.linkProgram(out);
    return out;
  }
  const shader = program(
    `in vec3 place; in vec4 tint; in float since; uniform mat4 look; uniform float last; out vec4 color; out float height;
     void main() { gl_Position = since > last ? vec4(2.0, 2.0, 2.0, 1.0) : look * vec4(place, 1.0);
       color = tint; height = place.z; }`,
    `in vec4 color; in float height; uniform float top; out vec4 pixel;
     void main() { if (height > top) discard; pixel = color; }`);
  const where = Object.fromEntries(["place", "tint", "since"].map((name) => [name, gl.getAttribLocation(shader, name)]));
  const look = gl.getUniformLocation(shader, "look");
  const last = gl.getUniformLocation(shader, "last");
  const cut = gl.getUniformLocation(shader, "top");

  function upload(mode, places, tints, sinces, alpha) {
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    for (const [name, values, count, type] of [["place", places, 3, gl.FLOAT], ["tint", tints, 4, gl.UNSIGNED_BYTE],
      ["since", sinces, 1, gl.UNSIGNED_BYTE]]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(where[name]);
      gl.vertexAttribPointer(where[name], count, type, name === "tint", 0, 0);
    }
    return { mode, array, count: sinces.length, alpha, shown: true };
  }

  function heightColor(z) {
    const share = (z - data.low[2]) / Math.max(data.high[2] - data.low[2], 1e-6);
    return data.heights[Math.max(0, Math.min(data.heights.length - 1, Math.round(share * (data.heights.length - 1))))];
  }

  function faces(layer) {
    const bytes = Uint8Array.from(atob(layer.faces), (letter) => letter.charCodeAt(0));
    const view = new DataView(bytes.buffer);
    const count = bytes.length / 10, size = layer.size;
    const places = new Float32Array(count * 18), tints = new Uint8Array(count * 24), sinces = new Uint8Array(count * 6);
    for (let face = 0; face < count; face++) {
      const cell = [0, 1, 2].map((k) => view.getInt16(face * 10 + 2 * k, true));
      const [axis, , along, shade] = DIRECTIONS[bytes[face * 10 + 6]];
      const other = 3 - axis - along;
      const color = layer.rgb || heightColor((cell[2] + 0.5) * size);
      for (let corner = 0; corner < 6; corner++) {
        const at = [...cell];
        at[along] += CORNERS[corner][0] * bytes[face * 10 + 7];
        at[other] += CORNERS[corner][1] * bytes[face * 10 + 9];
        for (let k = 0; k < 3; k++) places[face * 18 + corner * 3 + k] = at[k] * size;
        for (let k = 0; k < 3; k++) tints[face * 24 + corner * 4 + k] = color[k] * shade;
        tints[face * 24 + corner * 4 + 3] = 255 * layer.alpha;
        sinces[face * 6 + corner] = bytes[face * 10 + 8];
      }
    }
    return upload(gl.TRIANGLES, places, tints, sinces, layer.alpha);
  }

  function segments(list, color, sinceOf) {
    const places = new Float32Array(list.flat()), count = list.length;
    const tints = new Uint8Array(count * 4), sinces = new Uint8Array(count);
    for (let k = 0; k < count; k++) { tints.set([...color, 255], 4 * k); sinces[k] = sinceOf(k); }
    return upload(gl.LINES, places, tints, sinces, 1);
  }

  const EDGES = [0, 1, 0, 2, 0, 3, 0, 4, 1, 2, 2, 3, 3, 4, 4, 1, 1, 5, 2, 5];
  function box(low, high) {
    const corner = (k) => [k & 1 ? high[0] : low[0], k & 2 ? high[1] : low[1], k & 4 ? high[2] : low[2]];
    const out = [];
    for (let a = 0; a < 8; a++) for (const bit of [1, 2, 4]) if (!(a & bit)) out.push(corner(a), corner(a | bit));
    return out;
  }

  const items = [["exploration volume", segments(box(data.low, data.high), [60, 60, 60], () => 0)]];
  for (const layer of data.layers) {
    const item = faces(layer);
    item.shown = layer.shown;
    const coarse = layer.size > 1.5 * data.resolution ? `, drawn in cubes of ${Math.round(100 * layer.size)} cm` : "";
    items.push([`${layer.name} (${layer.count.toLocaleString("en")}${coarse})`, item, layer.rgb]);
  }
  if (data.views.length) {
    items.push(["executed views", segments(data.views.flatMap((v) => EDGES.map((k) => v[k])), [200, 0, 120],
      (k) => Math.floor(k / EDGES.length) + 1), [200, 0, 120]]);
    const way = data.views.slice(1).flatMap((view, k) => [data.views[k][0], view[0]]);
    if (way.length) items.push(["way from view to view", segments(way, [0, 90, 200], (k) => Math.floor(k / 2) + 2), [0, 90, 200]]);
  }

  function matrix() {
    const { back, right, up } = axes(camera);
    const eye = camera.focus.map((f, k) => f + camera.distance * back[k]);
    const dot = (a) => -(a[0] * eye[0] + a[1] * eye[1] + a[2] * eye[2]);
    const near = camera.distance / 50, far = camera.distance + 3 * size, f = ZOOM, aspect = canvas.width / canvas.height;
    const [a, b] = [(far + near) / (near - far), (2 * far * near) / (near - far)];
    const rows = [right.map((k) => (k * f) / aspect), up.map((k) => k * f), back.map((k) => k * a), back.map((k) => -k)];
    const tail = [(dot(right) * f) / aspect, dot(up) * f, dot(back) * a + b, -dot(back)];
    return new Float32Array([0, 1, 2].flatMap((k) => rows.map((row) => row[k])).concat(tail));
  }

  function draw() {
    const scale = window.devicePixelRatio || 1;
    canvas.width = canvas.clientWidth * scale;
    canvas.height = canvas.clientHeight * scale;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0.98, 0.98, 0.98, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.useProgram(shader);
    gl.uniformMatrix4fv(look, false, matrix());
    gl.uniform1f(last, lastView);
    for (const clear of [false, true]) {
      gl.depthMask(!clear);
      clear ? gl.enable(gl.BLEND) : gl.disable(gl.BLEND);
      for (const [, item] of items) {
        if (!item.shown || (item.alpha < 1) !== clear) continue;
        gl.uniform1f(cut, item.mode === gl.TRIANGLES ? top : Infinity);
        gl.bindVertexArray(item.array);
        gl.drawArrays(item.mode, 0, item.count);
      }
    }
    gl.depthMask(true);
    canvas.dataset.drawn = "yes";
    canvas.dataset.milliseconds ||= Math.round(performance.now());
  }
  let due = false;
  function redraw() {
    if (due) return;
    due = true;
    requestAnimationFrame(() => { due = false; draw(); });
  }

  function swatch(background, kind = "") {
    const out = document.createElement("i");
    out.className = `swatch ${kind}`;
    out.style.background = background;
    return out;
  }

  function controls() {
    const place = document.getElementById("scene-controls");
    for (const [name, item, color] of items) {
      const label = document.createElement("label"), box = document.createElement("input");
      Object.assign(box, { type: "checkbox", checked: item.shown });
      box.addEventListener("change", () => { item.shown = box.checked; redraw(); });
      label.append(box, " ");
      if (color) label.append(swatch(`rgb(${color})`));
      label.append(name);
      place.append(label);
    }
    const key = document.createElement("span"), colors = data.heights.map((rgb) => `rgb(${rgb})`);
    key.append(swatch(`linear-gradient(90deg, ${colors})`, "heights"),
      `height ${data.low[2].toFixed(1)} to ${data.high[2].toFixed(1)} m (occupied)`);
    place.append(key);
    const slider = document.getElementById("scene-slider");
    if (slider) slider.addEventListener("input", () => {
      lastView = Number(slider.value) === Number(slider.max) ? 255 : Number(slider.value);
      document.getElementById("scene-slider-text").textContent = slider.value === "0" ? "after the first scan" : `after view ${slider.value}`;
      redraw();
    });
  }

  function cutting() {
    const slider = document.getElementById("scene-cut"), words = document.getElementById("scene-cut-text");
    const step = data.resolution, open = data.high[2] - 2 * step;  // without a roof one looks into rooms
    Object.assign(slider, { min: data.low[2], max: data.high[2], step });
    slider.value = open;
    const change = () => {
      top = Number(slider.value) + 0.01 * step;
      words.textContent = `${Number(slider.value).toFixed(2)} m`;
      redraw();
    };
    slider.addEventListener("input", change);
    change();
  }

  function pointer() {
    const active = new Map();
    let pan = false;
    canvas.addEventListener("pointerdown", (event) => {
      active.set(event.pointerId, event);
      pan = event.button > 0 || event.shiftKey;
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = active.get(event.pointerId);
      if (!before) return;
      const [dx, dy] = [event.clientX - before.clientX, event.clientY - before.clientY];
      active.set(event.pointerId, event);
      if (pan) {
        const step = camera.distance / canvas.clientHeight;
        const [cy, sy] = [Math.cos(camera.yaw), Math.sin(camera.yaw)];
        camera.focus[0] += sy * dx * step - cy * Math.sin(camera.pitch) * dy * step;
        camera.focus[1] += -cy * dx * step - sy * Math.sin(camera.pitch) * dy * step;
        camera.focus[2] += Math.cos(camera.pitch) * dy * step;
      } else {
        camera.yaw -= dx * 0.008;
        camera.pitch = Math.max(-1.55, Math.min(1.55, camera.pitch + dy * 0.008));
      }
      redraw();
    });
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (e) => active.delete(e.pointerId));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      camera.distance = Math.max(0.1, Math.min(10 * size, camera.distance * Math.exp(event.deltaY * 0.001)));
      redraw();
    }, { passive: false });
    canvas.addEventListener("dblclick", () => { Object.assign(camera, home, { focus: [...home.focus] }); redraw(); });
  }

  controls();
  cutting();
  pointer();
  window.addEventListener("resize", redraw);
  window.addEventListener("beforeprint", draw);
  draw();
})();
