/* What lies along the horizontal axis of a figure: the time of a log, or few rows by their numbers, dates or names. */
"use strict";
(function () {
  const day = 86400;
  const steps = [1, 5, 15, 60, 180, 360, 720].map((minutes) => minutes * 60).concat([1, 2, 5, 10, 30, 60, 90, 180, 365, 730, 1825].map((days) => days * day));
  const whole = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000];
  const longest = 36; /* letters of a name below the axis */

  function date(seconds, hours) {
    const text = new Date(seconds * 1000).toISOString();
    return hours ? text.slice(0, 16).replace("T", " ") : text.slice(0, 10);
  }

  const Time = class {
    constructor(plain, t) {
      this.t = t;
      this.label = plain.label;
      this.whole = [t[0], t[t.length - 1]];
      this.all = { name: "whole log", title: "show the whole log", shown: "the whole log" };
      this.sides = ["earlier", "later"];
      this.along = "time axis";
      this.keys = "← → cursor · Shift with ← → earlier, later · + − zoom · 0 whole log · 1 to 9 findings · Ctrl with the wheel zooms · Shift with the wheel or dragging moves · double click: whole log";
      this.bottom = 44;
    }

    /* The shortest stretch that a view shows, of so many rows. */
    least(rows) {
      const [first, last] = this.whole;
      return Math.min(((last - first) / Math.max(rows - 1, 1)) * 20, last - first);
    }

    tell(from, to, cursor) {
      return ferryid.text(from) + " to " + ferryid.text(to) + " s" + (cursor === null ? "" : " · cursor " + ferryid.text(cursor) + " s");
    }

    /* Where the cursor is one key further. */
    next(cursor, side, from, to) {
      return (cursor === null ? 0.5 * (from + to) : cursor) + (side * (to - from)) / 200;
    }

    /* Options of uPlot for the axis below the last strip. */
    options() {
      return { label: this.label };
    }
  };

  const Rows = class {
    constructor(plain, t) {
      this.t = t;
      this.label = plain.label;
      this.names = plain.names;
      this.links = plain.links;
      this.kind = plain.kind;
      const [first, last] = [t[0], t[t.length - 1]];
      const room = this.kind === "date" ? 0.04 * (last - first) || day : 0.5;
      this.whole = [first - room, last + room];
      this.all = { name: "all", title: "show all", shown: "all" };
      this.sides = this.kind === "date" ? ["earlier", "later"] : ["move left", "move right"];
      this.along = "horizontal axis";
      const opens = this.links.length ? " · a click on a point, or Enter, leads to the row of its log" : "";
      this.keys = "← → from row to row · Shift with ← → move · + − zoom · 0 all · Ctrl with the wheel zooms · Shift with the wheel or dragging moves · double click: all" + opens;
      this.short = this.names.map((name) => (name.length > longest ? name.slice(0, longest - 1) + "…" : name));
      this.bottom = this.kind === "name" ? 30 + 6.5 * Math.max(...this.short.map((name) => name.length)) : 44;
    }

    /* Down to two neighbours. */
    least() {
      const apart = this.t.slice(1).map((t, k) => t - this.t[k]).filter((one) => one > 0);
      return Math.min(2 * Math.min(...apart), this.whole[1] - this.whole[0]);
    }

    nearest(at) {
      return this.t.reduce((best, t, k) => (Math.abs(t - at) < Math.abs(this.t[best] - at) ? k : best), 0);
    }

    row(t) {
      if (this.kind === "date") return date(t);
      return String(Math.round(t));
    }

    tell(from, to, cursor) {
      const seen = this.t.filter((t) => t >= from && t <= to);
      const ends = seen.length ? this.row(seen[0]) + " to " + this.row(seen[seen.length - 1]) : "none";
      const stretch = ends + (this.kind === "name" ? " of " + this.t.length : "");
      if (cursor === null) return stretch;
      const k = this.nearest(cursor);
      return stretch + " · cursor " + [this.kind === "number" ? this.row(this.t[k]) : "", this.names[k]].filter(Boolean).join(" ");
    }

    next(cursor, side, from, to) {
      if (cursor === null) return this.t[this.nearest(0.5 * (from + to))];
      return this.t[Math.min(Math.max(this.nearest(cursor) + side, 0), this.t.length - 1)];
    }

    options() {
      if (this.kind === "date") {
        return { label: this.label, space: 90, incrs: steps, values: (plot, at, k, space, step) => at.map((one) => (step < day ? date(one, true).slice(5) : step < 30 * day ? date(one) : date(one).slice(0, 7))) };
      }
      if (this.kind === "name") {
        return { label: this.label, space: 14, incrs: whole, rotate: -90, values: (plot, at) => at.map((one) => this.short[one - 1] || "") };
      }
      return { label: this.label, space: 30, incrs: whole };
    }
  };

  ferryid.axis = (plain, t) => new (plain.kind === "time" ? Time : Rows)(plain, t);

  /* Round numbers on a logarithmic vertical axis. */
  ferryid.logTicks = function (low, high) {
    const ticks = [];
    if (high / low < 5) {
      const rough = (high - low) / 5;
      const power = Math.pow(10, Math.floor(Math.log10(rough)));
      const step = [1, 2, 5, 10].find((k) => k * power >= rough) * power;
      for (let k = Math.ceil(low / step); k * step <= high; k++) ticks.push(k * step);
      return ticks;
    }
    const decades = Math.log10(high / low);
    const stride = Math.ceil(decades / 6);
    for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power += 1) {
      for (const k of decades < 3 ? [1, 2, 5] : [1]) {
        const tick = k * Math.pow(10, power);
        if (tick >= low && tick <= high && power % stride === 0) ticks.push(tick);
      }
    }
    return ticks;
  };
})();
