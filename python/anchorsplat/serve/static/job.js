'use strict';
// What is known about a job, in words. No state here; app.js has it.

function bytesText(n) {
  for (const [unit, size] of [['GB', 1e9], ['MB', 1e6], ['kB', 1e3]]) {
    if (n >= size) return `${(n / size).toPrecision(3)} ${unit}`;
  }
  return `${n} bytes`;
}

const countText = (n) => Number(n).toLocaleString('en');

function factsText(job) {
  const facts = [];
  if (job.input.gaussians) facts.push(`${countText(job.input.gaussians)} Gaussians`);
  if (job.input.format) facts.push(job.input.format);
  if (job.input.bytes) facts.push(bytesText(job.input.bytes));
  if (job.kind === 'enhance') facts.push(`${job.options.quality}, ${job.options.upscale}× closer`);
  if (job.kind === 'convert') facts.push(`to ${job.options.to}`);
  if (job.input.cameras) facts.push('with cameras');
  return facts.join(' · ');
}

function stateText(job) {
  switch (job.state) {
    case 'queued': return job.position > 1 ? `Waiting: ${job.position - 1} before it.` : 'Waiting: it is the next.';
    case 'running': {
      const p = job.progress;
      return p && p.total > 0 ? `Working: ${p.task}, ${countText(p.done)} of ${countText(p.total)}.` : 'Working…';
    }
    case 'done': return `Done in ${job.report.seconds < 1 ? 'less than a second' : `${job.report.seconds.toFixed(1)} s`}.`;
    case 'failed': return 'This did not work.';
    default: return 'Cancelled.';
  }
}

const isOver = (job) => ['done', 'failed', 'cancelled'].includes(job.state);

async function errorText(response) {
  try {
    return (await response.json()).error.message;
  } catch {
    return `The service answered with ${response.status}.`;
  }
}

// Calls `changed` with the job now and whenever it changes, until it is over; `gone` when there is no such job (any more).
// Returns what ends it. The browser connects again by itself when the service was away.
function watchJob(id, changed, gone) {
  const source = new EventSource(`/v1/jobs/${encodeURIComponent(id)}/events`);
  source.onmessage = (event) => {
    const job = JSON.parse(event.data);
    if (isOver(job)) source.close();
    changed(job);
  };
  source.addEventListener('gone', () => { source.close(); gone(); });
  source.onerror = async () => {
    if (source.readyState !== EventSource.CLOSED) return;
    const response = await fetch(`/v1/jobs/${encodeURIComponent(id)}`).catch(() => null);
    if (response && response.status === 404) gone();
    else if (response && response.status === 401) location.reload();
  };
  return () => source.close();
}

// POSTs a form and says how much of it has gone. Resolves with {status, body, wait}; status 0: the connection ended.
function send(path, form, sent) {
  return new Promise((resolve) => {
    const request = new XMLHttpRequest();
    request.open('POST', path);
    request.responseType = 'text';
    request.upload.onprogress = (event) => { if (event.lengthComputable) sent(event.loaded, event.total); };
    request.onerror = () => resolve({status: 0, body: null, wait: 0});
    request.onload = () => {
      let body = null;
      try { body = JSON.parse(request.responseText); } catch { /* no JSON: said by its status */ }
      resolve({status: request.status, body, wait: Number(request.getResponseHeader('Retry-After')) || 0});
    };
    request.send(form);
  });
}
