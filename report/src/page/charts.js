// Charts of the page's data, drawn by uPlot: drag to zoom, double-click for the whole, point at a curve to read it, click a
// name to hide it. Charts over time zoom together.
(() => {
  'use strict';
  const dark = matchMedia('(prefers-color-scheme: dark)');
  const own = pair => pair[dark.matches && !printing ? 1 : 0];
  const variable = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  let printing = false;
  let drawn = [];

  const decoded = (text, columns) => {
    const bytes = Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
    const all = new Float32Array(bytes.buffer), length = all.length / columns;
    return Array.from({length: columns}, (_, at) => all.subarray(at * length, (at + 1) * length));
  };
  const written = value => {
    const text = Math.abs(value) >= 1e6 || (value !== 0 && Math.abs(value) < 1e-4)
      ? value.toExponential(3) : String(+value.toPrecision(6));
    return text.replace('-', '−');
  };
  const element = (tag, name, parent, text) => {
    const made = document.createElement(tag);
    made.className = name;
    if (text) made.textContent = text;
    parent.append(made);
    return made;
  };

  // Ends of an axis: those given, or a little beyond the data.
  const ends = (axis, columns, marks, room) => {
    if (axis.range) return axis.range;
    let low = Infinity, high = -Infinity;
    for (const column of [...columns, marks])
      for (const value of column)
        if (Number.isFinite(value) && (value > 0 || !axis.log)) {
          if (value < low) low = value;
          if (value > high) high = value;
        }
    if (low > high) return axis.log ? [1, 10] : [0, 1];
    if (axis.log) {
      const beyond = Math.pow(high / low, room) * (low === high ? 2 : 1);
      return [low / beyond, high * beyond];
    }
    const beyond = (high - low) * room || Math.abs(high) * 0.1 || 1;
    return [low - beyond, high + beyond];
  };

  // Ticks of a logarithmic axis: decades, with 2 and 5 times each if they are few. The library starts at the axis' end.
  const decades = (low, high) => {
    const span = Math.log10(high / low), every = Math.max(1, Math.ceil(span / 8));
    const factors = span < 2.5 ? [1, 2, 5] : [1], ticks = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++)
      if (power % every === 0)
        for (const factor of factors) {
          const tick = Number(`${factor}e${power}`);
          if (tick >= low && tick <= high) ticks.push(tick);
        }
    return ticks;
  };

  // A curve as a path; what is not finite breaks it.
  const path = style => (u, index) => {
    uPlot.orient(u, index, (series, xs, ys, scaleX, scaleY, toX, toY, left, top, width, height) => {
      const line = new Path2D(), dot = 1.6 * devicePixelRatio;
      let pen = false;
      for (let at = 0; at < xs.length; at++) {
        const x = toX(xs[at], scaleX, width, left), y = toY(ys[at], scaleY, height, top);
        if (!Number.isFinite(x) || !Number.isFinite(y)) pen = false;
        else if (style === 'points') {
          line.moveTo(x + dot, y);
          line.arc(x, y, dot, 0, 2 * Math.PI);
        } else {
          if (pen) line.lineTo(x, y); else line.moveTo(x, y);
          pen = true;
        }
      }
      const filled = style === 'points';
      series.own = {stroke: filled ? null : line, fill: filled ? line : null, clip: null, band: null, gaps: null, flags: 0};
    });
    return u.series[index].own;
  };

  const drawBand = (u, band) => {
    const [xs, low, high] = band.columns, shape = new Path2D();
    const at = (index, column) => [u.valToPos(xs[index], 'x', true), u.valToPos(column[index], 'y', true)];
    for (let index = 0; index < xs.length; index++) shape.lineTo(...at(index, high));
    for (let index = xs.length - 1; index >= 0; index--) shape.lineTo(...at(index, low));
    u.ctx.globalAlpha = 0.2;
    u.ctx.fillStyle = own(band.colour);
    u.ctx.fill(shape);
  };
  const drawMarker = (u, marker) => {
    const {left, top, width, height} = u.bbox, ratio = devicePixelRatio, context = u.ctx;
    const at = u.valToPos(marker.at, marker.vertical ? 'x' : 'y', true);
    const [from, length] = marker.vertical ? [left, width] : [top, height];
    if (!(at >= from && at <= from + length)) return;
    context.strokeStyle = context.fillStyle = own(marker.colour);
    context.lineWidth = ratio;
    context.setLineDash([6 * ratio, 4 * ratio]);
    context.beginPath();
    context.moveTo(...(marker.vertical ? [at, top] : [left, at]));
    context.lineTo(...(marker.vertical ? [at, top + height] : [left + width, at]));
    context.stroke();
    context.font = `${11 * ratio}px system-ui, sans-serif`;
    context.textAlign = marker.vertical ? 'left' : 'right';
    context.textBaseline = marker.vertical ? 'top' : 'bottom';
    const place = marker.vertical ? [at + 4 * ratio, top + 3 * ratio] : [left + width - 4 * ratio, at - 3 * ratio];
    context.fillText(marker.name, ...place);
  };
  const within = draw => u => {
    u.ctx.save();
    u.ctx.beginPath();
    u.ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
    u.ctx.clip();
    draw(u);
    u.ctx.restore();
  };

  // The point of a curve that the cursor means: at its abscissa, or the nearest where the curve turns back.
  const nearest = (u, curve) => {
    const [xs, ys] = curve.columns, {left, top} = u.cursor;
    if (left < 0) return null;
    if (curve.rising) {
      const wanted = u.posToVal(left, 'x');
      let low = 0, high = xs.length - 1;
      while (high - low > 1) {
        const middle = (low + high) >> 1;
        // A gap has no abscissa; its neighbours have.
        let known = middle;
        while (known > low && Number.isNaN(xs[known])) known--;
        if (xs[known] <= wanted) low = middle; else high = middle;
      }
      const off = at => Number.isFinite(ys[at]) ? Math.abs(xs[at] - wanted) : Infinity;
      const at = off(low) < off(high) ? low : high;
      return off(at) < Infinity ? at : null;
    }
    let best = 30 * 30, found = null;
    for (let at = 0; at < xs.length; at++) {
      const right = u.valToPos(xs[at], 'x') - left, down = u.valToPos(ys[at], 'y') - top;
      const distance = right * right + down * down;
      if (distance < best) [best, found] = [distance, at];
    }
    return found;
  };

  const make = host => {
    const chart = JSON.parse(host.querySelector('script').textContent);
    for (const old of host.querySelectorAll(':scope > :not(script)')) old.remove();
    for (const curve of chart.curves) curve.columns = decoded(curve.data, 2);
    for (const band of chart.bands) band.columns = decoded(band.data, 3);
    if (chart.title) element('h3', 'chart-title', host, chart.title);
    const keys = element('div', 'keys', host), plot = element('div', 'plot', host);
    const tip = element('div', 'tip', plot);
    const marks = vertical => chart.markers.filter(own => own.vertical === vertical).map(own => own.at);
    const columns = at => [...chart.curves.map(own => own.columns[at]), ...chart.bands.flatMap(own => at ? own.columns.slice(1) : [own.columns[0]])];
    const whole = {x: ends(chart.x, columns(0), marks(true), 0.015), y: ends(chart.y, columns(1), marks(false), 0.06)};
    const scale = key => ({
      time: false, auto: false, distr: chart[key].log ? 3 : 1,
      range: (u, low, high) => low < high ? [low, high] : whole[key],
    });
    const axis = key => ({
      scale: key, label: chart[key].label, labelSize: 22, labelFont: '12px system-ui, sans-serif',
      font: '11px system-ui, sans-serif', size: key === 'x' ? 34 : 58, stroke: variable('--ink'),
      grid: {stroke: variable('--line'), width: 1}, ticks: {stroke: variable('--line'), width: 1, size: 5},
      ...(chart[key].log ? {splits: (u, at, low, high) => decades(low, high), filter: (u, splits) => splits} : {}),
      values: (u, splits) => splits.map(value => value == null ? '' : written(+value.toPrecision(12))),
    });
    const zoom = (u, key, to) => u.setScale(key, {min: to[0], max: to[1]});
    const reset = u => { zoom(u, 'x', whole.x); zoom(u, 'y', whole.y); };
    const found = [];
    const point = u => {
      const lines = [];
      chart.curves.forEach((curve, at) => {
        const index = u.series[at + 1].show ? found[at + 1] : null;
        if (index == null) return;
        const line = document.createElement('div');
        element('i', 'swatch', line).style.background = own(curve.colour);
        const [x, y] = curve.columns.map(column => written(column[index]));
        line.append(`${curve.name || chart.y.label}: ${curve.rising ? '' : x + ' → '}${y}`);
        lines.push([line, x, curve.rising]);
      });
      tip.replaceChildren();
      tip.style.display = lines.length && u.cursor.left >= 0 ? 'block' : 'none';
      if (!lines.length) return;
      const head = lines[0][2] ? `${chart.x.label}: ${lines[0][1]}` : `${chart.x.label} → ${chart.y.label}`;
      tip.append(head, ...lines.map(line => line[0]));
      const left = u.cursor.left + u.bbox.left / devicePixelRatio, wide = plot.clientWidth;
      tip.style.top = '8px';
      tip.style.left = left < wide / 2 ? `${left + 16}px` : '';
      tip.style.right = left < wide / 2 ? '' : `${wide - left + 16}px`;
    };
    const follow = (u, key) => {
      if (key !== 'x' || !chart.time || u.status !== 1) return;
      const {min, max} = u.scales.x;
      for (const other of drawn)
        if (other.u !== u && other.chart.time) {
          const unit = other.chart.x.unit / chart.x.unit, now = other.u.scales.x;
          const to = [min * unit, max * unit], close = 1e-9 * (to[1] - to[0]);
          if (Math.abs(now.min - to[0]) > close || Math.abs(now.max - to[1]) > close) zoom(other.u, 'x', to);
        }
    };
    const u = new uPlot({
      mode: 2, width: plot.clientWidth, height: 300, legend: {show: false},
      scales: {x: scale('x'), y: scale('y')}, axes: [axis('x'), axis('y')],
      series: [null, ...chart.curves.map(curve => ({
        facets: [{scale: 'x', auto: false}, {scale: 'y', auto: false}], paths: path(curve.style), points: {show: false},
        stroke: own(curve.colour), fill: curve.style === 'points' ? own(curve.colour) : null,
        // Curves that turn back lie upon each other.
        width: 1.4, alpha: curve.rising ? 1 : 0.75, dash: curve.style === 'dashed' ? [6, 4] : [],
      }))],
      cursor: {
        drag: {x: true, y: true, uni: 25, dist: 5}, points: {size: 6, width: 1},
        dataIdx: (u, at) => found[at] = nearest(u, chart.curves[at - 1]),
        bind: {dblclick: u => () => { reset(u); return null; }},
      },
      hooks: {
        drawAxes: [within(u => chart.bands.forEach(band => drawBand(u, band)))],
        draw: [within(u => chart.markers.forEach(marker => drawMarker(u, marker)))],
        setCursor: [point], setScale: [follow],
      },
    }, [null, ...chart.curves.map(curve => curve.columns)], plot);
    reset(u);
    chart.curves.forEach((curve, at) => {
      if (!curve.name) return;
      const key = element('button', 'key', keys);
      element('i', `swatch ${curve.style}`, key).style.background = own(curve.colour);
      key.append(curve.name);
      key.title = 'hide or show';
      // Unnamed curves of the same colour go with the named one.
      const same = chart.curves.flatMap((other, index) =>
        index === at || (!other.name && other.colour[0] === curve.colour[0]) ? [index + 1] : []);
      key.onclick = () => {
        const show = !u.series[at + 1].show;
        same.forEach(index => u.series[index].show = show);
        key.setAttribute('aria-pressed', String(!show));
        u.redraw(false);
      };
    });
    for (const band of chart.bands.filter(band => band.name)) {
      const key = element('span', 'key', keys);
      element('i', 'swatch band', key).style.background = own(band.colour);
      key.append(band.name);
    }
    new ResizeObserver(() => {
      if (plot.clientWidth && plot.clientWidth !== u.width) u.setSize({width: plot.clientWidth, height: 300});
    }).observe(plot);
    return {u, chart};
  };

  const all = () => {
    drawn.forEach(own => own.u.destroy());
    drawn = [];
    for (const host of document.querySelectorAll('.chart')) drawn.push(make(host));
  };
  dark.addEventListener('change', all);
  addEventListener('beforeprint', () => { printing = true; all(); });
  addEventListener('afterprint', () => { printing = false; all(); });
  all();
})();
