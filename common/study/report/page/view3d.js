// The 3D view of a trial: parts, a slider per movable part, and swept volumes. One WebGL context
// draws all views; each view copies its picture to a canvas of its own, which prints.
const kSweptOpacity = 0.35;
const kMaxEdgeTriangles = 20000;  // of a part whose edges are drawn
const kFieldOfView_deg = 35;
const kTurn_rad = Math.PI / 24;  // per key press
const kZoom = 1.15;              // per key press
const kSweptColours = ["#1a8f8a", "#7b52ab", "#b8860b", "#3f6fb5"];

let sharedRenderer;  // null: this browser has no WebGL
function rendererOfPage() {
  if (sharedRenderer === undefined) {
    try {
      sharedRenderer = new libraries.WebGLRenderer({antialias: true, alpha: true});
    } catch {
      sharedRenderer = null;
    }
  }
  return sharedRenderer;
}

// The inverse of packed_mesh() in page_data.cpp.
const geometries = new Map();
function geometryOf(mesh) {
  if (geometries.has(mesh)) return geometries.get(mesh);
  const bytes = libraries.unzlibSync(Uint8Array.from(atob(mesh.packed), (c) => c.charCodeAt(0)));
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const positions = new Float32Array(3 * mesh.vertices);
  let at = 0;
  for (let axis = 0; axis < 3; ++axis) {
    let step = 0;
    for (let i = 0; i < mesh.vertices; ++i, at += 2) {
      step = (step + view.getUint16(at, true)) & 0xffff;
      positions[3 * i + axis] = mesh.low_m[axis] + step * mesh.step_m[axis];
    }
  }
  const indices = new Uint32Array(3 * mesh.triangles);
  let index = 0;
  for (let i = 0; i < indices.length; ++i, at += 4)
    indices[i] = index = (index + view.getUint32(at, true)) >>> 0;
  const geometry = new libraries.BufferGeometry();
  geometry.setAttribute("position", new libraries.BufferAttribute(positions, 3));
  geometry.setIndex(new libraries.BufferAttribute(indices, 1));
  geometries.set(mesh, geometry);
  return geometry;
}

function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

// A square in the colour. As SVG, because the page allows no style attribute.
function swatch(fill) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 8 8");
  svg.setAttribute("aria-hidden", "true");
  const square = document.createElementNS("http://www.w3.org/2000/svg", "rect");
  for (const [key, value] of Object.entries({width: 8, height: 8, fill}))
    square.setAttribute(key, value);
  svg.append(square);
  return svg;
}

class View {
  constructor(figure, data) {
    this.trial = data.trials[figure.dataset.trial];
    this.figure = figure;
    this.scene = new libraries.Scene();
    this.camera = new libraries.PerspectiveCamera(kFieldOfView_deg, 1.6, 0.01, 100);
    this.camera.up.set(0, 0, 1);
    this.scene.add(new libraries.AmbientLight(0xffffff, 1.6), this.camera);
    const light = new libraries.DirectionalLight(0xffffff, 2.2);
    light.position.set(0.4, 0.7, 1);
    this.camera.add(light);
    this.items = [
      ...data.scenes[this.trial.scene].filter((part) => part.mesh.triangles > 0)
        .map((part) => this.partItem(part)),
      ...this.trial.swept.map((swept, i) => this.sweptItem(swept, i)),
    ];
    this.selected = null;
    this.build();
    this.look([1, -1.3, 0.8]);
    new ResizeObserver(() => this.draw()).observe(this.canvas);
  }

  partItem(part) {
    const [r, g, b] = part.colour_rgb;
    const fill = `rgb(${r}, ${g}, ${b})`;
    const material = new libraries.MeshStandardMaterial({color: fill, roughness: 0.8,
      flatShading: true, side: libraries.DoubleSide, polygonOffset: true,
      polygonOffsetFactor: 1, polygonOffsetUnits: 1});
    const geometry = geometryOf(part.mesh);
    const mesh = new libraries.Mesh(geometry, material);
    if (part.mesh.triangles <= kMaxEdgeTriangles)
      mesh.add(new libraries.LineSegments(new libraries.EdgesGeometry(geometry, 30),
        new libraries.LineBasicMaterial()));
    mesh.visible = part.was_in_recording;
    this.scene.add(mesh);
    const text = part.was_in_recording ? part.name : `${part.name} (only what-if)`;
    return {name: part.name, text, fill, mesh, part};
  }

  sweptItem(swept, i) {
    const fill = kSweptColours[i % kSweptColours.length];
    const material = new libraries.MeshStandardMaterial({color: fill, roughness: 0.9,
      flatShading: true, transparent: true, opacity: kSweptOpacity, depthWrite: false,
      side: libraries.DoubleSide});
    const mesh = new libraries.Mesh(geometryOf(swept.mesh), material);
    this.scene.add(mesh);
    return {name: swept.of, text: `swept by ${swept.of}`, fill, mesh};
  }

  build() {
    this.canvas = element("canvas", {tabindex: 0, role: "img"});
    this.hint = element("p", {}, "Drag to turn, click a part to select it. Keys: arrows, + and −");
    this.panel = element("div", {class: "panel"});
    this.figure.append(element("div", {class: "stage"}, this.canvas, this.hint), this.panel);
    this.context = this.canvas.getContext("2d");
    this.controls = new libraries.OrbitControls(this.camera, this.canvas);
    this.controls.enableZoom = false;  // until the view has the focus: the wheel scrolls the page
    this.controls.addEventListener("change", () => this.draw());
    this.canvas.addEventListener("focus", () => { this.controls.enableZoom = true; });
    this.canvas.addEventListener("blur", () => { this.controls.enableZoom = false; });
    this.canvas.addEventListener("keydown", (event) => this.key(event));
    this.listenToClicks();
    this.buildList();
    for (const item of this.items) if (item.part?.axis) this.buildSlider(item);
    const views = element("div", {class: "views"});
    for (const [name, direction] of [["Reset", [1, -1.3, 0.8]], ["Front", [0, -1, 0]],
      ["Side", [1, 0, 0]], ["Top", [0, -0.001, 1]]]) {
      const button = element("button", {type: "button"}, name);
      button.addEventListener("click", () => this.look(direction));
      views.append(button);
    }
    this.panel.append(views);
  }

  buildList() {
    const list = element("fieldset", {}, element("legend", {}, "Shown"));
    for (const item of this.items) {
      const box = element("input", {type: "checkbox", "aria-label": `show ${item.text}`});
      box.checked = item.mesh.visible;
      box.addEventListener("change", () => {
        item.mesh.visible = box.checked;
        this.draw();
      });
      item.button = element("button", {type: "button", "aria-pressed": "false"}, item.text);
      item.button.addEventListener("click", () => this.select(item));
      list.append(element("div", {class: "item"}, box, swatch(item.fill), item.button));
    }
    this.panel.append(list);
  }

  // The slider starts where the part stood at the end of the trial.
  buildSlider(item) {
    const {axis} = item.part;
    const changes = this.trial.changes.filter((change) => change.part === item.name);
    const start = changes.at(-1)?.spacing_cm ?? axis.mesh_spacing_cm;
    const slider = element("input", {type: "range", min: Math.min(axis.low_cm, start),
      max: Math.max(axis.high_cm, start), step: 0.1, "aria-label": `spacing of ${item.name}, cm`});
    slider.value = start;
    const value = element("output"), verdict = element("span", {class: "verdict"});
    const curve = this.trial.what_if.find((c) => c.part === item.name);
    const move = () => {
      const spacing = Number(slider.value), shift_m = (spacing - axis.mesh_spacing_cm) / 100;
      item.mesh.position.set(...axis.direction.map((d) => d * shift_m));
      value.textContent = ` ${spacing.toFixed(1)} cm`;
      if (curve) {
        const isFree = curve.free_cm.some(([low, high]) => low <= spacing && spacing <= high);
        verdict.textContent = isFree ? "certified free" : "not certified free";
        verdict.className = `verdict ${isFree ? "is-free" : "is-not-free"}`;
      }
      this.draw();
    };
    slider.addEventListener("input", move);
    this.panel.append(element("fieldset", {}, element("legend", {}, `Spacing of ${item.name}`),
      slider, value, verdict));
    item.startMove = move;
  }

  listenToClicks() {
    let down = null;
    this.canvas.addEventListener("pointerdown", (event) => {
      down = [event.clientX, event.clientY];
    });
    this.canvas.addEventListener("pointerup", (event) => {
      if (!down || Math.hypot(event.clientX - down[0], event.clientY - down[1]) > 4) return;
      const box = this.canvas.getBoundingClientRect();
      const point = new libraries.Vector2(2 * (event.clientX - box.left) / box.width - 1,
        1 - 2 * (event.clientY - box.top) / box.height);
      const ray = new libraries.Raycaster();
      ray.setFromCamera(point, this.camera);
      const shown = this.items.filter((item) => item.part && item.mesh.visible);
      const hit = ray.intersectObjects(shown.map((item) => item.mesh), false)[0];
      this.select(shown.find((item) => item.mesh === hit?.object) ?? null);
    });
  }

  select(item) {
    this.selected = item === this.selected ? null : item;
    for (const other of this.items)
      other.button.setAttribute("aria-pressed", String(other === this.selected));
    this.draw();
  }

  key(event) {
    const turns = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};
    const turn = turns[event.key];
    const zoom = {"+": 1 / kZoom, "=": 1 / kZoom, "-": kZoom}[event.key];
    if (!turn && !zoom) return;
    event.preventDefault();
    const offset = this.camera.position.clone().sub(this.controls.target);
    if (zoom) offset.multiplyScalar(zoom);
    if (turn) {
      // Spherical has y up, the scene z.
      const angles = new libraries.Spherical().setFromVector3(
        new libraries.Vector3(offset.x, offset.z, -offset.y));
      angles.theta += turn[0] * kTurn_rad;
      angles.phi += turn[1] * kTurn_rad;
      angles.makeSafe();
      const turned = new libraries.Vector3().setFromSpherical(angles);
      offset.set(turned.x, -turned.z, turned.y);
    }
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.draw();
  }

  // Shows everything that is visible, from this direction.
  look(direction) {
    for (const item of this.items) item.startMove?.();
    const box = new libraries.Box3();
    for (const item of this.items) if (item.mesh.visible) box.expandByObject(item.mesh);
    if (box.isEmpty()) box.set(new libraries.Vector3(-1, -1, -1), new libraries.Vector3(1, 1, 1));
    const size = box.getSize(new libraries.Vector3()).length();
    const distance = 0.55 * size / Math.tan(kFieldOfView_deg * Math.PI / 360);
    box.getCenter(this.controls.target);
    this.camera.position.set(...direction).normalize().multiplyScalar(distance)
      .add(this.controls.target);
    this.camera.near = distance / 100;
    this.camera.far = distance * 20;
    this.controls.update();
    this.draw();
  }

  draw() {
    const renderer = rendererOfPage();
    const width = Math.round(this.canvas.clientWidth * devicePixelRatio);
    const height = Math.round(this.canvas.clientHeight * devicePixelRatio);
    if (width === 0 || height === 0) return;
    if (this.canvas.width !== width) this.canvas.width = width;
    if (this.canvas.height !== height) this.canvas.height = height;
    const edge = colour("ink"), accent = colour("accent");
    for (const item of this.items) {
      const isSelected = item === this.selected;
      item.mesh.material.emissive.set(isSelected ? accent : "#000000");
      item.mesh.material.emissiveIntensity = 0.35;
      item.mesh.children[0]?.material.color.set(isSelected ? accent : edge);
    }
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    renderer.setSize(width, height, false);
    renderer.render(this.scene, this.camera);
    this.context.clearRect(0, 0, width, height);
    this.context.drawImage(renderer.domElement, 0, 0);
    const shown = this.items.filter((item) => item.mesh.visible).map((item) => item.text);
    this.canvas.setAttribute("aria-label", `3D view of ${shown.join(", ") || "nothing"}` +
      (this.selected ? `. Selected: ${this.selected.text}` : ""));
    this.figure.dataset.drawn = "yes";
  }
}

// Returns a function that draws the view again.
function startView(figure, data) {
  if (!rendererOfPage()) {
    figure.append(element("p", {}, "The 3D view needs WebGL, which this browser does not offer."));
    return () => {};
  }
  const view = new View(figure, data);
  return () => view.draw();
}
