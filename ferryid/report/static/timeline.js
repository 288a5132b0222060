/* Interactive figures of a log, or along another axis: state of the view, its controls and keys, and the rows that are loaded when a reader zooms in. */
"use strict";
(function () {
  const el = ferryid.element;
  const most = 200000; /* rows in view, above which the overview is drawn */
  const all = [];

  class Timeline {
    constructor(plain, number, section) {
      this.plain = plain;
      this.key = "ferryid-" + number;
      this.data = this.overview = ferryid.decode(plain, plain.data);
      this.rows = null;
      this.axis = ferryid.axis(plain.axis, this.data.t);
      this.whole = this.axis.whole;
      [this.from, this.to] = this.whole;
      this.cursorAt = null;
      this.asked = null;
      this.mark = -1;
      this.hidden = new Set();
      plain.strips.forEach((strip) => strip.traces.forEach((trace) => trace.shown || this.hidden.add(trace.label)));
      this.redraw = [];
      this.pointed = [];
      this.other = null;
      this.later = 0;
      this.section = section;
      this.build();
    }

    get cursor() {
      return this.cursorAt;
    }

    build() {
      const button = (text, title, act, more) => el("button", { type: "button", title, "aria-label": title, onclick: act, ...more }, text);
      this.range = el("output", { class: "range" }, "");
      this.live = el("p", { class: "live", "aria-live": "polite" }, "");
      this.strips = new ferryid.Strips(this.plain, this);
      this.map = this.plain.place ? new ferryid.Map(this.plain, this) : null;
      const pan = button("drag: zoom", "whether dragging zooms or moves the " + this.axis.along, () => {
        this.strips.pan = !this.strips.pan;
        pan.textContent = this.strips.pan ? "drag: move" : "drag: zoom";
        pan.setAttribute("aria-pressed", this.strips.pan);
        this.section.classList.toggle("pan", this.strips.pan);
      });
      const tools = (this.tools = el(
        "div",
        { class: "tools", role: "toolbar", "aria-label": this.axis.along },
        button("+", "zoom in", () => this.zoom(2)),
        button("−", "zoom out", () => this.zoom(0.5)),
        button("◀", this.axis.sides[0], () => this.shift(-0.5)),
        button("▶", this.axis.sides[1], () => this.shift(0.5)),
        button(this.axis.all.name, this.axis.all.title, () => this.jump(-1)),
        pan,
        this.range,
        ferryid.themeButton(),
      ));
      this.marks = this.plain.marks.map((mark, k) => {
        const where = mark.spans.length ? mark.spans[0].map((one) => one.toFixed(0)).join(" to ") + " s" : "whole log";
        const more = mark.spans.length > 1 ? ", " + mark.spans.length + " times" : "";
        return button(k + 1 + ". " + mark.title + " · " + where + more, "show when " + mark.title + " acts", () => this.jump(k), {
          "aria-pressed": "false",
        });
      });
      const findings = this.marks.length ? el("div", { class: "tools findings", role: "toolbar", "aria-label": "findings" }, ...this.marks) : "";
      const kinds = new Map(this.plain.spans.map((span) => [span.kind, span.label]));
      if (this.plain.marks.some((mark) => mark.spans.length)) kinds.set("acts", "chosen stretch");
      const shades = el("div", { class: "switches" }, ...[...kinds].map(([kind, label]) => el("span", {}, el("span", { class: "swatch area", style: "--of: var(--" + kind + ")" }), label)));
      const help = el(
        "details",
        { class: "keys" },
        el("summary", {}, "keys"),
        el("p", {}, this.axis.keys),
      );
      this.section.append(tools, findings, shades, el("div", { class: this.map ? "both" : "" }, this.strips.root, this.map ? this.map.root : ""), this.live, help);
      this.section.hidden = false;
      this.section.tabIndex = 0;
      this.section.addEventListener("keydown", (event) => this.pressed(event));
      this.say();
      /* What is far down the page is drawn when a reader comes near. */
      const near = new IntersectionObserver((seen) => seen.some((one) => one.isIntersecting) && this.open(), { rootMargin: "400px" });
      near.observe(this.section);
      this.near = near;
    }

    open() {
      if (this.opened) return;
      this.opened = true;
      this.near.disconnect();
      this.strips.open();
      this.strips.follow();
      if (this.map) this.map.draw();
      this.lay();
    }

    /* Show a stretch of the horizontal axis. */
    see(from, to) {
      const [first, last] = this.whole;
      const least = this.axis.least((this.rows || this.overview).t.length);
      let width = Math.min(Math.max(to - from, least), last - first);
      const middle = 0.5 * (from + to);
      from = Math.min(Math.max(middle - 0.5 * width, first), last - width);
      [this.from, this.to] = [from, from + width];
      if (this.level()) this.lay();
      this.changed();
    }

    zoom(factor, about) {
      const pivot = about === undefined ? (this.cursor !== null && this.cursor > this.from && this.cursor < this.to ? this.cursor : 0.5 * (this.from + this.to)) : about;
      this.see(pivot - (pivot - this.from) / factor, pivot + (this.to - pivot) / factor);
    }

    shift(share) {
      const by = share * (this.to - this.from);
      this.see(this.from + by, this.to + by);
    }

    jump(k) {
      this.mark = k;
      this.marks.forEach((button, i) => button.setAttribute("aria-pressed", String(i === k)));
      const mark = this.plain.marks[k];
      if (mark && mark.trace) this.hidden.delete(mark.trace);
      if (!mark || !mark.spans.length) this.see(...this.whole);
      else {
        const first = Math.min(...mark.spans.map((span) => span[0]));
        const last = Math.max(...mark.spans.map((span) => span[1]));
        const room = 0.15 * (last - first) + 5;
        this.see(Math.max(first - room, this.whole[0]), Math.min(last + room, this.whole[1]));
      }
      this.live.textContent = mark ? "Shown: " + this.marks[k].textContent + "." : "Shown: " + this.axis.all.shown + ".";
    }

    show(label, on) {
      if (on) this.hidden.delete(label);
      else this.hidden.add(label);
      this.changed();
    }

    /* The strips' cursor is at a time; None where it left. */
    follow(time) {
      if (time === this.cursorAt) return;
      this.cursorAt = time;
      this.say();
      if (this.map) this.map.draw();
    }

    point(time) {
      this.asked = Math.min(Math.max(time, this.from), this.to);
      this.pointed.forEach((act) => act());
    }

    /* All rows where a reader looks close enough, and the overview elsewhere. */
    level() {
      const share = (this.to - this.from) / (this.whole[1] - this.whole[0]);
      if (this.plain.fine && !this.rows && share < 0.6 && !this.asking) {
        this.asking = true;
        document.head.append(el("script", { src: this.plain.fine }));
      }
      const near = this.rows && share * this.rows.t.length < most;
      const before = this.data;
      this.data = near ? this.rows : this.overview;
      return this.data !== before;
    }

    loaded(data) {
      this.rows = ferryid.decode(this.plain, data);
      if (this.level()) this.lay();
      this.changed();
      all.forEach((one) => one.other === this && one.lay());
    }

    /* Choose another log of the page to lay over this one; its time may be shifted. */
    beside(number, later) {
      this.open();
      this.other = number < 0 ? null : all[number];
      this.later = isFinite(later) ? later : 0;
      this.lay();
      if (this.map) this.map.draw();
    }

    lay() {
      if (this.opened && (this.other || this.strips.rows.some((row) => row.beside))) this.strips.overlay();
    }

    /* A column of the other log at the times of this one. */
    laid(values) {
      const from = this.other.data.t;
      let k = 0;
      return this.data.t.map((time) => {
        const at = time - this.later;
        if (at < from[0] || at > from[from.length - 1]) return null;
        while (k + 1 < from.length - 1 && from[k + 1] <= at) k++;
        const [a, b] = [values[k], values[k + 1]];
        if (a === null || b === null || b === undefined) return null;
        const step = from[k + 1] - from[k];
        return step > 0 ? a + ((b - a) * (at - from[k])) / step : a;
      });
    }

    /* Once all logs of the page are there. */
    offer() {
      const others = all.filter((one) => one !== this && one.plain.axis.kind === "time");
      if (this.plain.axis.kind !== "time" || !others.length) return;
      const choice = el("select", { "aria-label": "log to lay over this one" }, el("option", { value: -1 }, "no other log"));
      others.forEach((one) => choice.append(el("option", { value: all.indexOf(one) }, one.plain.title)));
      const later = el("input", { type: "number", value: 0, step: 1, "aria-label": "shift of the other log in seconds" });
      const act = () => this.beside(Number(choice.value), Number(later.value));
      choice.addEventListener("change", act);
      later.addEventListener("change", act);
      this.tools.insertBefore(el("span", { class: "beside" }, el("label", {}, "beside: ", choice), el("label", {}, " shift ", later, " s")), this.range);
    }

    changed() {
      this.say();
      this.redraw.forEach((act) => act());
    }

    say() {
      this.range.textContent = this.axis.tell(this.from, this.to, this.cursor);
    }

    /* Go where the point of a row leads. */
    lead(k) {
      const link = this.axis.links && this.axis.links[k];
      if (!link) return;
      /* The page may have hidden the row since it was last led there. */
      if (location.hash === link) dispatchEvent(new Event("hashchange"));
      location.href = link;
    }

    pressed(event) {
      if (event.ctrlKey || event.metaKey || event.altKey || /INPUT|SELECT|SUMMARY/.test(event.target.tagName)) return;
      const side = event.key === "ArrowLeft" ? -1 : 1;
      if (event.key === "ArrowLeft" || event.key === "ArrowRight") {
        if (event.shiftKey) this.shift(0.25 * side);
        else this.point(this.axis.next(this.cursor, side, this.from, this.to));
      } else if (event.key === "+" || event.key === "=") this.zoom(2);
      else if (event.key === "-") this.zoom(0.5);
      else if (event.key === "0" || event.key === "Home") this.jump(-1);
      else if (event.key === "Enter" && this.axis.links && this.cursor !== null && event.target === this.section) this.lead(this.axis.nearest(this.cursor));
      else if (/^[1-9]$/.test(event.key) && Number(event.key) <= this.marks.length) this.jump(Number(event.key) - 1);
      else return;
      event.preventDefault();
    }
  }

  ferryid.show = function (plains) {
    plains.forEach((plain, number) => {
      const section = document.querySelector('[data-timeline="' + (number + 1) + '"]');
      if (section) all[number] = new Timeline(plain, number, section);
    });
    all.forEach((one) => one.offer());
    document.documentElement.classList.add("interactive");
    ferryid.all = all;
    /* The others once the page is there and nothing else is to be done. */
    const idle = window.requestIdleCallback || ((act) => setTimeout(act, 200));
    const next = () => {
      const one = all.find((each) => !each.opened);
      if (!one) return;
      one.open();
      idle(next);
    };
    addEventListener("load", () => idle(next));
  };

  ferryid.rows = (number, data) => all[number].loaded(data);
})();
