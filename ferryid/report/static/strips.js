/* Axes below one another with one horizontal axis: uPlot draws each, this links them, shades, draws intervals, and follows
   pointer and fingers. */
"use strict";
(function () {
  const el = ferryid.element;
  const left = 74; /* width of the vertical axes, alike in all strips [px] */
  const near = 16; /* how far from a point a click still means it [px] */

  function axis(more) {
    return {
      stroke: () => ferryid.colour("ink"),
      grid: { stroke: () => ferryid.colour("grid"), width: 1 },
      ticks: { stroke: () => ferryid.colour("grid"), width: 1 },
      ...more,
    };
  }

  function series(trace) {
    const alone = trace.style === "points" || trace.style === "hollow";
    const fill = () => ferryid.colour(trace.style === "hollow" ? "paper" : trace.colour);
    return {
      ...(alone ? { paths: () => null } : {}),
      label: trace.label,
      show: trace.shown,
      auto: trace.framing,
      stroke: () => ferryid.colour(trace.colour),
      width: trace.colour === "measured" ? 1.8 : 1.3,
      dash: trace.dash,
      points: trace.style === "line" ? { show: false } : { show: true, size: alone ? 8 : 5, fill },
      spanGaps: false,
    };
  }

  const logarithmic = {
    splits: (plot, k, low, high) => ferryid.logTicks(low, high),
    filter: (plot, at) => at,
    values: (plot, at) => at.map(ferryid.text),
  };

  ferryid.Strips = class {
    constructor(plain, state) {
      this.plain = plain;
      this.state = state;
      this.pan = false;
      this.root = el("div", { class: "strips" });
      this.rows = plain.strips.map((strip, k) => this.strip(strip, k));
      state.redraw.push(() => this.follow());
      state.pointed.push(() => this.cursor());
      ferryid.themed.push(() => this.rows.forEach((row) => row.plot && row.plot.redraw(false)));
    }

    strip(strip, k) {
      const values = el("div", { class: "switches" });
      const outputs = strip.traces.map((trace) => {
        const box = el("input", { type: "checkbox", checked: trace.shown, "data-trace": trace.label });
        const output = el("output", {}, "");
        box.addEventListener("change", () => this.state.show(trace.label, box.checked));
        const look = { points: " dot", hollow: " ring" }[trace.style] || (trace.dash.length ? " dashed" : "");
        const swatch = el("span", { class: "swatch" + look, style: "--of: var(--" + trace.colour + ")" });
        values.append(el("label", {}, box, swatch, trace.label + " ", output));
        return output;
      });
      const extra = el("div", { class: "switches extra" });
      const drawing = el("div", { class: "drawing", role: "img", "aria-label": strip.label + " over " + this.plain.axis.label });
      this.root.append(el("div", { class: "strip" }, el("div", { class: "head" }, el("strong", {}, strip.label), values, extra), drawing));
      return { strip, k, outputs, drawing, values, extra, plot: null };
    }

    /* Draw for the first time: only now are the widths known. */
    open() {
      this.rows.forEach((row) => {
        const last = row.k === this.rows.length - 1;
        const options = {
          width: row.drawing.clientWidth,
          height: this.height(last),
          legend: { show: false },
          cursor: {
            y: false,
            sync: { key: this.state.key, setSeries: false },
            drag: { x: true, y: false, setScale: false },
            bind: { dblclick: () => () => this.state.see(...this.state.whole) },
          },
          scales: {
            x: { time: this.plain.axis.kind === "date", min: this.state.from, max: this.state.to, auto: false },
            y: { distr: row.strip.scale === "log" ? 3 : 1, range: this.range(row) },
          },
          tzDate: (seconds) => uPlot.tzDate(new Date(seconds * 1000), "Etc/UTC"),
          axes: [
            axis({ ...this.state.axis.options(), size: this.bottom(last), labelSize: 16, ...(last ? {} : { label: undefined, values: () => [] }) }),
            axis({ size: left, space: 26, ...(row.strip.scale === "log" ? logarithmic : {}) }),
          ],
          series: [{}, ...row.strip.traces.map(series)],
          hooks: {
            drawClear: [(plot) => this.shade(plot)],
            drawAxes: [(plot) => this.intervals(row, plot)],
            setSelect: [(plot) => this.selected(plot)],
            setCursor: [(plot) => this.moved(row, plot)],
          },
        };
        row.plot = new uPlot(options, this.columns(row), row.drawing);
        row.drawn = this.state.data;
        this.listen(row.plot);
        if (this.plain.axis.links.length) this.follows(row.plot);
      });
      new ResizeObserver(() => this.rows.forEach((row) => this.resize(row))).observe(this.root);
    }

    columns(row) {
      return [this.state.data.t, ...this.state.data.strips[row.k], ...(row.beside || [])];
    }

    /* Lay the same signals of another log over these, dashed, from its own start on. */
    overlay() {
      const other = this.state.other;
      this.rows.forEach((row) => {
        const own = row.strip.traces.length;
        const its = other ? other.plain.strips.findIndex((strip) => strip.label === row.strip.label) : -1;
        const traces = its < 0 ? [] : other.plain.strips[its].traces.map((trace, i) => ({ trace, i })).filter(({ trace }) => !other.hidden.has(trace.label));
        row.beside = traces.map(({ i }) => this.state.laid(other.data.strips[its][i]));
        row.extra.replaceChildren();
        row.outputs.length = own;
        row.plot.batch(() => {
          while (row.plot.series.length > own + 1) row.plot.delSeries(own + 1);
          traces.forEach(({ trace }, i) => {
            row.plot.addSeries({ ...series({ ...trace, dash: [2, 3] }), label: other.plain.title + ": " + trace.label, show: true }, own + 1 + i);
            const output = el("output", {}, "");
            const swatch = el("span", { class: "swatch dashed", style: "--of: var(--" + trace.colour + ")" });
            row.extra.append(el("span", {}, swatch, other.plain.title + ", " + trace.label + " ", output));
            row.outputs.push(output);
          });
          row.plot.setData(this.columns(row), false);
          row.plot.setScale("x", { min: this.state.from, max: this.state.to });
        });
      });
    }

    /* Height of the horizontal axis. */
    bottom(last) {
      return last ? this.state.axis.bottom : 14;
    }

    height(last) {
      const alone = this.rows.length === 1 && this.plain.axis.kind !== "time";
      return (alone ? 280 : this.rows.length > 3 ? 120 : 150) + this.bottom(last);
    }

    /* What the vertical axis of a strip shows: its intervals too, and no more than its frame. */
    range(row) {
      const { scale, frame, traces } = row.strip;
      return (plot, low, high) => {
        const { t, ends } = this.state.data;
        traces.forEach((trace, i) => {
          if (!trace.ends || !trace.framing || this.state.hidden.has(trace.label)) return;
          t.forEach((at, k) => {
            const [from, to] = ends[row.k][i].map((one) => one[k]);
            if (at < this.state.from || at > this.state.to || from === null || to === null) return;
            low = low === null ? from : Math.min(low, from);
            high = high === null ? to : Math.max(high, to);
          });
        });
        if (low === null || high === null) return [null, null];
        if (frame) [low, high] = [Math.min(Math.max(low, frame[0]), frame[1]), Math.max(Math.min(high, frame[1]), frame[0])];
        if (scale === "log") return [low / 1.05, high * 1.05];
        const [bottom, top] = uPlot.rangeNum(low, high, 0.1, true);
        if (frame) return [Math.max(bottom, frame[0]), Math.min(top, frame[1])];
        return scale === "zero" ? [Math.min(0, low), top] : [bottom, top];
      };
    }

    resize(row) {
      const width = row.drawing.clientWidth;
      if (width && width !== row.plot.width) row.plot.setSize({ width, height: this.height(row.k === this.rows.length - 1) });
    }

    /* Take over view, data and which traces are shown. */
    follow() {
      this.rows.forEach((row) => {
        if (!row.plot) return;
        row.plot.batch(() => {
          if (row.drawn !== this.state.data) row.plot.setData(this.columns(row), false);
          row.drawn = this.state.data;
          row.strip.traces.forEach((trace, i) => {
            const shown = !this.state.hidden.has(trace.label);
            if (row.plot.series[i + 1].show !== shown) row.plot.setSeries(i + 1, { show: shown });
            row.values.querySelectorAll("input")[i].checked = shown;
          });
          row.plot.setScale("x", { min: this.state.from, max: this.state.to });
        });
      });
    }

    shade(plot) {
      const { ctx, bbox } = plot;
      const stretch = (first, last, role) => {
        const a = Math.max(plot.valToPos(first, "x", true), bbox.left);
        const b = Math.min(plot.valToPos(last, "x", true), bbox.left + bbox.width);
        if (b < bbox.left || a > bbox.left + bbox.width) return;
        ctx.fillStyle = ferryid.colour(role);
        ctx.fillRect(a, bbox.top, Math.max(b - a, 1), bbox.height);
      };
      ctx.save();
      this.plain.spans.forEach((span) => stretch(span.first, span.last, span.kind));
      const chosen = this.plain.marks[this.state.mark];
      ctx.globalAlpha = 0.6;
      if (chosen) chosen.spans.forEach(([first, last]) => stretch(first, last, "acts"));
      ctx.restore();
    }

    /* Bands along lines, and bars of marks. */
    intervals(row, plot) {
      const { ctx, bbox } = plot;
      const { t, ends } = this.state.data;
      ctx.save();
      ctx.beginPath();
      ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
      ctx.clip();
      row.strip.traces.forEach((trace, i) => {
        if (!trace.ends || this.state.hidden.has(trace.label)) return;
        const [low, high] = ends[row.k][i];
        const at = (k) => [plot.valToPos(t[k], "x", true), plot.valToPos(Math.max(low[k], plot.scales.y.min), "y", true), plot.valToPos(high[k], "y", true)];
        const known = t.map((_, k) => k).filter((k) => low[k] !== null && high[k] !== null);
        ctx.strokeStyle = ctx.fillStyle = ferryid.colour(trace.colour);
        ctx.lineWidth = 1.6 * uPlot.pxRatio;
        ctx.globalAlpha = trace.style === "line" || trace.style === "marked" ? 0.15 : 1;
        ctx.beginPath();
        if (ctx.globalAlpha < 1) {
          known.forEach((k) => ctx.lineTo(at(k)[0], at(k)[2]));
          known.reverse().forEach((k) => ctx.lineTo(at(k)[0], at(k)[1]));
          ctx.fill();
        } else {
          known.forEach((k) => {
            const [x, bottom, top] = at(k);
            ctx.moveTo(x, bottom);
            ctx.lineTo(x, top);
          });
          ctx.stroke();
          if (row.strip.frame) known.forEach((k) => this.arrows(plot, at(k)[0], low[k], high[k]));
        }
      });
      ctx.restore();
    }

    /* Where an interval ends beyond the frame. */
    arrows(plot, x, low, high) {
      const { ctx, bbox } = plot;
      const size = 5 * uPlot.pxRatio;
      const arrow = (tip, side) => {
        ctx.beginPath();
        ctx.moveTo(x, tip);
        ctx.lineTo(x - size, tip + side * size);
        ctx.lineTo(x + size, tip + side * size);
        ctx.fill();
      };
      if (high > plot.scales.y.max) arrow(bbox.top, 1);
      if (low < plot.scales.y.min) arrow(bbox.top + bbox.height, -1);
    }

    selected(plot) {
      const { left: from, width } = plot.select;
      if (width < 4) return;
      const ends = [plot.posToVal(from, "x"), plot.posToVal(from + width, "x")];
      plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
      this.state.see(...ends);
    }

    moved(row, plot) {
      const k = plot.cursor.idx;
      row.outputs.forEach((output, i) => {
        const none = k === null || k === undefined;
        const ends = this.state.data.ends[row.k][i];
        const interval = none || !ends || ends[0][k] === null ? "" : " (" + ferryid.text(ends[0][k]) + " to " + ferryid.text(ends[1][k]) + ")";
        output.textContent = none ? "" : ferryid.text(plot.data[i + 1][k]) + interval;
      });
      /* The strip under the pointer, or the one that was set by hand, moves the vessel on the map. */
      if (row.k === 0) this.state.follow(k === null || k === undefined ? null : plot.data[0][k]);
    }

    /* Put the cursor at a time. */
    cursor() {
      this.rows.forEach(({ plot }) => {
        if (plot) plot.setCursor({ left: plot.valToPos(this.state.asked, "x"), top: plot.over.clientHeight / 2 }, true, false);
      });
    }

    /* The row whose point is under the pointer, -1 where none is. */
    pointed(plot, event) {
      const box = plot.over.getBoundingClientRect();
      let [best, least] = [-1, near];
      plot.data.slice(1).forEach((values, i) => {
        if (!plot.series[i + 1].show) return;
        values.forEach((value, k) => {
          if (value === null) return;
          const far = Math.hypot(plot.valToPos(plot.data[0][k], "x") - (event.clientX - box.left), plot.valToPos(value, "y") - (event.clientY - box.top));
          if (far < least) [best, least] = [k, far];
        });
      });
      return best;
    }

    /* A click on a point leads where its row does; the end of a drag is none. (uPlot keeps clicks back while dragging moves.) */
    follows(plot) {
      const over = plot.over;
      let down = null;
      over.addEventListener("pointerdown", (event) => (down = event.button ? null : event));
      over.addEventListener("pointermove", (event) => (over.style.cursor = this.pointed(plot, event) < 0 ? "" : "pointer"));
      over.addEventListener("pointerup", (event) => {
        const still = down && Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) < 4;
        const k = still ? this.pointed(plot, event) : -1;
        if (k >= 0) this.state.lead(k);
      });
    }

    listen(plot) {
      const over = plot.over;
      over.style.touchAction = "pan-y";
      const time = (x) => plot.posToVal(x - over.getBoundingClientRect().left, "x");
      const held = new Map();
      let start = null;
      over.addEventListener(
        "mousedown",
        (event) => {
          if (this.pan || event.shiftKey) event.stopImmediatePropagation();
        },
        true,
      );
      over.addEventListener("pointerdown", (event) => {
        const touch = event.pointerType === "touch";
        if (!touch && !this.pan && !event.shiftKey) return;
        over.setPointerCapture(event.pointerId);
        held.set(event.pointerId, event.clientX);
        start = { at: [...held.values()], from: this.state.from, to: this.state.to };
      });
      over.addEventListener("pointermove", (event) => {
        if (!held.has(event.pointerId)) return;
        held.set(event.pointerId, event.clientX);
        const now = [...held.values()];
        const perPixel = (start.to - start.from) / over.clientWidth;
        if (now.length === 1) {
          const moved = (start.at[0] - now[0]) * perPixel;
          this.state.see(start.from + moved, start.to + moved);
        } else if (now.length === 2 && start.at.length === 2) {
          const ratio = Math.abs(start.at[1] - start.at[0]) / Math.max(Math.abs(now[1] - now[0]), 8);
          const middle = 0.5 * (start.from + start.to);
          const half = 0.5 * (start.to - start.from) * ratio;
          this.state.see(middle - half, middle + half);
        }
      });
      const release = (event) => held.delete(event.pointerId);
      over.addEventListener("pointerup", release);
      over.addEventListener("pointercancel", release);
      over.addEventListener(
        "wheel",
        (event) => {
          if (event.ctrlKey || event.metaKey) {
            event.preventDefault();
            this.state.zoom(Math.exp(-0.002 * event.deltaY), time(event.clientX));
          } else if (event.shiftKey) {
            event.preventDefault();
            this.state.shift(((event.deltaX || event.deltaY) / over.clientWidth) * 1.0);
          }
        },
        { passive: false },
      );
    }
  };
})();
