/* The track, north up, with arrows of wind, current and what is left over: drag to move it, buttons to zoom. */
"use strict";
(function () {
  const el = ferryid.element;
  const reach = 46; /* length of the longest usual arrow [px] */
  const count = 26; /* arrows of a kind */
  const edge = 26; /* [px] */

  function extent(values) {
    let low = Infinity;
    let high = -Infinity;
    for (const value of values) {
      if (value === null) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
    return [low, high];
  }

  /* A round number that is not greater. */
  function round(value) {
    const power = Math.pow(10, Math.floor(Math.log10(value)));
    return [5, 2, 1].find((k) => k * power <= value) * power;
  }

  function usual(sizes) {
    const sorted = sizes.filter((one) => one > 0).sort((a, b) => a - b);
    return sorted.length ? sorted[Math.floor(0.9 * (sorted.length - 1))] : 0;
  }

  ferryid.Map = class {
    constructor(plain, state) {
      this.plain = plain;
      this.state = state;
      this.on = plain.arrows.map((one) => one.shown);
      this.canvas = el("canvas", { role: "img", "aria-label": "Track of " + plain.title + ", north up" });
      this.legend = el("div", { class: "switches" });
      const button = (text, title, act) => el("button", { type: "button", title, "aria-label": title, onclick: act }, text);
      this.root = el(
        "div",
        { class: "map" },
        el(
          "div",
          { class: "tools" },
          button("+", "zoom into the map", () => this.zoom(1.5)),
          button("−", "zoom out of the map", () => this.zoom(1 / 1.5)),
          button("whole track", "show the whole track", () => this.fit()),
        ),
        this.canvas,
        this.legend,
      );
      plain.arrows.forEach((one, k) => {
        const box = el("input", { type: "checkbox", checked: one.shown });
        box.addEventListener("change", () => {
          this.on[k] = box.checked;
          this.draw();
        });
        const swatch = el("span", { class: "swatch", style: "background: var(--" + one.colour + ")" });
        this.legend.append(el("label", { "data-arrows": one.label }, box, swatch, el("span", {}, one.label)));
      });
      this.listen();
      state.redraw.push(() => this.draw());
      ferryid.themed.push(() => this.draw());
      new ResizeObserver(() => this.draw()).observe(this.canvas);
    }

    fit() {
      this.view = null;
      this.draw();
    }

    zoom(factor) {
      if (this.view) this.view.scale *= factor;
      this.draw();
    }

    whole(width, height) {
      const [north, east] = this.state.data.place;
      const [south, top] = extent(north);
      const [west, right] = extent(east);
      const size = Math.max((right - west) / (width - 2 * edge), (top - south) / (height - 2 * edge), 1e-6);
      return { north: 0.5 * (south + top), east: 0.5 * (west + right), scale: 1 / size };
    }

    at(k, places) {
      const [north, east] = places || this.state.data.place;
      if (k < 0 || north[k] === null || east[k] === null || north[k] === undefined) return null;
      return [
        0.5 * this.width + (east[k] - this.view.east) * this.view.scale,
        0.5 * this.height - (north[k] - this.view.north) * this.view.scale,
      ];
    }

    draw() {
      if (!this.state.opened) return;
      const ratio = window.devicePixelRatio || 1;
      this.width = this.canvas.clientWidth;
      this.height = this.canvas.clientHeight;
      if (!this.width || !this.height) return;
      this.canvas.width = Math.round(this.width * ratio);
      this.canvas.height = Math.round(this.height * ratio);
      if (!this.view) this.view = this.whole(this.width, this.height);
      const ink = this.canvas.getContext("2d");
      ink.scale(ratio, ratio);
      const t = this.state.data.t;
      const first = ferryid.before(t, this.state.from);
      const last = ferryid.before(t, this.state.to);
      this.path(ink, 0, t.length - 1, "faint", 1.2);
      this.path(ink, first, last, "measured", 2.2);
      const other = this.state.other;
      if (other && other.data.place) {
        ink.setLineDash([4, 4]);
        this.path(ink, 0, other.data.t.length - 1, "c3", 1.6, other.data.place);
        ink.setLineDash([]);
      }
      this.frame(ink);
      this.plain.arrows.forEach((one, k) => this.on[k] && this.arrows(ink, one, this.state.data.arrows[k], first, last));
      this.vessel(ink);
    }

    path(ink, first, last, role, width, places) {
      ink.strokeStyle = ferryid.colour(role);
      ink.lineWidth = width;
      ink.beginPath();
      let down = false;
      const step = Math.max(1, Math.floor((last - first) / 6000));
      for (let k = first; k <= last; k += step) {
        const place = this.at(k, places);
        if (place && down) ink.lineTo(...place);
        else if (place) ink.moveTo(...place);
        down = place !== null;
      }
      ink.stroke();
    }

    frame(ink) {
      const metres = round((0.3 * this.width) / this.view.scale);
      const length = metres * this.view.scale;
      ink.strokeStyle = ink.fillStyle = ferryid.colour("ink");
      ink.lineWidth = 1.5;
      ink.beginPath();
      ink.moveTo(10, this.height - 10);
      ink.lineTo(10 + length, this.height - 10);
      ink.stroke();
      ink.font = "12px system-ui, sans-serif";
      ink.textAlign = "left";
      ink.fillText(metres >= 1000 ? metres / 1000 + " km" : metres + " m", 12, this.height - 16);
      ink.fillText("N", this.width - 18, 14);
      this.arrow(ink, this.width - 14, 40, this.width - 14, 18);
    }

    arrow(ink, x, y, tipX, tipY) {
      const length = Math.hypot(tipX - x, tipY - y);
      if (length < 1) return;
      const along = [(tipX - x) / length, (tipY - y) / length];
      const head = Math.min(7, 0.5 * length);
      ink.beginPath();
      ink.moveTo(x, y);
      ink.lineTo(tipX, tipY);
      for (const side of [1, -1]) {
        ink.moveTo(tipX, tipY);
        ink.lineTo(tipX - head * (along[0] + side * 0.5 * along[1]), tipY - head * (along[1] - side * 0.5 * along[0]));
      }
      ink.stroke();
    }

    arrows(ink, one, columns, first, last) {
      const steady = one.steady;
      const sizes = steady ? [Math.hypot(...steady)] : columns[0].map((north, k) => (north === null ? 0 : Math.hypot(north, columns[1][k])));
      const size = usual(sizes);
      const label = this.legend.querySelector('[data-arrows="' + CSS.escape(one.label) + '"] span:last-child');
      if (!size) return;
      /* A number to read the lengths by. */
      const unit = round(size);
      const scale = reach / size;
      label.textContent = one.label + " (" + Math.round(unit * scale) + " px: " + ferryid.text(unit) + " " + one.unit + ")";
      ink.strokeStyle = ferryid.colour(one.colour);
      ink.lineWidth = 1.6;
      const step = Math.max(1, Math.floor((last - first) / count));
      for (let k = first + (step >> 1); k <= last; k += step) {
        const place = this.at(k);
        const north = steady ? steady[0] : columns[0][k];
        const east = steady ? steady[1] : columns[1][k];
        if (place && north !== null && east !== null) this.arrow(ink, ...place, place[0] + east * scale, place[1] - north * scale);
      }
    }

    vessel(ink) {
      if (this.state.cursor === null) return;
      const k = ferryid.before(this.state.data.t, this.state.cursor);
      const place = this.at(k);
      if (!place) return;
      ink.save();
      ink.translate(...place);
      ink.rotate(((this.state.data.place[2][k] || 0) * Math.PI) / 180);
      ink.fillStyle = ferryid.colour("vessel");
      ink.strokeStyle = ferryid.colour("paper");
      ink.beginPath();
      ink.moveTo(0, -11);
      ink.lineTo(6, 8);
      ink.lineTo(-6, 8);
      ink.closePath();
      ink.fill();
      ink.stroke();
      ink.restore();
    }

    listen() {
      let held = null;
      this.canvas.addEventListener("pointerdown", (event) => {
        held = { x: event.clientX, y: event.clientY, moved: false };
        this.canvas.setPointerCapture(event.pointerId);
      });
      this.canvas.addEventListener("pointermove", (event) => {
        if (!held || !this.view) return;
        const dx = event.clientX - held.x;
        const dy = event.clientY - held.y;
        if (!held.moved && Math.hypot(dx, dy) < 4) return;
        held = { x: event.clientX, y: event.clientY, moved: true };
        this.view.east -= dx / this.view.scale;
        this.view.north += dy / this.view.scale;
        this.draw();
      });
      this.canvas.addEventListener("pointerup", (event) => {
        if (held && !held.moved) this.pick(event.offsetX, event.offsetY);
        held = null;
      });
      this.canvas.addEventListener(
        "wheel",
        (event) => {
          if (!event.ctrlKey && !event.metaKey) return;
          event.preventDefault();
          this.zoom(Math.exp(-0.002 * event.deltaY));
        },
        { passive: false },
      );
    }

    /* The time at which the vessel was nearest to a place of the map. */
    pick(x, y) {
      const t = this.state.data.t;
      let best = -1;
      let least = Infinity;
      for (let k = ferryid.before(t, this.state.from); k <= ferryid.before(t, this.state.to); k++) {
        const place = this.at(k);
        const far = place ? Math.hypot(place[0] - x, place[1] - y) : Infinity;
        if (far < least) [best, least] = [k, far];
      }
      if (best >= 0) this.state.point(t[best]);
    }
  };
})();
